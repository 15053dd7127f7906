"""Traps of simulation-based fitting, each with the naive code that falls in beside ours."""

from __future__ import annotations

import ast
import time
from pathlib import Path

import interpreted
import numpy as np
import oracle
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

import pikanid as pk
from pikanid import errors, simulation
from pikanid.model import Model, Parameter, systems
from pikanid.objective.shooting import Shooting
from pikanid.problem.problem import Problem, bind
from pikanid.recording import Recording, excitation
from pikanid.simulation import Simulator, Steps

SIGMA = 0.1 * np.pi / 180
MODEL = systems.sloshing()
PULSES = excitation.two_pulse()
NOISY = pk.simulate(MODEL, PULSES, sigma=SIGMA, seed=0)
START = MODEL.with_values(l_theta=0.06, d_theta=0.05)


def push(t: float) -> float:
    """The two pulses as everybody writes them first."""
    return 1.0 if 0.2 <= t < 0.6 else (-1.0 if 1.2 <= t < 1.6 else 0.0)


def naive(length: float, damping: float, method: str = "LSODA", rtol: float = 1e-6,
          longest: float = np.inf) -> np.ndarray:
    """One adaptive solver over the whole interval, from rest."""
    solution = solve_ivp(
        lambda t, x: [x[1], push(t) / length * np.cos(x[0]) - 9.81 / length * np.sin(x[0])
                      - damping / 0.3 * x[1] * np.cos(x[0]) ** 2],
        (0, 5), [0.0, 0.0], method, t_eval=PULSES.t, rtol=rtol, max_step=longest)
    return solution.y[0]


# --- an adaptive solver steps over pulses --------------------------------------------------------


def test_adaptive_solver_from_rest_never_notices_the_pulses() -> None:
    assert np.abs(naive(0.045, 0.15)).max() == 0.0
    ours = pk.simulate(MODEL, PULSES)["theta"].values
    assert np.degrees(np.abs(ours).max()) == pytest.approx(11.34, abs=0.005)


def test_fitting_through_it_converges_at_the_start() -> None:
    """A gradient of zero is a stationary point: success, says the optimiser."""
    found = least_squares(lambda p: naive(*p) - NOISY["theta"].values, [0.06, 0.05])
    assert found.success
    np.testing.assert_allclose(found.x, [0.06, 0.05])
    ours = pk.NLS().fit(START, NOISY)
    assert ours.ok
    assert ours.value("l_theta") == pytest.approx(0.045, rel=1e-3)


# --- finite differences through an adaptive solver -----------------------------------------------


def test_finite_differences_through_an_adaptive_solver_stop_anywhere() -> None:
    """The pulses are met now, the trajectory is right; its difference quotients are not.

    Steps of 1e-8 are lost in the solver's own error of 1e-6: the optimiser takes noise for
    derivatives, finds no descent, and reports success at its start.
    """
    def met(length: float, damping: float) -> np.ndarray:
        return naive(length, damping, longest=0.1)

    ours = pk.simulate(MODEL, PULSES)["theta"].values
    assert np.abs(met(0.045, 0.15) - ours).max() < 3e-3
    found = least_squares(lambda p: met(*p) - NOISY["theta"].values, [0.06, 0.05])
    assert found.success
    assert abs(found.x[0] - 0.045) > 0.01
    step = 1.5e-8 * 0.045  # what least_squares takes by itself
    quotient = (met(0.045 + step, 0.15) - met(0.045, 0.15)) / step
    exact = Simulator(MODEL, bind(MODEL, NOISY)).run(
        np.array(list(MODEL.values.values())), np.array([0]), Steps("explicit", 0.0025))
    slope = exact.sensitivity[:, 0]
    assert np.abs(quotient - slope).max() > np.abs(slope).max()
    signal = [oracle.Signal(PULSES.t, PULSES["u_x"].values)]

    def true(h: float) -> np.ndarray:
        length = 0.045 + h
        return oracle.simulate(
            lambda t, x, u, s: [x[1], u[0] / length * np.cos(x[0])
                                - 9.81 / length * np.sin(x[0]) - 0.5 * x[1] * np.cos(x[0]) ** 2],
            [0, 0], PULSES.t, signal).x[:, 0]

    expected = oracle.derivative(true, 0.0, 4.5e-5)
    assert np.abs(slope - expected).max() < 1e-5 * np.abs(expected).max()


# --- wrong optima --------------------------------------------------------------------------------


@pytest.mark.parametrize(("length", "damping"), [
    (0.07, 0.05), (0.08, 0.05), (0.1, 0.05), (0.4, 0.05), (0.02, 0.05), (0.02, 1.0), (0.07, 1.0),
    (0.01, 0.05)])
def test_wrong_optima_of_a_plain_optimiser_are_caught_by_chi_square(length: float, damping: float
                                                                    ) -> None:
    """Exact derivatives, but no scaling: l and d differ by an order in size, and it ends astray.

    Mostly near l = 0.043, d = 0.5 to 1.4, which has been taken for a breakdown of least squares.
    The verdict calls every one of them a misfit; from the same start ours finds the truth.
    """
    shooting = Shooting(Problem(MODEL, NOISY))
    shooting.choose_steps(np.array([0.045, 0.15]), "fine")
    plain = least_squares(shooting.residual, [length, damping], jac=shooting.jacobian)
    assert abs(plain.x[1] - 0.15) > 0.05
    assert shooting.adequacy(plain.x).verdict == "misfit"
    assert shooting.adequacy(plain.x).p_value < 1e-12
    ours = pk.NLS().fit(MODEL.with_values(l_theta=length, d_theta=damping), NOISY)
    assert ours.ok
    assert ours.value("l_theta") == pytest.approx(0.045, rel=1e-3)


