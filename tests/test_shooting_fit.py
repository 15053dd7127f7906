"""Compiled local fits: the same steps as evaluation by evaluation, and where they are left out."""

from __future__ import annotations

import interpreted
import numpy as np
import pytest

import pikanid as pk
from pikanid.model import Model, Parameter
from pikanid.objective.shooting import Shooting
from pikanid.optimise import lmder_shooting, minpack, shooting_fit
from pikanid.problem.problem import Problem
from pikanid.simulation import native_call
from pikanid.simulation.simulator import Steps

MODEL = pk.systems.sloshing()
START = np.array([0.06, 0.05])


def bound(model: Model = MODEL, recordings: int = 1) -> Shooting:
    made = [pk.simulate(MODEL, pk.excitation.two_pulse(), sigma=2e-3, seed=seed)
            for seed in range(recordings)]
    found = Shooting(Problem(model, made))
    found.steps = [Steps("explicit", 0.01)] * recordings
    return found


def counted(shooting: Shooting, monkeypatch: pytest.MonkeyPatch) -> list[np.ndarray]:
    """The points at which Python simulates."""
    points, simulate = [], shooting._simulate

    def simulated(theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        points.append(theta)
        return simulate(theta)

    monkeypatch.setattr(shooting, "_simulate", simulated)
    return points


def by_python(shooting: Shooting, start: np.ndarray, tolerance: float, limit: int = 100
              ) -> minpack.Optimum:
    problem = shooting.problem
    return minpack.minimise(shooting.residual, shooting.jacobian, start, problem.lower,
                            problem.upper, tolerance, limit)


def assert_same(one: minpack.Optimum, other: minpack.Optimum) -> None:
    assert one.theta.tolist() == other.theta.tolist()
    assert (one.cost, one.converged, one.evaluations) == (
        other.cost, other.converged, other.evaluations)


@pytest.mark.parametrize(("start", "tolerance", "limit"), [
    (START, 1e-9, 100), (START, 1e-4, 100), (START * [20.0, 0.01], 1e-9, 100)])
def test_steps_are_those_of_python_to_the_last_digit(
        start: np.ndarray, tolerance: float, limit: int, monkeypatch: pytest.MonkeyPatch) -> None:
    ours = bound()
    points = counted(ours, monkeypatch)
    found = shooting_fit.fit_shooting(ours, start, tolerance, limit)
    assert_same(found, by_python(bound(), start, tolerance, limit))
    assert not points and found.evaluations > 3
    # what it has evaluated at the optimum is what Python evaluates there
    kept, fresh = ours.responses(found.theta)[0], bound().responses(found.theta)[0]
    for a, b in zip(kept, fresh, strict=True):
        np.testing.assert_array_equal(a, b)
    np.testing.assert_array_equal(ours.residual(found.theta), bound().residual(found.theta))
    np.testing.assert_array_equal(ours.jacobian(found.theta), bound().jacobian(found.theta))
    assert not points


@pytest.mark.parametrize(("start", "limit"), [
    (START * [0.05, 40.0], 100), (START, 4), ([1e-3, 1e-3], 100)])
def test_bounds_limits_and_trajectories_without_end_are_met_alike(
        start: np.ndarray, limit: int) -> None:
    """Towards the shortest pendulums steps of 0.01 s explode."""
    found = shooting_fit.fit_shooting(bound(), np.asarray(start), limit=limit)
    assert_same(found, by_python(bound(), np.asarray(start), 1e-9, limit))


LATE = MODEL.map_input("u_x", [Parameter("late", 0.01)], delay="late")
TILTED = MODEL.with_parameters(Parameter("tilt", 0.01)).with_initial(theta="tilt")


@pytest.mark.parametrize(("model", "recordings"), [(MODEL, 2), (LATE, 1), (TILTED, 1)])
def test_what_moves_more_than_the_states_goes_by_python(
        model: Model, recordings: int, monkeypatch: pytest.MonkeyPatch) -> None:
    ours = bound(model, recordings)
    points = counted(ours, monkeypatch)
    start = ours.problem.guess
    found = shooting_fit.fit_shooting(ours, start, limit=5)
    assert_same(found, by_python(bound(model, recordings), start, 1e-9, 5))
    assert len(points) > 2


@pytest.mark.parametrize("name", ["SHORT", "interpreted", "raising"])
def test_long_recordings_other_integrators_and_errors_too(
        name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    if name == "SHORT":
        monkeypatch.setattr(shooting_fit, "SHORT", 400)
    elif name == "interpreted":
        monkeypatch.setattr(native_call, "integrate_address", lambda integrate: 0)
    else:
        monkeypatch.setattr(lmder_shooting, "descend", lambda *arguments: (-1, -1))
    ours = bound()
    points = counted(ours, monkeypatch)
    found = shooting_fit.fit_shooting(ours, START)
    assert_same(found, by_python(bound(), START, 1e-9))
    assert len(points) > 10


def test_only_compiled_functions_have_an_address() -> None:
    simulator = bound().simulators[0]
    assert native_call.integrate_address(simulator.module("explicit").integrate) != 0
    assert native_call.integrate_address(interpreted.module(MODEL).integrate) == 0
