"""Laws that another one contains, where the recordings do not tell them apart, are one."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from pikanid.mismatch.catalogue.candidate import Candidate, Limit
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.judge.same_law import merged_twins
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.model.parts import Parameter

N = Parameter("n", 1.5, "", (0.2, 4.0))


def law(name: str, place: str = "v", alike: str = "", **more: Any) -> Candidate:
    plain = {"exponent": None, "limit": None, "covers": {}, "known": True, "refines": False}
    return cast(Candidate, SimpleNamespace(
        key=name, name=name, ids=(name,), names=(name,), alike=alike,
        site=SimpleNamespace(v=place, half_range=1.0, suffix=""), **{**plain, **more}))


def fit(effect: Candidate, **fitted: tuple[float, float]) -> Hypothesis:
    return cast(Hypothesis, SimpleNamespace(
        key=frozenset({effect.key}), effects=(effect,),
        values={n: value for n, (value, _) in fitted.items()},
        std={n: std for n, (_, std) in fitted.items()},
        model=SimpleNamespace(parameter=lambda name: N)))


COULOMB = fit(law("coulomb_friction", alike="coulomb of v", exponent=0.0))
ROUNDED = fit(law("rounded", alike="coulomb of v", covers={"coulomb_friction": {}}))


def names(given: list[Hypothesis]) -> list[str]:
    return [h.effects[0].key for h in given]


@pytest.mark.parametrize(("exponent", "kept"), [
    ((0.3, 0.6), ["coulomb_friction"]), ((1.4, 0.2), ["power_drag", "coulomb_friction"])])
def test_a_power_law_that_may_be_dry_friction_is_no_rival_of_it(
        exponent: tuple[float, float], kept: list[str]) -> None:
    """Whatever other law contains dry friction as well, and stands before it."""
    power = fit(law("power_drag", exponent=N, covers={"coulomb_friction": {}}), n=exponent)
    given, twins = merged_twins([power, COULOMB], [ROUNDED, power, COULOMB], DEFAULTS.verdict)
    assert names(given) == kept
    assert ("power_drag" in twins[COULOMB.key]["coulomb_friction"].ids) == (len(kept) == 1)


@pytest.mark.parametrize(("place", "width", "kept"), [
    ("v", (0.36, 0.33), ["coulomb_friction"]),
    ("v", (0.36, 0.05), ["hysteresis", "coulomb_friction"]),
    ("w", (0.36, 0.33), ["hysteresis", "coulomb_friction"])])
def test_a_loop_whose_width_may_be_nothing_is_dry_friction_of_its_place(
        place: str, width: tuple[float, float], kept: list[str]) -> None:
    loop = fit(law("hysteresis", place, limit=Limit("z", ("coulomb_friction",))), z=width)
    given, twins = merged_twins([loop, COULOMB], [loop, COULOMB], DEFAULTS.verdict)
    assert names(given) == kept
    assert ("hysteresis" in twins[COULOMB.key]["coulomb_friction"].ids) == (len(kept) == 1)
    # by itself it keeps its name, whatever is not known of it
    [alone], _ = merged_twins([loop], [loop, COULOMB], DEFAULTS.verdict)
    assert alone is loop
