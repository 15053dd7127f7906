"""Levenberg-Marquardt with a dense Jacobian: what it stops at, bounds on either side."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from pikanid.optimise.dense import Solution, levenberg_marquardt

FREE = np.full(3, np.inf)


def linear(seed: int, sign: float = 1.0, lower: np.ndarray = -FREE, upper: np.ndarray = FREE,
           start: float = 0.0) -> tuple[Solution, np.ndarray, np.ndarray]:
    """A linear problem in sign·z: its solution, matrix and target."""
    rng = np.random.default_rng(seed)
    matrix = sign * (rng.normal(size=(8, 3)) + rng.normal(size=(8, 1)))
    target = rng.normal(size=8)
    low, high = sorted((sign * lower, sign * upper), key=lambda b: float(b.sum()))
    found = levenberg_marquardt(
        lambda z: matrix @ z - target, lambda z: (matrix @ z - target, matrix),
        np.full(3, sign * start), lower=low, upper=high, tolerance=1e-12)
    return found, matrix, target


@pytest.mark.parametrize("seed", range(6))
def test_a_linear_problem_within_bounds_on_either_side(seed: int) -> None:
    lower, upper = np.full(3, -0.05), np.full(3, 0.1)
    found, matrix, target = linear(seed, lower=lower, upper=upper)
    wanted = lsq_linear(matrix, target, (lower, upper), method="bvls", tol=1e-14).x
    np.testing.assert_allclose(found.z, wanted, atol=1e-7)
    assert np.any(np.abs(wanted - lower) * np.abs(upper - wanted) < 1e-12)  # a bound is met
    mirrored, _, _ = linear(seed, -1.0, lower, upper)
    np.testing.assert_array_equal(mirrored.z, -found.z)
    assert mirrored.iterations == found.iterations and found.converged


def test_three_calm_iterations_end_it() -> None:
    """Every fall is below a tolerance of one: of the cost, no more than all can go."""
    def curve(z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return (np.array([10.0 * (z[1] - z[0] ** 2), 1.0 - z[0]]),
                np.array([[-20.0 * z[0], 10.0], [-1.0, 0.0]]))

    loose = levenberg_marquardt(lambda z: curve(z)[0], curve, np.array([-1.2, 1.0]),
                                lower=-FREE[:2], upper=FREE[:2], tolerance=1.0)
    assert loose.converged and loose.iterations == 3
    short = levenberg_marquardt(lambda z: curve(z)[0], curve, np.array([-1.2, 1.0]),
                                lower=-FREE[:2], upper=FREE[:2], iterations=2)
    assert not short.converged and short.iterations == 2
    np.testing.assert_array_equal(short.residual, curve(short.z)[0])
    np.testing.assert_array_equal(short.jacobian, curve(short.z)[1])
    assert short.cost < 24.2  # where it began


def test_a_start_outside_the_bounds_is_put_inside() -> None:
    found, _, _ = linear(0, lower=np.full(3, -0.05), upper=np.full(3, 0.1), start=7.0)
    again, _, _ = linear(0, lower=np.full(3, -0.05), upper=np.full(3, 0.1), start=0.1)
    np.testing.assert_array_equal(found.z, again.z)
    assert found.iterations == again.iterations
