"""Eq. (2): residuals by hand, Jacobians by differences, any approximator."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from relaxing import DEGREE, collocated, guessed, random_point, slosh

import pikanid as pk
from pikanid import errors
from pikanid.approximators import Approximator
from pikanid.objective.functional import Functional, Part, bind
from pikanid.optimise.gauss_newton import Point
from pikanid.problem.chains import find_chains
from pikanid.problem.problem import Problem
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


@pytest.mark.parametrize("model", [guessed(), guessed().with_initial(theta="free")],
                         ids=["fixed start", "free start"])
def test_any_approximator_fits_the_same_functional(model: pk.Model) -> None:
    assert isinstance(Sines(), Approximator)
    problem = Problem(model, slosh(0.1, stride=5))
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


def coupled() -> pk.Model:
    """A driven oscillator that heats a body: three states, two outputs, one of them late, a start
    that is a formula of parameters and inputs, one parameter a recording.
    """
    model = pk.Model.from_dict({
        "states": {"heat": {"initial": 0.3}, "x": {"initial": "a + 0.5*u"},
                   "v": {"initial": "k/9"}},
        "inputs": {"u": {"hold": "first", "delay": "0.03"}},
        "parameters": {"a": {"guess": 0.2}, "k": {"guess": 5.0}, "c": {"guess": 0.7}},
        "equations": {"heat": "c*v**2 - heat", "x": "v", "v": "-k*sin(x) - 0.4*v + u"},
        "outputs": {"y": {"expression": "k*x*v + u", "delay": "0.05"},
                    "z": {"expression": "heat**2 + c*u"}}})
    return model.per_recording("c")


def seen(seed: int, known: bool) -> pk.Recording:
    t, own = np.linspace(0.0, 2.0, 41), np.linspace(0.1, 1.9, 23)
    rng = np.random.default_rng(seed)
    sigma = np.linspace(0.1, 0.3, 41)
    return pk.Recording({
        "u": pk.Channel("u", t, np.sin(3 * t) + seed),
        "y": pk.Channel("y", t, np.cos(2 * t) + 0.1 * rng.normal(size=41), "",
                        sigma if known else None),
        "z": pk.Channel("z", own, 40 * np.exp(-own) + 0.3 * rng.normal(size=23))})


def visible(y: np.ndarray) -> float:
    return float(np.median(np.abs(np.diff(y, 4)))) / 0.6744897501960817 / np.sqrt(70.0)


@pytest.mark.parametrize("form", ["second_order", "state"])
def test_every_family_by_hand(form: str) -> None:
    data = [seen(0, True), seen(1, False)]
    functional = collocated(coupled(), data, form, intervals=12)
    chains = functional.chains
    theta = np.array([0.25, 6.0, 0.5, 0.9])  # a, k, c of each recording
    rng = np.random.default_rng(3)
    scale = 1.0 + np.arange(len(chains.top))
    functional = functional.with_scale(scale)
    count = 0
    for r, part in enumerate(functional.parts):
        c = functional.complete(r, rng.normal(size=part.n_coefficients), theta)
        recording, (a, k, own) = data[r], (theta[0], theta[1], theta[2 + r])
        pieces = np.split(c, np.cumsum([s.n_coefficients for s in part.approximators])[:-1])

        def state(i: int, t: np.ndarray, more: int = 0, pieces: list[np.ndarray] = pieces,
                  part: Part = part) -> np.ndarray:
            chain = chains.root[i]
            basis = part.approximators[chain].basis(t, chains.order[i] + more)
            return np.asarray(basis @ pieces[chain])

        def u(t: np.ndarray, recording: pk.Recording = recording) -> np.ndarray:
            return np.interp(t - 0.03, recording["u"].time, recording["u"].values)

        start = np.array([state(i, np.zeros(1))[0] for i in range(3)])
        assert start == pytest.approx([0.3, a + 0.5 * u(np.zeros(1))[0], k / 9])
        at = [np.maximum(recording["y"].time - 0.05, 0.0), recording["z"].time]
        models = [k * state(1, at[0]) * state(2, at[0]) + u(at[0]),
                  state(0, at[1]) ** 2 + own * u(at[1])]
        spreads = [np.linspace(0.1, 0.3, 41) if r == 0 else visible(recording["y"].values),
                   visible(recording["z"].values)]
        wanted = [(model - recording[name].values) / spread for model, name, spread in zip(
            models, "yz", spreads, strict=True)]
        count += sum(map(len, models))
        t = part.physics.t
        rhs = {0: own * state(2, t) ** 2 - state(0, t), 1: state(2, t),
               2: -k * np.sin(state(1, t)) - 0.4 * state(2, t) + u(t)}
        physics = np.stack([np.sqrt(LAM) * part.physics.weight[:, e] / scale[e]
                            * (state(top, t, 1) - rhs[top]) for e, top in enumerate(chains.top)])
        rows = functional.rows(r, c, theta, LAM)
        np.testing.assert_allclose(rows[0].residual[:, 0], wanted[0], atol=1e-9)
        np.testing.assert_allclose(rows[1].residual[:, 0], wanted[1], atol=1e-9)
        np.testing.assert_allclose(rows[2].residual.T, physics, atol=1e-9)
        again = functional.rows(r, c, theta, 4 * LAM)
        np.testing.assert_allclose(again[2].residual.T, 2 * physics, atol=1e-9)
        np.testing.assert_allclose(functional.physics_rows(r, c, theta, LAM).residual.T, physics,
                                   atol=1e-9)
        for found, row in zip(functional.data_rows(r, c, theta), rows, strict=False):
            np.testing.assert_array_equal(found.residual, row.residual)
        # weights of Gauss' rule: the integral of 1
        assert np.sum(part.physics.weight[:, 0] ** 2) == pytest.approx(2.0)
        deviations = [sites.deviation for sites in part.data]
        assert deviations[1] is None and (deviations[0] is None) == (r == 1)
        if deviations[0] is not None:
            np.testing.assert_allclose(deviations[0], 1.0)  # of rows that σ divides
    assert functional.n_data == count == 2 * (41 + 23)
    square = sum(float(np.sum((recording[name].values / spread) ** 2))
                 for recording, spread in zip(data, (np.linspace(0.1, 0.3, 41),
                                                     visible(data[1]["y"].values)), strict=True)
                 for name, spread in (("y", spread), ("z", visible(recording["z"].values))))
    assert functional.data_square == pytest.approx(square)


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("form", ["second_order", "state"])
def test_held_coefficients_follow_the_start(form: str, turned: bool) -> None:
    model = coupled()
    if turned:
        model = model.replace(states=model.states[::-1])
    functional = collocated(model, [seen(0, True), seen(1, False)], form, intervals=12)
    assert functional.start_moves
    theta = np.array([0.25, 6.0, 0.5, 0.9])
    for r, part in enumerate(functional.parts):
        free = functional.problem.columns(r)[1]
        slopes = functional.hold_jacobian(r, theta)
        assert slopes is not None
        for column, k in enumerate(free):
            ends = [functional.complete(r, np.zeros(part.n_coefficients), theta + h)[part.held]
                    for h in (1e-5 * np.eye(4)[k], -1e-5 * np.eye(4)[k])]
            np.testing.assert_allclose(slopes[:, column], (ends[0] - ends[1]) / 2e-5, atol=1e-8)
        start = functional.problem.experiments[r].initial(functional.problem.parameters(theta, r))
        c = functional.complete(r, np.ones(part.n_coefficients), theta)
        pieces = np.split(c, np.cumsum([s.n_coefficients for s in part.approximators])[:-1])
        for i, (chain, q) in enumerate(zip(functional.chains.root, functional.chains.order,
                                           strict=True)):
            found = part.approximators[chain].basis(np.zeros(1), q) @ pieces[chain]
            assert found == pytest.approx([start[i]])
        c = functional.resting(r, theta)
        values = functional.states(part.physics, c)
        roots = [i for i, q in enumerate(functional.chains.order) if q == 0]
        inner = part.physics.t > 0.8  # behind the first splines, which hold rates too
        for i in roots:
            np.testing.assert_allclose(values[inner, i], start[i], atol=1e-12)
    fixed = coupled().with_initial(x=0.1, v=0.0)
    functional = collocated(fixed, seen(0, True), form, intervals=12)
    assert not functional.start_moves and functional.hold_jacobian(0, theta[:3]) is None


def test_rougher_penalty_is_the_higher_derivative() -> None:
    functional = collocated(guessed(), slosh(0.1, stride=10)).smoothing(1)
    point = random_point(functional)
    part, c = functional.parts[0], point.coefficients[0]
    rows = functional.physics_rows(0, c, point.theta, 4.0)
    third = part.approximators[0].basis(part.physics.t, 3) @ c
    np.testing.assert_allclose(rows.residual[:, 0], 2 * part.physics.weight[:, 0] * third)


def test_unweighted_data_are_as_they_are() -> None:
    problem = Problem(guessed(), slosh(0.1, stride=10))
    made = collocated(guessed(), slosh(0.1, stride=10))
    nodes = [(made.parts[0].physics.t, made.parts[0].physics.weight[:, 0] ** 2)]
    plain = bind(problem, made.vector_field, made.chains, [made.parts[0].approximators], nodes,
                 weighted=False)
    c = random_point(made).coefficients
    known = made.rows(0, c[0], problem.guess, LAM)[0].residual
    found = plain.rows(0, c[0], problem.guess, LAM)[0].residual
    np.testing.assert_allclose(found, known * 0.1 * DEGREE)
    np.testing.assert_allclose(plain.parts[0].data[0].deviation, 0.1 * DEGREE)
    loose = bind(problem, made.vector_field, made.chains, [made.parts[0].approximators], nodes,
                 given_start=False, like=made)
    assert loose.parts[0].held.size == 0 and loose.parts[0].start is None
    np.testing.assert_array_equal(loose.rows(0, c[0], problem.guess, LAM)[0].residual, known)
