"""How far apart explanations of about the same worth have a parameter, and who counts it."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from weighing import COULOMB, DRAG, RULE, Candidate, weighed

import pikanid as pk
from pikanid.mismatch.fitting.as_estimate import widened
from pikanid.mismatch.judge.doubt import no_size
from pikanid.mismatch.judge.explanations import Weighed, not_ruled_out, spread
from pikanid.mismatch.report.part import Value, values_of
from pikanid.mismatch.settings.settings import DEFAULTS


def with_parameter(effect: Candidate, name: str) -> Candidate:
    return SimpleNamespace(**{  # type: ignore[return-value]  # a stand-in
        **vars(effect), "parameters": (pk.Parameter(name, 0.0),)})


FRICTION, QUADRATIC = with_parameter(COULOMB, "c"), with_parameter(DRAG, "c")


def found(effects: tuple[Candidate, ...], left: float, **values: float) -> Weighed:
    one = weighed(effects, left, 0.5)
    h: Any = SimpleNamespace(effects=effects, values=values,
                             key=frozenset(e.key for e in effects))
    return replace(one, hypothesis=h)


def test_what_is_not_ruled_out_says_how_sure_a_parameter_is() -> None:
    given = found((FRICTION,), 1.0, m=2.0, c=1.0)
    others = [given,
              found((FRICTION, DRAG), 1.5, m=2.2, c=1.3),
              found((QUADRATIC,), 3.9, m=1.7, c=50.0),  # its c is something else
              found((), 4.1, m=99.0)]
    near = not_ruled_out(given, others, RULE)
    assert spread(given.hypothesis, near) == pytest.approx({
        "m": np.sqrt((0.2**2 + 0.3**2) / 3), "c": np.sqrt(0.3**2 / 2)})


def test_where_nothing_is_left_nothing_counts_but_noise() -> None:
    given = found((FRICTION,), 1e-9, m=2.0)
    near, far = (found((DRAG,), times * RULE.dominance * RULE.floor, m=3.0)
                 for times in (0.9, 1.1))
    assert not_ruled_out(given, [given, near, far], RULE) == [given.hypothesis, near.hypothesis]


def test_its_square_is_added_to_variances_of_shared_parameters() -> None:
    model = pk.systems.sloshing().per_recording("d_theta")
    recording = pk.simulate(model, pk.excitation.two_pulse(), sigma=0.01, seed=0)
    est = pk.NLS(starts=1).fit(model, recording)
    wider = widened(est, 4.0, {"l_theta": 0.5, "d_theta": 0.5})
    assert wider.std("l_theta") == pytest.approx(np.hypot(2 * est.std("l_theta"), 0.5))
    assert wider.std("d_theta", 0) == pytest.approx(2 * est.std("d_theta", 0))
    p = pk.Parameter("c", 0.0, "N")
    assert values_of((p,), {"c": 2.0}, {"c": 0.1}, 9.0, {"c": 0.4})["c"] == Value(
        2.0, pytest.approx(0.5), "N")


@pytest.mark.parametrize(("spread", "sure"), [(0.0, True), (0.5, True), (0.8, False)])
def test_a_size_that_others_have_far_otherwise_may_be_nothing(spread: float, sure: bool) -> None:
    """Of 2.0 ± 0.2, by the noise alone, and with how far apart other explanations have it."""
    effect: Any = SimpleNamespace(name="drag", parameters=(pk.Parameter("c", 0.0),))
    h: Any = SimpleNamespace(values={"c": 2.0}, std={"c": 0.1})
    assert (no_size(effect, h, 4.0, DEFAULTS, {"c": spread}) == "") is sure
