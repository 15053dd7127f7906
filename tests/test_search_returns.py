"""A search comes back to what it passed by, and goes on elsewhere."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from opened import case, hypothesis

import pikanid as pk
from pikanid.mismatch.case import Case
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.search.neighbours import Job
from pikanid.mismatch.search.screen import law, nothing
from pikanid.mismatch.search.search import Search
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.mismatch.steps.opening import open_case
from pikanid.optimise.levenberg_marquardt import Minimum

__all__ = ["case"]  # the fixture


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
