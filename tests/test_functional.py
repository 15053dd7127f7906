"""Eq. (2): residuals by hand, Jacobians by differences, any approximator."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from relaxing import DEGREE, collocated, guessed, random_point, slosh

import pikanid as pk
from pikanid import errors
from pikanid.approximators import Approximator
from pikanid.chains import find_chains
from pikanid.functional import Functional, bind
from pikanid.optimise.gauss_newton import Point
from pikanid.problem import Problem
from pikanid.simulation.vectorfield import VectorField

LAM = 0.37


@dataclass(frozen=True)
class Sines:
    """x̂(t) = a sin(b t): a nonlinear approximator with two coefficients."""

    n_coefficients: int = 2

    def values(self, t: np.ndarray, c: np.ndarray, derivative: int = 0) -> np.ndarray:
        return c[0] * c[1] ** derivative * np.sin(c[1] * t + derivative * np.pi / 2)

    def jacobian(self, t: np.ndarray, c: np.ndarray, derivative: int = 0) -> np.ndarray:
        phase = c[1] * t + derivative * np.pi / 2
        power = c[1] ** derivative
        by_rate = derivative * c[1] ** max(derivative - 1, 0) * np.sin(phase)
        return np.column_stack([power * np.sin(phase),
                                c[0] * (by_rate + power * t * np.cos(phase))])


def differences(functional: Functional, point: Point) -> np.ndarray:
    """Jacobian by central differences, held coefficients following θ not included."""
    columns = []
    for r, c in enumerate(point.coefficients):
        for k in range(c.size):
            ends = []
            for sign in (1.0, -1.0):
                moved = [np.array(a) for a in point.coefficients]
                moved[r][k] += sign * 1e-6
                ends.append(functional.residual(moved, point.theta, LAM))
            columns.append((ends[0] - ends[1]) / 2e-6)
    for k in range(point.theta.size):
        step = 1e-6 * np.eye(point.theta.size)[k]
        columns.append((functional.residual(point.coefficients, point.theta + step, LAM)
                        - functional.residual(point.coefficients, point.theta - step, LAM)) / 2e-6)
    return np.column_stack(columns)


def tied_model() -> pk.Model:
    """Estimated initial state, a parameter per recording, an output that depends on one."""
    model = guessed().with_initial(theta="free").per_recording("d_theta")
    return model.map_output("theta", parameters=[pk.Parameter("gain", 1.1)], gain="gain")


@pytest.mark.parametrize("form", ["second_order", "state"])
@pytest.mark.parametrize("recordings", [1, 2])
def test_jacobian_agrees_with_differences(form: str, recordings: int) -> None:
    data = [slosh(0.1, seed, stride=5) for seed in range(recordings)]
    functional = collocated(tied_model(), data, form, intervals=12)
    point = random_point(functional)
    exact = functional.jacobian(point.coefficients, point.theta, LAM).toarray()
    numeric = differences(functional, point)
    assert np.abs(exact - numeric).max() < 1e-8 * np.abs(exact).max()


def test_residual_by_hand() -> None:
    functional = collocated(guessed(), slosh(0.1, stride=10))
    point = random_point(functional)
    part = functional.parts[0]
    spline, c = part.approximators[0], point.coefficients[0]
    data, nodes = part.data[0], part.physics
    theta, rate, top = (spline.basis(nodes.t, q) @ c for q in range(3))
    length, damping = point.theta
    u = np.where((nodes.t >= 0.2) & (nodes.t < 0.6), 1.0, 0.0) - np.where(
        (nodes.t >= 1.2) & (nodes.t < 1.6), 1.0, 0.0)
    rhs = (u * np.cos(theta) - 9.81 * np.sin(theta)) / length - (
        damping / 0.3 * rate * np.cos(theta) ** 2)
    wanted = np.concatenate([
        (spline.basis(data.t) @ c - slosh(0.1, stride=10)["theta"].values) / (0.1 * DEGREE),
        np.sqrt(LAM) * nodes.weight[:, 0] * (top - rhs)])
    found = functional.residual([c], point.theta, LAM)
    assert np.allclose(found, wanted, rtol=1e-9, atol=1e-9)
    assert spline.basis(np.zeros(1)) @ c == pytest.approx(0.0)


def test_any_approximator_fits_the_same_functional() -> None:
    assert isinstance(Sines(), Approximator)
    problem = Problem(guessed(), slosh(0.1, stride=5))
    chains = find_chains(problem.model)
    t = np.linspace(0.005, 4.995, 100)
    functional = bind(problem, VectorField(problem.model), chains, [(Sines(),)],
                      [(t, np.full(t.size, 0.05))])
    point = Point((np.array([0.1, 14.0]),), problem.guess)
    exact = functional.jacobian(point.coefficients, point.theta, LAM).toarray()
    numeric = differences(functional, point)
    scale = np.abs(exact).max(axis=0)
    assert np.all(np.abs(exact - numeric).max(axis=0) < 1e-6 * scale)
    # No leading coefficient can be eliminated: the initial state is tied by heavy rows.
    assert functional.parts[0].start is not None
    assert functional.residual(point.coefficients, point.theta, LAM)[-1] == pytest.approx(1.4e6)


def test_physics_nodes_do_not_straddle_switches() -> None:
    functional = collocated(guessed(), slosh())
    nodes = functional.parts[0].physics.t
    switches = functional.problem.experiments[0].breakpoints()
    assert np.allclose(switches, [0.2, 0.6, 1.2, 1.6])
    edges = functional.parts[0].approximators[0].breakpoints
    assert np.all(np.isin(switches, edges))
    assert np.all(np.histogram(nodes, edges)[0] == 4)


def test_roughness_replaces_physics() -> None:
    functional = collocated(guessed(), slosh(0.1, stride=10)).smoothing()
    point = random_point(functional)
    rows = functional.physics_rows(0, point.coefficients[0], point.theta, 4.0)
    top = functional.parts[0].physics.tops[0].values(point.coefficients[0])
    assert np.allclose(rows.residual[:, 0],
                       2.0 * functional.parts[0].physics.weight[:, 0] * top)
    assert rows.by_state is None and rows.by_theta is None


def test_chains_of_models() -> None:
    assert find_chains(guessed()).lengths == (2,)
    assert find_chains(guessed(), "state").lengths == (1, 1)
    assert find_chains(pk.systems.sloshing_2d()).lengths == (2, 2)
    circle = pk.Model.from_dict({
        "name": "circle", "states": {"x": {"initial": 1.0}, "y": {}}, "parameters": {},
        "equations": {"x": "y", "y": "x"}, "outputs": {"x": {"expression": "x"}}})
    assert sorted(find_chains(circle).lengths) == [2]


@pytest.mark.parametrize("side", ["input", "output"])
def test_free_delay_is_refused_and_names_nls(side: str) -> None:
    lag = [pk.Parameter("tau", 0.02, bounds=(0.0, 0.5))]
    model = (guessed().map_input("u_x", parameters=lag, delay="tau") if side == "input"
             else guessed().map_output("theta", parameters=lag, delay="tau"))
    with pytest.raises(errors.BadSetting, match=r"tau.*NLS"):
        collocated(model, slosh(0.1))


def test_fixed_output_delay_shifts_the_sites() -> None:
    late = [pk.Parameter("tau", 0.033, free=False)]
    model = guessed().map_output("theta", parameters=late, delay="tau")
    sites = collocated(model, slosh(0.1)).parts[0].data[0]
    assert sites.t[0] == 0.0 and sites.t[10] == pytest.approx(0.1 - 0.033)
