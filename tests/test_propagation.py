"""Small deviations that are carried along a motion, against another integrator."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from pikanid.mismatch.detect.propagation import (
    TOGETHER,
    add_forces,
    add_outputs,
    step_matrices,
    stiff_matrices,
)

Method = Callable[[np.ndarray, np.ndarray, int], tuple[np.ndarray, np.ndarray]]

T = np.linspace(0.0, 4.0, 401)


def matrix(t: float) -> np.ndarray:
    """Of a parabola in time, which is what lies between the three places of a step."""
    return np.array([[0.0, 1.0, 0.0], [-150.0 + 3.0 * t * t, -0.4, 2.0], [0.5 * t, 0.0, -3.0]])


def by_dop853(force: object, start: np.ndarray) -> np.ndarray:
    assert callable(force)
    done = solve_ivp(lambda t, x: matrix(t) @ x + force(t), (T[0], T[-1]), start, "DOP853", T,
                     rtol=1e-10, atol=1e-12)
    return np.asarray(done.y.T)


METHODS = [step_matrices, stiff_matrices]


def steps(parts: int = 1, method: Method = step_matrices) -> tuple[np.ndarray, np.ndarray]:
    h = np.diff(T)
    A = np.stack([np.array([matrix(t) for t in T[:-1] + share * h]) for share in (0.0, 0.5, 1.0)])
    return method(A, h, parts)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("parts", "error"), [(1, 2e-4), (4, 1e-6)])
def test_forces_in_every_equation_and_beginnings_are_carried_along(
        parts: int, error: float, method: Method) -> None:
    M, B = steps(parts, method)
    rng = np.random.default_rng(3)
    start = np.zeros((TOGETHER, 3))
    start[:4] = rng.standard_normal((4, 3))
    G, y = np.zeros((TOGETHER, 3, len(T) - 1)), np.zeros((TOGETHER, 2, len(T)))
    forces = np.stack([np.sin((2 + k) * T) for k in range(4)])
    # two forces act in the last one together
    owner, row = np.array([0, 1, 2, 2]), np.array([0, 1, 2, 1])
    add_forces(B, forces, owner, row, G)
    C = np.zeros((len(T), 2, 3))
    C[:, 0, 0], C[:, 1, 2], C[:, 1, 1] = 1.0, 2.0, T
    add_outputs(M, G, start, C, y)
    for k in range(4):
        def force(t: float, k: int = k) -> np.ndarray:
            return sum((np.eye(3)[row[j]] * np.sin((2 + j) * t) for j in range(4)
                        if owner[j] == k), np.zeros(3))
        x = by_dop853(force, start[k])
        wanted = np.stack([x[:, 0], 2 * x[:, 2] + T * x[:, 1]])
        np.testing.assert_allclose(y[k], wanted, atol=error * np.abs(wanted).max())
    assert not y[4:].any()


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("parts", [1, 4])
def test_constant_matrix_gives_the_exponential(parts: int, method: Method) -> None:
    a = np.array([[0.0, 1.0], [-4.0, -0.3]])
    M, _ = method(np.broadcast_to(a, (3, 200, 2, 2)).copy(), np.full(200, 0.02), parts)
    whole = np.linalg.multi_dot(M[::-1])
    assert whole == pytest.approx(expm(4.0 * a), abs=1e-6 / parts**4)


def test_a_system_that_forgets_at_once_stays_stable_in_parts() -> None:
    M, B = step_matrices(np.full((3, 50, 1, 1), -300.0), np.full(50, 0.01), 2)
    G, y = np.zeros((TOGETHER, 1, 50)), np.zeros((TOGETHER, 1, 51))
    add_forces(B, np.full((1, 51), 300.0), np.array([0]), np.array([0]), G)
    add_outputs(M, G, np.zeros((TOGETHER, 1)), np.ones((51, 1, 1)), y)
    assert y[0, 0, -1] == pytest.approx(1.0, abs=1e-6)


def test_a_stiff_state_follows_the_others() -> None:
    rate = 1e6  # x' = rate*(y - x), y' = -x: x is y, and both decay
    a = np.array([[-rate, rate], [-1.0, 0.0]])
    M, _ = stiff_matrices(np.broadcast_to(a, (3, 50, 2, 2)).copy(), np.full(50, 0.02), 1)
    end = np.linalg.multi_dot(M[::-1]) @ [0.0, 1.0]
    assert end == pytest.approx(expm(a) @ [0.0, 1.0], rel=1e-5)
    M, _ = step_matrices(np.broadcast_to(a, (3, 50, 2, 2)).copy(), np.full(50, 0.02), 64)
    assert not np.abs(M).max() < 1e6  # by the classical method it runs away


def test_what_is_seen_already_stays() -> None:
    M, _ = steps()
    y = np.ones((TOGETHER, 1, len(T)))
    add_outputs(M, np.zeros((TOGETHER, 3, len(T) - 1)), np.zeros((TOGETHER, 3)),
                np.ones((len(T), 1, 3)), y)
    np.testing.assert_array_equal(y, 1.0)


@pytest.mark.parametrize("power", range(4))
def test_middles_of_cubics_are_exact(power: int) -> None:
    """Inside; at both ends, where a neighbour is missing, half of both."""
    t = np.arange(8.0)
    B = np.zeros((3, 1, 1, 7))
    B[1] = 1.0
    G = np.zeros((1, 1, 7))
    add_forces(B, t[None] ** power, np.array([0]), np.array([0]), G)
    inside = (t[:-1] + 0.5) ** power
    np.testing.assert_allclose(G[0, 0, 1:-1], inside[1:-1], rtol=1e-12)
    ends = 0.5 * (t[[0, -2]] ** power + t[[1, -1]] ** power)
    np.testing.assert_allclose(G[0, 0, [0, -1]], ends)


def test_a_force_over_one_step_only() -> None:
    G = np.zeros((1, 1, 1))
    add_forces(np.ones((3, 1, 1, 1)), np.array([[1.0, 3.0]]), np.array([0]), np.array([0]), G)
    assert G[0, 0, 0] == pytest.approx(1.0 + 2.0 + 3.0)
