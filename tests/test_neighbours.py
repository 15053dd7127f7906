"""Hypotheses next to one: which they are, and that a search comes back to what it passed by."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

import pikanid as pk
from pikanid.mismatch.case import Case
from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.fitting.hypothesis import Hypothesis, fitted
from pikanid.mismatch.search.neighbours import (
    Job,
    closest_of_each,
    with_parts,
    with_relatives,
    with_simpler,
    with_twins,
    with_wider,
    without_one,
)
from pikanid.mismatch.search.screen import Screen, as_strong, drag, law, nothing
from pikanid.mismatch.search.search import Search
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.mismatch.steps.opening import open_case
from pikanid.optimise.levenberg_marquardt import Minimum


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


def stand_ins(case: Case, rise: float, *names: str, best: float = 1.0) -> Search:
    """A search that has fitted each of these effects alone: χ² per row `best`, and `rise` more from
    one to the next.
    """
    search, rows = case.begin_search(), case.base.whitened.rows
    listed = {c.key: c for c in case.candidates}
    fits = {frozenset(): replace(case.base, minimum=replace(
        case.base.minimum, r=np.full(rows, np.sqrt(2.0 * best))))}
    for k, name in enumerate(names):
        r = np.full(rows, np.sqrt(best + k * rise / rows))
        fits[frozenset({name})] = replace(case.base, effects=(listed[name],), minimum=replace(
            case.base.minimum, r=r))
    return replace(search, fits=fits, begun=set())


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


def test_no_more_effects_are_put_together_than_the_budget_has(case: Case) -> None:
    few = replace(case.records, settings=DEFAULTS.with_values({"budget.effects": 1}))
    search = replace(case.search, records=few, fits={}, begun=set())
    search.base()
    alone = search._fit([c for c in case.candidates if c.key == "cubic_stiffness"], [{}])
    assert len(alone.effects) == 1
    search._extend(alone, 5, anyway=True)
    assert max(map(len, search.fits)) == 1


MANY = ("sensor_offset", "sensor_drift", "sensor_gain", "sensor_lag", "input_gain", "input_delay",
        "quadratic_drag", "coulomb_friction", "cubic_stiffness", "quadratic_stiffness",
        "input_saturation", "input_dead_zone", "sensor_saturation", "actuator_lag")


@pytest.mark.parametrize("best", [1.0, 1e4])
def test_the_best_go_along_to_other_records(case: Case, best: float,
                                            monkeypatch: pytest.MonkeyPatch) -> None:
    """Few where none of them explains the first ones; the nominal model goes on where it stood."""
    names = [n for n in MANY if n in {c.key for c in case.candidates}]
    budget = DEFAULTS.budget
    assert len(names) > budget.carried > budget.carried_far
    search, asked = stand_ins(case, best, *names, best=best), list[list[frozenset[str]]]()

    def noted(self: Search, jobs: Sequence[Job], **_: object) -> None:
        asked.append([frozenset(e.key for e in effects) for effects, _ in jobs])

    monkeypatch.setattr(Search, "_fit_all", noted)
    monkeypatch.setattr(Search, "base", lambda self: case.base)
    new = search.carried_over(case.records)
    assert new.fits == {} and new.records is case.records
    count = budget.carried_far if best > 1.0 else budget.carried
    assert asked == [[frozenset()], [frozenset({n}) for n in names[:count]]]


def test_contenders_score_about_as_well_as_the_best(case: Case) -> None:
    search = stand_ins(case, DEFAULTS.verdict.indistinct / 2.4, *MANY[:4])
    assert [set(h.key) for h in search._contenders()] == [
        {"sensor_offset"}, {"sensor_drift"}, {"sensor_gain"}]


def test_laws_are_added_to_the_best_hypothesis_whatever_they_promise(
        case: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    search, asked = stand_ins(case, 5.0, "sensor_offset", "sensor_drift"), list[object]()

    def noted(self: Search, h: Hypothesis, count: int, least: float = 0.0,
              always: object = nothing, anyway: bool = False) -> None:
        asked.append((set(h.key), count, always))

    monkeypatch.setattr(Search, "_extend", noted)
    for name in ("_fit_all", "_simplify"):
        monkeypatch.setattr(Search, name, lambda *_, **__: None)
    ranked, count = search.grow(lambda h: False), DEFAULTS.budget.beside_one
    assert asked == [({"sensor_offset"}, count, law), ({"sensor_drift"}, count, nothing)]
    wanted = [{"sensor_offset"}, {"sensor_drift"}, set()]
    assert [set(h.key) for h in ranked] == wanted
    assert [set(h.key) for h in search.grow(lambda h: True)] == wanted


def test_effects_are_added_until_one_is_not_worth_it_elsewhere(
        case: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    """Asked about the best hypothesis so far and about the better one that has grown out of it."""
    search, listed = stand_ins(case, 5.0), {c.key: c for c in case.candidates}
    made = [tuple(listed[n] for n in MANY[:count]) for count in range(5)]
    asked, rows = list[tuple[int, int]](), case.base.whitened.rows

    def grown(self: Search, h: Hypothesis, *_: object, **__: object) -> None:
        effects = made[min(len(h.effects) + 1, 4)]
        key = frozenset(e.key for e in effects)
        r = np.full(rows, np.sqrt(2.0 * 0.8 ** len(effects)))
        self.fits[key] = replace(case.base, effects=effects,
                                 minimum=replace(case.base.minimum, r=r))

    def worth(fewer: Hypothesis, more: Hypothesis) -> bool:
        asked.append((len(fewer.effects), len(more.effects)))
        return len(more.effects) < 3

    monkeypatch.setattr(Search, "_extend", grown)
    for name in ("_fit_all", "_simplify"):
        monkeypatch.setattr(Search, name, lambda *_, **__: None)
    monkeypatch.setattr("pikanid.mismatch.search.neighbours.with_other_form", lambda *_: ())
    search.predicts = worth
    grown(search, search.ranked()[0])
    assert len(search.grow(lambda h: False)[0].effects) == 3
    assert asked == [(2, 3)]


@pytest.mark.parametrize("limit", [1.0, 3.0])
def test_settings_say_what_explains_nothing_beyond_hills(
        case: Case, limit: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """χ² of two a row: what levels of the motion decide was looked for in vain, or not."""
    sharp = next(c for c in case.candidates if c.levels)
    records = replace(case.records, settings=DEFAULTS.with_values({"fits.lost": limit}))
    rows = case.base.whitened.rows
    found = replace(case.base, effects=(sharp,), minimum=replace(
        case.base.minimum, r=np.full(rows, np.sqrt(2.0))))
    search = replace(stand_ins(case, 1.0), records=records, failed_searches=set())
    monkeypatch.setattr("pikanid.mismatch.search.search.fitted", lambda *_: found)
    search._fit_all([((sharp,), [{}])], always=True)
    assert search.failed_searches == ({frozenset({sharp.key})} if limit < 2.0 else set())


def test_a_search_goes_on_with_other_records(case: Case) -> None:
    other, given = SimpleNamespace(base=lambda: hypothesis(case)), list[object]()

    def carried_over(records: object) -> object:
        given.append(records)
        return other

    same = replace(case, tests={(frozenset(), 1.0): cast(Any, None)},
                   predictions={(frozenset(), 1.0): None})
    search = cast(Search, SimpleNamespace(carried_over=carried_over))
    assert same.resumed(search) is cast(Any, other) and same.search is cast(Any, other)
    assert given == [case.records] and not same.tests and not same.predictions
    assert same.base.key == frozenset()


@pytest.mark.parametrize("failed", [False, True])
def test_what_was_looked_for_beyond_hills_in_vain_is_settled(
        case: Case, failed: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """And a fit that comes to nothing leaves no trace among the fits."""
    search, asked = stand_ins(case, 1.0, "sensor_offset"), list[object]()
    job = [c for c in case.candidates if c.key == "sensor_drift"]
    key, settled = frozenset({"sensor_drift"}), frozenset({"sensor_gain"})
    search = replace(search, failed_searches={key} if failed else set())
    before = dict(search.fits)

    def no_fit(*arguments: object) -> None:
        asked.append(arguments[-1])

    monkeypatch.setattr("pikanid.mismatch.search.search.fitted", no_fit)
    search._fit_all([(job, [{}])], always=True, settled=settled)
    assert asked == [key if failed else settled]
    assert search.fits == before and len(search.begun) == 1


def test_effects_lead_the_nominal_model_out_of_a_wrong_minimum() -> None:
    """Nothing is missing; effects that begin where the nominal model was held explain everything,
    and would be named if it stayed there.
    """
    model = pk.systems.sloshing()
    train, later = (pk.simulate(model, pk.excitation.planar_moves(6, 10.0, seed=seed),
                                sigma=0.002, seed=seed) for seed in (1, 2))
    search = open_case(model, (train,), (later,), None, lambda text: None, DEFAULTS).search
    right = search.base()
    theta = right.minimum.theta * np.array([1.03, 1.5])
    elsewhere = right.whitened.residual(theta)
    assert elsewhere is not None
    search.fits[frozenset()] = replace(right, minimum=Minimum(theta, *elsewhere, False))
    assert search.base().minimum.chi2 > 100 * right.minimum.chi2
    assert search.run(lambda h: not h.far)[0].effects == ()
    assert search.base().minimum.chi2 == pytest.approx(right.minimum.chi2, abs=0.5)
