"""Hypotheses next to one: which they are, and that a search comes back to what it passed by."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

import pikanid as pk
from pikanid.mismatch.case import Case
from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.fitting.hypothesis import Hypothesis, fitted
from pikanid.mismatch.search.neighbours import with_simpler, with_twins, with_wider, without_one
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.mismatch.steps.opening import open_case


@pytest.fixture(scope="module")
def case() -> Case:
    """A pendulum with a cubic spring and an offset of its sensor."""
    model = pk.systems.sloshing()
    truth = model.with_term("theta_dot", "-k3*theta**3", [pk.Parameter("k3", 200.0)]).map_output(
        "theta", function="theta + 0.001")
    train, later = (pk.simulate(truth, pk.excitation.planar_moves(6, 10.0, seed=seed),
                                sigma=0.002, seed=seed) for seed in (1, 2))
    return open_case(model, (train,), (later,), None, lambda text: None, DEFAULTS)


def hypothesis(case: Case, *keys: str, **start: float) -> Hypothesis:
    listed = {c.key: c for c in case.candidates}
    found = fitted(case.model, [listed[k] for k in keys], case.records, [start], 30)
    assert found is not None
    return found


def keys(effects: Sequence[Candidate]) -> set[str]:
    return {e.key for e in effects}


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


def test_a_search_comes_back_to_a_fit_that_lost_its_way(case: Case) -> None:
    search = case.begin_search()
    alone = search._fit([c for c in case.candidates if c.key == "cubic_stiffness"], [{}])
    pair = hypothesis(case, "cubic_stiffness", "sensor_offset")
    both = frozenset({"cubic_stiffness", "sensor_offset"})
    # as a fit from far off may have left it: no better than without the offset
    share = np.sqrt(alone.minimum.chi2 / pair.minimum.chi2)
    search.fits[both] = replace(pair, minimum=replace(pair.minimum, r=share * pair.minimum.r))
    search._extend(alone, 6)
    assert search.fits[both].minimum.chi2 < alone.minimum.chi2 - 10
    assert search.fits[both].minimum.chi2 == pytest.approx(pair.minimum.chi2, abs=0.1)


def test_what_is_given_is_fitted_without_each_effect(case: Case) -> None:
    search = case.begin_search()
    search.fits = {k: h for k, h in search.fits.items() if not k}
    pair = hypothesis(case, "cubic_stiffness", "sensor_offset")
    assert search.closer([pair])
    assert {frozenset({"cubic_stiffness"}), frozenset({"sensor_offset"}),
            frozenset({"cubic_stiffness", "static_bias"})} <= set(search.fits)
    assert not search.closer([pair])


def test_nothing_is_fitted_twice_from_one_place(case: Case) -> None:
    search = case.begin_search()
    job = ([c for c in case.candidates if c.key == "sensor_drift"], [{"l_theta": 0.05}])
    search._fit_all([job], always=True)
    spent = search.spent
    search._fit_all([job], again=True, always=True)
    assert search.spent == spent
    search._fit_all([(job[0], [{"l_theta": 0.04}])], again=True, always=True)
    assert search.spent > spent
