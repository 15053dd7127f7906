"""Hypotheses next to one: which they are."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from opened import case, hypothesis, keys

from pikanid.mismatch.case import Case
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.judge.same_law import signature
from pikanid.mismatch.search.leaders import closest_of_each
from pikanid.mismatch.search.neighbours import (
    with_curves,
    with_parts,
    with_relatives,
    with_shapes,
    with_simpler,
    with_sums,
    with_twins,
    with_wider,
    without_one,
)
from pikanid.mismatch.search.screen import Screen, as_strong, drag
from pikanid.mismatch.settings.settings import DEFAULTS

__all__ = ["case"]  # the fixture


def test_neighbours_differ_in_one_effect(case: Case) -> None:
    h = hypothesis(case, "cubic_stiffness", "sensor_offset")
    assert [keys(effects) for effects, _ in without_one(h)] == [
        {"sensor_offset"}, {"cubic_stiffness"}]
    assert [keys(effects) for effects, _ in with_twins(h, case.candidates)] == [
        {"cubic_stiffness", "static_bias"}]
    assert not list(without_one(hypothesis(case, "cubic_stiffness")))


def test_laws_that_hold_others_are_neighbours_both_ways(case: Case) -> None:
    drag = hypothesis(case, "quadratic_drag", c_q=0.01)
    wider = [keys(effects) for effects, _ in with_wider(drag, case.candidates)]
    assert {"power_drag"} in wider
    power = hypothesis(case, "power_drag", c_n=0.01)
    simpler = [keys(effects) for effects, _ in with_simpler(power, case.candidates)]
    assert simpler == [{"coulomb_friction"}, {"quadratic_drag"}]


def test_the_shape_of_a_law_is_nuisance(case: Case) -> None:
    """Leaving it open is no other name, and costs nothing beside names that assume it."""
    ideal = hypothesis(case, "coulomb_friction", "sensor_offset", c=0.05)
    jobs = list(with_shapes(ideal, case.candidates))
    assert [keys(effects) for effects, _ in jobs] == [
        {"coulomb_friction[rounded]", "sensor_offset"}]
    rounded = hypothesis(case, "coulomb_friction[rounded]", "sensor_offset", c=0.05)
    assert not list(with_shapes(rounded, case.candidates))
    assert signature(rounded) == signature(ideal) != signature(
        hypothesis(case, "quadratic_drag", "sensor_offset"))
    assert ideal.assumed == rounded.begun == 0.0
    assert rounded.assumed == pytest.approx(np.log(rounded.whitened.rows))


def test_a_law_that_is_a_sum_is_split_into_its_parts(case: Case) -> None:
    """What is there of a part already is added to."""
    one_way = hypothesis(case, "one_way_friction[back]", "coulomb_friction", c_one=0.2, c=0.05)
    jobs = [(keys(effects), starts[0]) for effects, starts in with_parts(
        one_way, case.search.candidates)]
    assert [k for k, _ in jobs] == [{"coulomb_friction", "static_bias"},
                                    {"coulomb_friction", "static_bias[held]"}]
    start = cast(Mapping[str, float], jobs[0][1])
    values = one_way.values
    assert start["c"] == pytest.approx(values["c"] + values["c_one"] / 2)
    assert start["bias"] == pytest.approx(values["c_one"] / 2)
    assert not list(with_parts(hypothesis(case, "cubic_stiffness"), case.candidates))
    # no more effects than are tried together
    few = copy(one_way.whitened)
    few.settings = DEFAULTS.with_values({"budget.effects": 1})
    assert not list(with_parts(replace(one_way, whitened=few), case.search.candidates))


@pytest.mark.parametrize(("bias", "way"), [(0.1, "back"), (-0.1, "forth")])
def test_effects_that_are_the_parts_of_one_law_are_that_law(case: Case, bias: float, way: str
                                                            ) -> None:
    """Coulomb friction of 0.1 and a constant force of as much: friction of 0.2 in one direction."""
    h = hypothesis(case, "coulomb_friction", "static_bias", "cubic_stiffness")
    index = [f.name for f in h.whitened.problem.free].index
    theta = h.minimum.theta.copy()
    theta[index("c")], theta[index("bias")] = 0.1, bias
    h = replace(h, minimum=replace(h.minimum, theta=theta))
    [(effects, (start,))] = with_sums(h, case.search.candidates)
    assert keys(effects) == {f"one_way_friction[{way}]", "cubic_stiffness"}
    assert cast(Mapping[str, float], start)["c_one"] == pytest.approx(0.2)
    assert not list(with_sums(hypothesis(case, "coulomb_friction", "cubic_stiffness"),
                              case.search.candidates))


def test_a_scale_error_may_be_the_slope_of_a_curve(case: Case) -> None:
    h = hypothesis(case, "input_gain", "cubic_stiffness")
    jobs = {frozenset(keys(effects)): starts for effects, starts in with_curves(
        h, case.candidates)}
    assert all("cubic_stiffness" in k and "input_gain" not in k for k in jobs)
    dead = jobs[frozenset({"input_dead_zone", "cubic_stiffness"})]
    # from every level, small and large, with all else as it was
    levels = [cast(Mapping[str, float], start)["u_dead"] for start in dead]
    assert len(levels) > 4 and max(levels) > 30 * min(levels) > 0
    assert {cast(Mapping[str, float], start)["k3"] for start in dead} == {h.values["k3"]}
    assert frozenset({"sensor_nonlinearity", "cubic_stiffness"}) in jobs
    assert not list(with_curves(hypothesis(case, "cubic_stiffness"), case.candidates))


def test_relatives_are_of_one_family_and_not_there_yet(case: Case) -> None:
    h = hypothesis(case, "quadratic_drag", "amplitude_damping", q2=0.01)
    drag = next(e for e in h.effects if e.key == "quadratic_drag")
    found = [keys(effects) - {"amplitude_damping"}
             for effects, _ in with_relatives(h, drag, case.candidates)]
    assert {"power_drag"} in found and {"boundary_layer"} in found
    assert set() not in found and {"coulomb_friction"} not in found
    assert all(len(one) == 1 for one in found)


def test_a_gain_beside_a_restoring_force_may_be_a_stiffness(case: Case) -> None:
    h = hypothesis(case, "cubic_stiffness", "sensor_gain")
    assert {"cubic_stiffness", "linear_stiffness"} in [
        keys(effects) for effects, _ in with_twins(h, case.search.candidates)]


def test_most_effects_come_first() -> None:
    made = [SimpleNamespace(effects=(1,) * n, known=known, minimum=SimpleNamespace(chi2=chi2))
            for n, known, chi2 in ((1, True, 1.0), (2, True, 9.0), (2, True, 7.0), (3, True, 8.0),
                                   (3, False, 2.0), (4, True, 6.0))]
    found = closest_of_each(cast(list[Hypothesis], made))
    assert [(len(h.effects), h.minimum.chi2) for h in found] == [(4, 6.0), (3, 8.0), (2, 7.0)]


def test_a_law_in_anothers_place_takes_as_much_energy(case: Case) -> None:
    h = hypothesis(case, "quadratic_drag", q2=0.01)
    theta = [0.3 if f.name == "q2" else v
             for f, v in zip(h.whitened.problem.free, h.minimum.theta, strict=True)]
    h = replace(h, minimum=replace(h.minimum, theta=np.array(theta)))
    listed = {c.key: c for c in case.candidates}
    at = h.model.state_names.index("theta_dot")
    (response,) = h.whitened.responses(h.minimum.theta, states=True)
    speed = np.abs(response.states[:, at])
    lost = h.values["q2"] * np.mean(speed**3)
    for name, more, power in (("power_drag", [2.6], 2.6), ("power_drag", [0.5], 0.5),
                              ("coulomb_friction", [], 0.0)):
        size = as_strong(h, h.effects[0], listed[name], more)
        assert size * np.mean(speed ** (1.0 + power)) == pytest.approx(lost, rel=1e-9)
    # a spring takes none: then nothing is known
    assert as_strong(h, h.effects[0], listed["cubic_stiffness"]) == h.values["q2"] == 0.3


def test_no_pair_begins_with_a_law_that_gives_energy(case: Case) -> None:
    screen = Screen(case.base, [c for c in case.candidates if c.fits and c.suits()])
    listed = screen.pairs(200)
    sided = [(start.values[e.parameters[0].name], e.key) for both, (start,) in listed
             for e in both if drag(e)]
    assert sided and min(sided)[0] > 0.0
    assert all(len({e.key for e in both}) == 2 for both, _ in listed)