@pytest.mark.slow
def test_a_true_local_minimum_is_never_reported_as_success() -> None:
    """Dry friction has several: from μ = 1 the best fit nearby is wrong, its gradient zero."""
    truth = MODEL.with_term("theta_dot", "-mu*sign(theta_dot)", [Parameter("mu", 2.0)])
    recording = pk.simulate(truth, PULSES, sigma=SIGMA, seed=0)
    single = pk.NLS(starts=1).fit(truth.with_values(mu=1.0), recording)
    assert single.converged
    assert abs(single.value("mu") - 2.0) > 0.5
    assert single.adequacy.verdict == "misfit"
    assert not single.ok
    several = pk.NLS().fit(truth.with_values(mu=1.0), recording)
    assert several.ok
    assert abs(several.value("mu") - 2.0) < 4 * several.std("mu")


# --- steps ---------------------------------------------------------------------------------------


def test_a_sign_rounded_off_by_a_tanh_is_another_model() -> None:
    """A tanh of 0.1 rad/s in place of a sign: more than two σ off; ours switches exactly."""
    friction = [Parameter("mu", 2.0)]
    exact = MODEL.with_term("theta_dot", "-mu*sign(theta_dot)", friction)
    ours = pk.simulate(exact, PULSES)["theta"].values
    signal = [oracle.Signal(PULSES.t, PULSES["u_x"].values)]

    def rhs(friction_of: object, t: float, x: np.ndarray, u: np.ndarray, s: np.ndarray
            ) -> list[float]:
        return [x[1], u[0] / 0.045 * np.cos(x[0]) - 9.81 / 0.045 * np.sin(x[0])
                - 0.5 * x[1] * np.cos(x[0]) ** 2 - 2.0 * friction_of(x, s)]  # type: ignore[operator]

    true = oracle.simulate(lambda t, x, u, s: rhs(lambda x, s: s[0], t, x, u, s), [0, 0], PULSES.t,
                           signal, [lambda t, x, u: x[1]]).x[:, 0]
    rounded = oracle.simulate(lambda t, x, u, s: rhs(lambda x, s: np.tanh(x[1] / 0.1), t, x, u, s),
                              [0, 0], PULSES.t, signal).x[:, 0]
    assert np.abs(rounded - true).max() > 2 * SIGMA
    assert np.abs(ours - true).max() < 0.05 * SIGMA


def test_how_an_input_is_held_is_physics(monkeypatch: pytest.MonkeyPatch) -> None:
    """The right model with the wrong hold fits an order of magnitude worse, and is blamed."""
    interpreted.instead_of_compiled(monkeypatch)
    t = excitation.grid(3.0, 0.05)
    drive = np.random.default_rng(0).normal(0, 20, len(t))
    duffing = systems.duffing_oscillator()
    line = Recording.from_arrays(t, {"u": drive}, {"u": "N"}, hold={"u": "first"})
    recording = pk.simulate(duffing, line, sigma=1e-3, seed=0)
    right = pk.NLS(starts=1).fit(duffing, recording)
    wrong = pk.NLS(starts=1).fit(duffing, recording.with_hold(u="zero"))
    assert right.ok
    assert not wrong.ok
    assert wrong.rmse > 10 * right.rmse


# --- cost ----------------------------------------------------------------------------------------


def test_sensitivities_cost_little_more_than_the_simulation_itself() -> None:
    """One compiled run with sensitivities against one segmented run of scipy's, in one process."""
    simulator = Simulator(MODEL, bind(MODEL, NOISY))
    p, active, steps = np.array(list(MODEL.values.values())), np.arange(2), Steps("explicit", 0.01)
    simulator.run(p, active, steps)
    begun = time.perf_counter()
    for _ in range(20):
        simulator.run(p, active, steps)
    ours = (time.perf_counter() - begun) / 20
    begun = time.perf_counter()
    naive(0.045, 0.15, "DOP853", 1e-8)
    theirs = time.perf_counter() - begun
    assert ours < theirs / 5  # in truth about 1/500: no machine is so busy


def test_models_are_data_never_code() -> None:
    """A formula that would delete files is a formula that cannot be read."""
    with pytest.raises(errors.BadModel):
        Model.from_dict({"states": {"x": {}}, "outputs": {"x": {"expression": "x"}},
                         "equations": {"x": "__import__('shutil').rmtree('none')"}})


def test_no_record_outlives_the_array_it_lies_in() -> None:
    """`np.zeros(1, record)[0]` leaves numba with a pointer into memory that is free again."""
    kernels = sorted((Path(simulation.__file__).parent / "kernels").glob("*.py"))
    assert len(kernels) > 5
    for kernel in kernels:
        taken = [node.lineno for node in ast.walk(ast.parse(kernel.read_text()))
                 if isinstance(node, ast.Subscript) and isinstance(node.value, ast.Call)]
        assert taken == [], kernel.name
