"""From one grid of edges to the next: what is taken, and what goes along."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from tanks import coarse, searching

from pikanid.discrepancy import levels
from pikanid.discrepancy.edges import EdgePlan
from pikanid.discrepancy.fit import penalised_fit
from pikanid.discrepancy.level import Level
from pikanid.discrepancy.levels import Search
from pikanid.discrepancy.offers import step_offers
from pikanid.discrepancy.settings import USUAL
from pikanid.objective.shooting import Accuracy, Shooting


@pytest.mark.parametrize("rise", [-2.0, -0.5, 0.5, 1.5])
def test_a_finer_grid_is_taken_where_its_fit_is_more_evident(
        rise: float, monkeypatch: pytest.MonkeyPatch) -> None:
    def again(search: Search, level: Level, *_: object) -> Level:
        return replace(level, fit=replace(level.fit, evidence=level.fit.evidence + rise))

    monkeypatch.setattr(levels, "finer_gain", lambda *_: np.inf)
    monkeypatch.setattr(Search, "again", again)
    found = searching().finer(coarse(), 16)
    assert (found is not None) == (rise > USUAL.finer)


def test_a_step_that_is_not_there_is_taken_back(monkeypatch: pytest.MonkeyPatch) -> None:
    level = coarse()
    (offer,) = step_offers(level, "x")
    asked: list[list[bool]] = []

    def again(search: Search, stepped: Level, plans: Sequence[EdgePlan], pieces: object) -> Level:
        asked.append([p.step for p in plans])
        return level

    monkeypatch.setattr(Search, "again", again)
    assert searching().pruned(replace(level, plans=offer.plans, fit=offer.fit)) is level
    assert asked == [[False]]
    sure = np.array(offer.fit.theta)
    sure[-1] = 1e3
    stepped = replace(level, plans=offer.plans, fit=replace(offer.fit, theta=sure))
    assert searching().pruned(stepped) is stepped and len(asked) == 1


def test_a_grid_within_another_begins_with_the_same_curve() -> None:
    level = coarse()
    finer = [replace(p, intervals=16) for p in level.plans]
    start = level.regridded(finer)
    c = np.array([start[n] for n in finer[0].coefficient_names])
    a = np.linspace(*finer[0].limits, 77)
    np.testing.assert_allclose(
        finer[0].basis(a) @ c, level.plans[0].basis(a) @ level.fit.theta[level.places[0]],
        atol=1e-9)
    assert start["a"] == level.fit.theta[[f.label for f in level.problem.free].index("a")]


def test_a_fit_that_has_settled_goes_on_with_fine_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    level, asked, choose = coarse(), list[str](), Shooting.choose_steps

    def noted(shooting: Shooting, theta: np.ndarray, accuracy: Accuracy) -> bool:
        asked.append(accuracy)
        return choose(shooting, theta, accuracy)

    monkeypatch.setattr(Shooting, "choose_steps", noted)
    fit = penalised_fit(Shooting(level.problem), level.fit.theta, level.fit.smoothness,
                        level.fit.rho)
    assert fit.converged and asked == ["coarse", "fine"]
