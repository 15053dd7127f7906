"""Settings of strategies decide where they act, and results say them."""

from __future__ import annotations

import numpy as np
import pytest

import pikanid as pk
from pikanid import errors
from pikanid.problem.chains import find_chains
from pikanid.problem.problem import Problem
from pikanid.simulation.vectorfield import VectorField
from pikanid.strategies.kan_grids import KanGrid
from pikanid.strategies.kan_shallow import shallow_fit
from pikanid.strategies.pinn_check import against_simulation
from pikanid.strategies.relaxation import Setup
from pikanid.strategies.settings import ClimbSettings, RelaxationSettings, recorded

MODEL = pk.systems.sloshing()
RUN = pk.simulate(MODEL, pk.excitation.two_pulse(), sigma=0.1 * np.pi / 180, seed=0)


def test_what_counts_as_settled_decides_how_far_a_grid_is_refined() -> None:
    usual = pk.IPDA().fit(MODEL, RUN)
    strict = pk.IPDA(settings=RelaxationSettings(settled=0.0, refinements=2)).fit(MODEL, RUN)
    assert strict.settings["intervals"] == 4 * usual.settings["intervals"]
    assert "last halving" in strict.warnings[0] and not usual.warnings
    assert strict.settings["settings"] == {"settled": 0.0, "refinements": 2}
    assert "settings" not in usual.settings


@pytest.mark.slow
def test_what_counts_as_settled_decides_how_far_a_kan_is_refined() -> None:
    def cells(settled: float) -> int:
        problem = Problem(MODEL, RUN)
        setup = Setup(problem, VectorField(MODEL), find_chains(MODEL, "second_order"),
                      given_start=True, weighted=True, nondimensional=True,
                      settings=RelaxationSettings(settled=settled))
        return shallow_fit(setup, KanGrid(10, 5, False), cells=10.0, max_grid=40, lam=1.0,
                           tell=lambda *_: None).grid.n_intervals

    assert cells(1e6) == 20 and cells(0.0) == 40


def test_how_far_a_curve_may_mislead() -> None:
    problem = Problem(MODEL, RUN)
    theta = 1.3 * np.array(problem.guess)
    assert against_simulation(problem, theta, 0.0).notes
    assert not against_simulation(problem, theta, 0.0, far=1e6).notes


def test_as_many_starts_are_added_as_asked_for() -> None:
    """A model that explains nothing is tried from all of them."""
    dull = pk.simulate(MODEL.with_term("theta_dot", "-500*theta**3", []), pk.excitation.two_pulse(),
                       sigma=0.01 * np.pi / 180, seed=0)
    assert pk.NLS(extra=2).fit(MODEL, dull).settings["tried"] == 3


def test_a_result_records_what_is_not_usual() -> None:
    assert "settings" not in recorded(pk.PINN())
    found = recorded(pk.PINN(settings=ClimbSettings(share=0.2)))
    assert found["settings"] == {"share": 0.2} and "progress" not in found


@pytest.mark.parametrize("strategy", [pk.IPDA, pk.PIKAN, pk.PINN])
def test_settings_of_another_kind_are_refused(strategy: type) -> None:
    with pytest.raises(errors.BadSetting, match="'settings'"):
        strategy(settings={"settled": 1.0}).fit(MODEL, RUN)
