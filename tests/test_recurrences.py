"""Linear systems, lags and loops, against the matrix exponential and SciPy."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from pikanid.mismatch.catalogue.recurrences import bouc_wen, follow, lagged


@pytest.mark.parametrize("parts", [1, 4])
def test_constant_matrix_gives_the_exponential(parts: int) -> None:
    a = np.array([[0.0, 1.0], [-4.0, -0.3]])
    h = np.full(200, 0.02)
    A = np.broadcast_to(a, (3, 200, 2, 2)).copy()
    start = np.array([[1.0, 0.0, 0.5], [0.0, 1.0, -2.0]])
    X = follow(A, np.zeros((3, 200, 2, 3)), h, start, parts)
    assert X[-1] == pytest.approx(expm(4.0 * a) @ start, abs=1e-6 / parts**4)


def test_forces_and_matrices_that_change_with_time() -> None:
    t = np.linspace(0.0, 3.0, 151)
    middle = 0.5 * (t[1:] + t[:-1])

    def matrix(t: np.ndarray) -> np.ndarray:
        a = np.zeros((len(t), 2, 2))
        a[:, 0, 1], a[:, 1, 0], a[:, 1, 1] = 1.0, -9.0 - 2 * np.sin(t), -0.2
        return a

    def force(t: np.ndarray) -> np.ndarray:
        f = np.zeros((len(t), 2, 1))
        f[:, 1, 0] = np.cos(5 * t)
        return f

    places = (t[:-1], middle, t[1:])
    X = follow(np.stack([matrix(p) for p in places]), np.stack([force(p) for p in places]),
               np.diff(t), np.array([[0.1], [0.0]]), 1)
    truth = solve_ivp(lambda s, x: matrix(np.array([s]))[0] @ x + force(np.array([s]))[0, :, 0],
                      (0.0, 3.0), [0.1, 0.0], method="DOP853", rtol=1e-11, atol=1e-12, t_eval=t)
    # what fourth order leaves at ten steps a radian
    assert X[:, :, 0] == pytest.approx(truth.y.T, abs=2e-6)


def test_a_system_that_forgets_at_once_stays_stable_in_parts() -> None:
    A = np.full((3, 50, 1, 1), -300.0)
    X = follow(A, np.full((3, 50, 1, 1), 300.0), np.full(50, 0.01), np.zeros((1, 1)), 2)
    assert X[-1, 0, 0] == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("held", [False, True])
def test_a_lag_is_that_of_its_equation(held: bool) -> None:
    t = np.linspace(0.0, 2.0, 201)
    y = np.where(t < 0.5, 0.0, np.sin(7 * t))
    tau = 0.05

    def push(s: float) -> float:
        return float(y[min(int(s / 0.01 + 1e-9), 200)] if held else np.interp(s, t, y))

    found = lagged(t, y, tau, held)
    x, states, means = y[0], [y[0]], []
    for a, b in pairwise(t):
        def rate(s: float, x: np.ndarray, last: float = b - 1e-12) -> list[float]:
            return [(push(min(s, last)) - x[0]) / tau, x[0]]

        step = solve_ivp(rate, (a, b), [x, 0.0], rtol=1e-10, atol=1e-12)
        x = step.y[0, -1]
        states.append(x)
        means.append(step.y[1, -1] / (b - a))
    assert found[:-1] == pytest.approx(means if held else states[:-1], abs=1e-7)


def test_a_loop_of_hysteresis_is_that_of_its_equation() -> None:
    s = np.linspace(0.0, 2 * np.pi, 4001)
    q = 3 * np.sin(s)
    truth = solve_ivp(
        lambda s, z: 3 * np.cos(s) - 0.5 * (abs(3 * np.cos(s)) * z + 3 * np.cos(s) * abs(z)),
        (0.0, 2 * np.pi), [0.0], rtol=1e-9, atol=1e-11, t_eval=s, max_step=0.01)
    assert bouc_wen(q) == pytest.approx(truth.y[0], abs=2e-3)
    assert np.ptp(bouc_wen(q)) > 1.5
