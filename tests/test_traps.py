"""Traps of simulation and identification, each beside the naive code that falls into it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import BSpline
from scipy.optimize import least_squares

import pikanid as pk
from pikanid.problem import Problem
from pikanid.shooting import Shooting

SIGMA = math.radians(0.1)
TRUE = np.array([0.045, 0.15])


def acceleration(t: float) -> float:
    """Table II's two pulses, as a naive user writes them."""
    return 1.0 if 0.2 <= t < 0.6 else (-1.0 if 1.2 <= t < 1.6 else 0.0)


def field(x: np.ndarray, t: float, l: float, d: float) -> list[float]:  # noqa: E741
    """Eq. (6)."""
    c = math.cos(x[0])
    return [x[1], acceleration(t) / l * c - 9.81 / l * math.sin(x[0]) - d / 0.3 * x[1] * c * c]


@pytest.fixture(scope="module")
def clean() -> pk.Recording:
    return pk.simulate(pk.systems.sloshing(), pk.excitation.two_pulse())


def noisy(clean: pk.Recording, sigma: float, seed: int) -> pk.Recording:
    theta = clean["theta"]
    values = theta.values + np.random.default_rng(seed).normal(0, sigma, len(theta))
    return clean.with_channels(pk.Channel("theta", theta.time, values, "rad", sigma))


def lsoda(t: np.ndarray, p: np.ndarray) -> np.ndarray:
    """θ by one call of an adaptive solver over the whole interval."""
    found = solve_ivp(lambda s, x: field(x, s, *p), (t[0], t[-1]), [0.0, 0.0], "LSODA", t,
                      rtol=1e-6)
    return found.y[0]


def test_an_adaptive_solver_steps_over_the_pulses_and_ours_does_not(clean: pk.Recording) -> None:
    naive = lsoda(clean.t, TRUE)
    assert np.degrees(np.abs(naive).max()) < 1e-6  # it saw no input at all
    assert np.degrees(np.abs(clean["theta"].values).max()) == pytest.approx(11.34, abs=0.005)


def test_the_naive_optimiser_is_content_at_its_start_and_ours_moves(clean: pk.Recording) -> None:
    data = noisy(clean, SIGMA, 0)

    def residual(p: np.ndarray) -> np.ndarray:
        return lsoda(data.t, p) - data["theta"].values

    naive = least_squares(residual, [0.06, 0.05])
    assert naive.success
    assert naive.x == pytest.approx([0.06, 0.05])
    ours = pk.NLS().fit(pk.systems.sloshing().with_values(l_theta=0.06, d_theta=0.05), data)
    assert ours.theta == pytest.approx([0.04501202, 0.14891704], rel=1e-6)
    assert ours.cost == pytest.approx(7.814036e-4, rel=1e-6)


def test_finite_differences_through_an_adaptive_solver_are_wrong(clean: pk.Recording) -> None:
    def run(length: float, d: float) -> np.ndarray:
        found = solve_ivp(lambda t, x: field(x, t, length, d), (0, 5), [0.0, 0.0], "RK45", clean.t,
                          max_step=0.05)
        return found.y[0]

    step = 1.5e-8 * TRUE[0]
    naive = (run(TRUE[0] + step, TRUE[1]) - run(*TRUE)) / step
    problem = Problem(pk.systems.sloshing(), clean)
    shooting = Shooting(problem)
    shooting.choose_steps(TRUE, "fine")
    ours = shooting.jacobian(TRUE)[:, 0]
    wide = 1e-4 * TRUE[0]
    model = pk.systems.sloshing()
    high, low = (pk.simulate(model, pk.excitation.two_pulse(), parameters={"l_theta": length})
                 for length in (TRUE[0] + wide, TRUE[0] - wide))
    reference = (high["theta"].values - low["theta"].values) / (2 * wide)
    size = np.abs(reference).max()
    assert np.abs(ours - reference).max() < 1e-4 * size
    assert np.abs(naive - reference).max() > 1e-2 * size


def test_a_false_minimum_converges_and_is_called_a_misfit(clean: pk.Recording) -> None:
    data = noisy(clean, SIGMA, 0).decimate(10, channels=["theta"])
    far = pk.systems.sloshing().with_values(l_theta=0.007, d_theta=0.05)
    stuck = pk.NLS(starts=1).fit(far, data)
    assert stuck.converged
    assert stuck.adequacy.verdict == "misfit"
    assert not stuck.ok
    freed = pk.NLS().fit(far, data)
    assert freed.ok
    assert freed.value("l_theta") == pytest.approx(0.045, abs=2e-4)


def test_how_an_input_is_held_matters() -> None:
    t = np.arange(0, 4, 0.02)
    ramp = pk.Recording.from_arrays(t, {"u": np.sin(9 * t)}, hold={"u": "first"})
    model = pk.systems.linear_oscillator()
    first = pk.simulate(model, ramp)["x"].values
    zero = pk.simulate(model, ramp.with_hold(u="zero"))["x"].values
    delayed = pk.simulate(model.map_input("u", delay=0.01), ramp)["x"].values
    assert np.abs(zero - first).max() > 0.05 * np.abs(first).max()
    # a staircase is the ramp about half a sample late
    assert np.abs(zero - delayed).max() < 0.2 * np.abs(zero - first).max()


def test_uniform_cubic_knots_bias_the_length_and_knots_at_the_switches_do_not(
        clean: pk.Recording) -> None:
    start = pk.systems.sloshing().with_values(l_theta=0.06, d_theta=0.05)
    bias = {g: pk.IPDA(protocol="paper", intervals=g).fit(start, clean).value("l_theta") / 0.045 - 1
            for g in (40, 80, 160)}
    assert bias[40] > bias[80] > bias[160] > 0.005
    assert abs(pk.IPDA().fit(start, clean).value("l_theta") / 0.045 - 1) < 1e-6


def test_a_large_lambda_locks_a_coarse_smooth_spline_and_we_say_so(clean: pk.Recording) -> None:
    start = pk.systems.sloshing().with_values(l_theta=0.06, d_theta=0.05)
    locked = pk.IPDA(knots="uniform", degree=3, intervals=40, lam=1e6).fit(start, clean)
    assert locked.value("l_theta") > 0.1  # 1/l -> 0 is cheaper than resolving the switches
    assert not locked.ok
    kept = pk.IPDA(knots="uniform", degree=3, intervals=40).fit(start, clean)
    assert kept.value("l_theta") == pytest.approx(0.045, rel=0.15)


def test_a_smooth_spline_cannot_follow_a_jump_of_the_acceleration(clean: pk.Recording) -> None:
    """C² knots leave an error in θ'' of the size of the jump; repeated knots remove it."""
    t = np.linspace(0.3, 0.9, 601)
    fine = pk.simulate(pk.systems.sloshing(), pk.excitation.two_pulse(), t=t)["theta"].values
    even = np.linspace(0.3, 0.9, 13)[1:-1]
    jump = 1.0 / 0.045  # the acceleration steps by u/l at 0.6 s
    errors = []
    for inner in (even, np.sort(np.concatenate([even[np.abs(even - 0.6) > 1e-9], [0.6] * 4]))):
        knots = np.concatenate([[0.3] * 6, inner, [0.9] * 6])
        spline = BSpline(knots, np.linalg.lstsq(
            BSpline.design_matrix(t, knots, 5).toarray(), fine, rcond=None)[0], 5)
        errors.append(abs(spline(0.6 - 1e-6, nu=2) - spline(0.6 + 1e-6, nu=2) - jump) / jump)
    assert errors[0] > 0.9
    assert errors[1] < 0.05
