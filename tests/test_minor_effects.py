"""Minor effects beside what explains most: their name is sure only where they are strong."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest
from test_partial import effect as member
from test_partial import examined
from test_verdict import A, B, answered, hypothesis
from weighing import COULOMB, DRAG, weighed

from pikanid.mismatch.judge.kinds import Kind
from pikanid.mismatch.judge.partial import Part, Present
from pikanid.mismatch.steps.surely import _without_shares


@pytest.mark.parametrize(("nominal", "gain", "verdict"), [
    (20_000.0, 150.0, "unconfirmed"),  # 0.8 % of what both explain, 12 standard deviations
    (20_000.0, 210.0, "named"),        # as little of it, and strong
    (10_000.0, 150.0, "named")])       # as strong, and 1.7 % of it
def test_a_minor_effect_may_stand_for_anything_of_its_size(nominal: float, gain: float,
                                                           verdict: str) -> None:
    given = answered(
        [hypothesis(nominal), hypothesis(1000.0 + gain, A), hypothesis(nominal - 100.0, B),
         hypothesis(1000.0, A, B)], {"": 99.0, "a": 20.0, "b": 99.0})
    assert given.verdict == verdict
    assert ("may stand for anything" in given.doubt) == (verdict == "unconfirmed")


def test_held_out_recordings_count_as_well() -> None:
    fits = [hypothesis(20_000.0), hypothesis(1150.0, A), hypothesis(19_900.0, B),
            hypothesis(1000.0, A, B)]
    assert answered(fits, {"": 99.0, "a": 60.0, "b": 99.0}).verdict == "named"


@pytest.mark.parametrize(("names", "other_minima", "lossy", "sure"), [
    ((), (1.003,), True, {"restoring force"}),
    ((), (1.003,), False, {"restoring force", "drag"}),
    (("wall_impact",), (1.003,), True, {"restoring force", "drag"}),
    ((), (), True, {"restoring force", "drag"})])
def test_a_wall_without_a_name_may_take_energy_out_itself(
        names: tuple[str, ...], other_minima: tuple[float, ...], lossy: bool, sure: set[str]
) -> None:
    wall: Any = SimpleNamespace(**vars(member("wall_impact", "restoring force")),
                                other_minima=other_minima)
    drag: Any = SimpleNamespace(**vars(member("quadratic_drag", "drag")), other_minima=())
    present = (Present(Kind("restoring force", "v"), wall, names, {}, 1.0, 1.0, 200.0, 1.0, 0.95),
               Present(Kind("drag", "v"), drag, ("quadratic_drag",), {}, 1.0, 1.0, 40.0, 1.3, 0.95))
    h: Any = SimpleNamespace(effects=(wall, drag), blurred=frozenset())
    other: Any = SimpleNamespace(**vars(member("dissipating_wall", "restoring force")),
                                 other_minima=(1.003,))
    other.covers = {wall.key: {}}
    likely = [drag, other] if lossy else [drag, wall]
    found = _without_shares(Part(present, (), h, 1.0, 0.95), likely)
    assert {p.family for p in found.present} == sure
    assert {d.family for d in found.doubtful} == {"restoring force", "drag"} - sure
    again = _without_shares(replace(found, doubtful=()), likely)
    assert again.present == found.present


@pytest.mark.parametrize(("rows", "sure"), [(90.0, False), (110.0, True)])
def test_what_gains_little_may_stand_for_anything_however_much_it_dominates(
        rows: float, sure: bool) -> None:
    """Two hundred of χ²: 10 standard deviations in each of two recordings."""
    found = examined(weighed((COULOMB,), 0.1, 0.999, rows=rows),
                     weighed((DRAG,), 2.1, 0.001, rows=rows))
    assert isinstance(found, Present) is sure
    assert sure or "200 are asked" in found.why  # type: ignore[union-attr]
