"""Lags and loops, against SciPy."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from pikanid.mismatch.catalogue.recurrences import bouc_wen, lag_of_held, lagged


def test_a_long_lag_is_that_of_its_equation() -> None:
    """Through straight lines."""
    t, tau = np.linspace(0.0, 2.0, 201), 0.05
    y = np.where(t < 0.5, 0.0, np.sin(7 * t))
    truth = [y[0]]
    for a, b in pairwise(t):
        truth.append(solve_ivp(lambda s, x: (np.interp(s, t, y) - x) / tau, (a, b), truth[-1:],
                               rtol=1e-10, atol=1e-12).y[0, -1])
    assert lagged(t, y, np.zeros(len(t)), tau) == pytest.approx(np.array(truth), abs=1e-7)


@pytest.mark.parametrize("tau", [1e-5, 1e-3, 9e-3])
def test_a_short_lag_of_what_bends_is_that_of_its_equation(tau: float) -> None:
    t = np.arange(200) * 0.01
    w = 10.0
    # what was at rest in the lagged signal's own sense: without a transient
    own = (np.sin(w * t) - w * tau * np.cos(w * t)) / (1 + (w * tau) ** 2)
    y, rate = np.sin(w * t), w * np.cos(w * t)
    off = np.abs(lagged(t, y, rate, tau) - own)[20:]
    assert off.max() < 0.01 * np.abs(own - y).max()
    straight = np.abs(lagged(t, y, np.gradient(y, t), tau) - own)[20:]
    assert straight.max() > off.max()


@pytest.mark.parametrize("tau", [1e-4, 0.003, 0.05])
def test_a_lag_takes_as_much_from_a_held_signal_and_as_early(tau: float) -> None:
    """Mean and first moment of each step, by quadrature of the lag's equation."""
    t = np.array([0.0, 0.01, 0.03, 0.04, 0.07])
    u = np.array([1.0, -2.0, 0.5, 3.0, 0.0])
    found, state = lag_of_held(t, u, tau), u[0]
    for k, (a, b) in enumerate(pairwise(t)):
        s = np.linspace(0.0, b - a, 200_001)
        off = (state - u[k]) * np.exp(-s / tau)
        line = np.interp(s, [0.0, (b - a) / 2, b - a], found[:, k])
        for weight in (np.ones_like(s), s / (b - a)):
            assert np.trapezoid(weight * line, s) == pytest.approx(
                np.trapezoid(weight * off, s), abs=1e-9)
        state = u[k] + off[-1]


def test_a_loop_of_hysteresis_is_that_of_its_equation() -> None:
    s = np.linspace(0.0, 2 * np.pi, 4001)
    q = 3 * np.sin(s)
    truth = solve_ivp(
        lambda s, z: 3 * np.cos(s) - 0.5 * (abs(3 * np.cos(s)) * z + 3 * np.cos(s) * abs(z)),
        (0.0, 2 * np.pi), [0.0], rtol=1e-9, atol=1e-11, t_eval=s, max_step=0.01)
    assert bouc_wen(q) == pytest.approx(truth.y[0], abs=2e-3)
    assert np.ptp(bouc_wen(q)) > 1.5
