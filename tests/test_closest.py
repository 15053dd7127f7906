"""What comes closest where nothing is sure, and what keeps it from being sure."""

from __future__ import annotations

import json
from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import pytest
from weighing import COULOMB, DRAG, weighed

import pikanid as pk
from pikanid.estimate import Estimate
from pikanid.mismatch.judge.explanations import Explanations, Weighed
from pikanid.mismatch.judge.partial import Part, surely_there
from pikanid.mismatch.report.diagnosis import Diagnosis
from pikanid.mismatch.report.findings import Where
from pikanid.mismatch.report.part import Closest
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.reporting.diagnosis_page import _closest


def judged(*found: Weighed) -> Part:
    return surely_there(Explanations(found, 1.0), 1.0, DEFAULTS)


def test_what_explains_too_little_is_no_more_than_closest() -> None:
    part = judged(weighed((COULOMB, DRAG), 1.0, 0.99, share=0.65),
                  weighed((COULOMB,), 1.1, 0.005, share=0.6),
                  weighed((DRAG,), 9.0, 0.005, share=0.2))
    assert part.present == () and part.share == 0.65
    # what only the share keeps from being sure stands first
    assert [(d.family, d.why.split(",")[0]) for d in part.doubtful] == [
        ("dry friction",
         "the best explanation with it explains 65% of the held-out misfit"),
        ("drag", "without it the best explanation leaves 1.1 times as much")]


def test_doubts_are_kept_where_nothing_dominates() -> None:
    part = judged(weighed((COULOMB,), 1.0, 0.999), weighed((DRAG,), 1.5, 0.001),
                  weighed((), 1.8, 0.0, share=0.0))
    assert part.present == ()
    assert [d.why for d in part.doubtful] == [
        "without it the best explanation leaves 1.5 times as much, sure from 4 on"]


def test_the_nominal_model_comes_close_to_nothing() -> None:
    assert judged(weighed((), 1.0, 1.0, share=0.0)).doubtful == ()


def test_it_is_told_everywhere() -> None:
    nothing = cast(Estimate, SimpleNamespace(
        model=pk.systems.sloshing(), free=(), theta=(), covariance=(), at_bound=()))
    dx = Diagnosis("unnamed", 1e-9, DEFAULTS, Where((), "v", (), (), None), (), (), nothing,
                   nothing, None, closest=Closest(
                       ("a drag", "a wall"), (("drag",), ("wall",)), 0.654,
                       (("drag", "its probability is 0.9"), ("restoring force", "it is small"))))
    assert ("\nClosest, and not sure: a drag and a wall: 65 % of the held-out misfit is explained\n"
            "Not sure: drag: its probability is 0.9\n") in str(dx)
    content = json.loads(json.dumps(dx.to_dict(), allow_nan=False))["closest"]
    assert content == {"effects": [["drag"], ["wall"]], "share_explained": 0.654, "doubtful": [
        {"family": "drag", "why": "its probability is 0.9"},
        {"family": "restoring force", "why": "it is small"}]}
    assert _closest(dx).count("<li>") == 2 and "a drag and a wall" in _closest(dx)
    none = replace(dx, closest=None)
    assert "Closest" not in str(none) and _closest(none) == ""
    assert none.to_dict()["closest"] is None


@pytest.mark.slow
def test_of_a_law_that_nobody_knows_what_comes_closest_is_said() -> None:
    """A force that a sine of position and time is: nothing is sure of it."""
    truth = pk.systems.sloshing().with_term(
        "theta_dot", "-a*sin(60*theta + 3*t)", [pk.Parameter("a", 0.6)])
    train, other = (pk.simulate(truth, pk.excitation.planar_moves(3, 5.0, seed=seed),
                                sigma=0.002, seed=seed) for seed in (1, 2))
    dx = pk.diagnose(pk.systems.sloshing(), train, other)
    assert dx.verdict == "unnamed" and dx.closest is not None and dx.closest.doubtful
    assert 0 < dx.closest.share_explained < DEFAULTS.part.share


def test_what_is_far_off_is_told_as_that() -> None:
    far = Closest(("a drag",), (("drag",),), 0.09, (("drag", "its probability is 0.9"),))
    assert far.lines() == ["Nothing comes close: a drag explains 9 % of the held-out misfit"]
