"""Where a search begins: what a first step promises, and what it does not see."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import pikanid as pk
from pikanid.mismatch.case import Case
from pikanid.mismatch.data.whitened import Whitened
from pikanid.mismatch.fitting.extended import extended
from pikanid.mismatch.search.screen import Screen, best_level, entry, law
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.mismatch.steps.opening import open_case


def opened(train: pk.Recording, later: pk.Recording) -> Case:
    return open_case(pk.systems.sloshing(), (train,), (later,), None, lambda text: None, DEFAULTS)


@pytest.fixture(scope="module")
def walled() -> Case:
    """A wall at less than half of the amplitude."""
    train, later = (pk.simulate(pk.systems.sloshing(), pk.excitation.two_pulse(), sigma=0.002,
                                seed=seed) for seed in (0, 1))
    case = opened(train, later)
    wall = next(c for c in case.candidates if c.key == "wall_impact")
    there = Whitened(extended(case.model, (wall,)), case.records)
    values = {"d_theta": 0.15, "l_theta": 0.045, "wall": 0.08, "k_wall": 4000.0}
    theta = np.array([values[f.name] for f in there.problem.free])
    there.choose_steps(theta)
    t = there.problem.experiments[0].samples[0].t
    noise = np.random.default_rng(2).normal(0.0, 0.002, len(t))
    return opened(train.with_channels(replace(
        train["theta"], time=t, values=there.responses(theta)[0].y + noise)), later)


def test_forces_of_one_parameter_are_tried_whatever_they_promise(walled: Case) -> None:
    screen = Screen(walled.base, [c for c in walled.candidates if c.fits])
    listed = [c for c, _ in screen.singles(1, np.inf, law)]
    every = {c.key for c in walled.candidates if law(c)}
    assert {c.key for c in listed} >= every >= {"quadratic_drag", "coulomb_friction"}
    assert not [c for c, _ in screen.singles(1, np.inf)]


def test_a_wall_that_no_first_step_leads_to_is_found(walled: Case) -> None:
    assert walled.base.far
    screen = Screen(walled.base, [c for c in walled.candidates if c.fits])
    number = next(k for k, c in enumerate(screen.found.candidates) if c.key == "wall_impact")
    wall = screen.found.candidates[number]
    assert not screen.best(number)  # to first order a wall would make it worse
    begun = best_level(walled.base, wall, walled.base.point).values
    assert begun["wall"] == pytest.approx(0.08, rel=0.15)
    starts = [s for c, s in screen.singles(1, np.inf, entry) if c is wall]
    assert starts == [[best_level(walled.base, wall, walled.base.point)]]
    walled.search.run(walled.adequate)
    best = walled.search.ranked()[0]
    assert best.key == {"wall_impact"}
    assert best.values["wall"] == pytest.approx(0.08, rel=0.01)


def test_a_parameter_that_moves_nothing_takes_nothing_up(walled: Case) -> None:
    """As a limit that no motion reaches: its column is not zero, but below what divides."""
    base, k = walled.base, 0
    J = base.minimum.J.copy()
    J[:, k] *= 1e-305 / np.linalg.norm(J[:, k])
    screen = Screen(replace(base, minimum=replace(base.minimum, J=J)), walled.candidates)
    assert not screen.taken[k].any() and np.isfinite(screen.taken).all()
