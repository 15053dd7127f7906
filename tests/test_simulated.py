"""The step that a simulated fit still makes from a relaxed estimate."""

from __future__ import annotations

import numpy as np
import pytest
from relaxing import guessed, slosh

import pikanid as pk
from pikanid.objective.shooting import Shooting
from pikanid.problem.problem import Problem
from pikanid.strategies import relaxation
from pikanid.strategies.simulated import step_left

RELATIVE = 1e-6


@pytest.fixture(scope="module")
def best() -> pk.Estimate:
    return pk.NLS().fit(guessed(), slosh(0.1))


def test_the_step_leads_back_to_the_optimum(best: pk.Estimate) -> None:
    shooting, std = Shooting(Problem(guessed(), slosh(0.1))), np.sqrt(np.diag(best.covariance))
    assert step_left(shooting, best.theta, std, RELATIVE) < 0.01
    for away in (np.array([1.0, 0.0]), np.array([0.5, -2.0])):
        left = step_left(shooting, best.theta + away * std, std, RELATIVE)
        assert left == pytest.approx(np.abs(away).max(), rel=0.1)


def test_a_parameter_at_its_bound_stays_there(best: pk.Estimate) -> None:
    model = guessed().with_bounds(l_theta=(best.theta[0] * (1.0 + 1e-4), 0.5))
    shooting, std = Shooting(Problem(model, slosh(0.1))), np.sqrt(np.diag(best.covariance))
    theta = np.array([shooting.problem.lower[0], best.theta[1]])
    left = step_left(shooting, theta, std, RELATIVE)
    jacobian, residual = shooting.jacobian(theta)[:, 1], shooting.residual(theta)
    assert left == pytest.approx(abs(jacobian @ residual / (jacobian @ jacobian)) / std[1],
                                  rel=1e-2)


def test_what_the_simulation_does_not_show_is_no_agreement() -> None:
    still = pk.Recording.from_arrays(np.arange(100) * 0.01, {"u_x": np.zeros(100)},
                                     units={"u_x": "m/s^2"}, hold={"u_x": "zero"})
    run = pk.simulate(guessed(), still, sigma=0.01, seed=0)
    shooting = Shooting(Problem(guessed(), run))
    assert step_left(shooting, shooting.problem.guess, np.ones(2), RELATIVE) == np.inf


def test_a_grid_is_halved_only_where_the_simulation_disagrees(
        monkeypatch: pytest.MonkeyPatch) -> None:
    agreeing = pk.IPDA().fit(guessed(), slosh(0.1))
    monkeypatch.setattr(relaxation, "step_left", lambda *_: 1.0)
    disagreeing = pk.IPDA().fit(guessed(), slosh(0.1))
    assert disagreeing.settings["intervals"] == 2 * agreeing.settings["intervals"]
    std = np.sqrt(np.diag(agreeing.covariance))
    assert np.all(np.abs(disagreeing.theta - agreeing.theta) < 0.01 * std)
