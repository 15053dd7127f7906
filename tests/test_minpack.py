"""Bounded least squares to the last digit, also where residuals are small."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from pikanid.optimise.minpack import minimise


@pytest.mark.parametrize("size", [1.0, 1e-3])
def test_a_minimum_at_bounds_is_met_by_small_residuals_too(size: float) -> None:
    """Three rows; without bounds the minimum lies beyond one of them."""
    A, goal = np.array([[1.0, 0.3], [0.2, 1.0], [0.5, -0.4]]), np.array([3.0, 1.0])
    upper = np.array([2.0, 5.0])
    found = minimise(lambda q: size * (A @ (q - goal)), lambda q: size * A,
                     np.array([1.0, 0.1]), np.zeros(2), upper)
    # the first at its bound, the second at its best beside it
    rest = A @ (goal - [2.0, 0.0])
    wanted = float(A[:, 1] @ rest / (A[:, 1] @ A[:, 1]))
    assert found.converged
    np.testing.assert_allclose(found.theta, [2.0, wanted], rtol=1e-5)


@pytest.mark.parametrize("seed", range(30))
def test_linear_problems_are_solved_as_by_scipy_where_bounds_hold_parameters(seed: int) -> None:
    """Columns of all sizes, none negative.  A step that a bound stops is no end: MINPACK, which
    refuses it, takes nine of ten of these for solved elsewhere.
    """
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(20, 4)) * 10.0 ** rng.uniform(-3, 3, 4)
    b, low, high = 3 * rng.normal(size=20), np.zeros(4), np.full(4, np.inf)
    best = lsq_linear(A, b, (low, high))
    start = best.x + 10.0 ** rng.uniform(-3, 0, 4) / np.linalg.norm(A, axis=0)
    found = minimise(lambda q: A @ q - b, lambda q: A, start, low, high)
    assert found.converged and found.cost < best.cost * (1 + 1e-6)


def test_fewer_residuals_than_parameters_are_still_brought_to_zero() -> None:
    """MINPACK refuses them: no bound is near, and a minimum is found all the same."""
    A = np.array([[1.0, 2.0, -1.0]])
    wide = np.full(3, 100.0)
    found = minimise(lambda q: A @ q - 5.0, lambda q: A, np.ones(3), -wide, wide)
    assert found.converged and found.cost < 1e-12
    assert float(A[0] @ found.theta) == pytest.approx(5.0)


def test_without_parameters_the_cost_is_that_of_the_residual() -> None:
    none = np.empty(0)
    found = minimise(lambda q: np.array([3.0, 4.0]), lambda q: np.empty((2, 0)), none, none, none)
    assert (found.cost, found.converged, found.evaluations) == (12.5, True, 1)
    assert found.theta.shape == (0,)


def test_a_fit_that_another_one_follows_ends_where_a_step_promises_too_little() -> None:
    """A line whose residual has a part that no step removes: ½·4² of it, and ½·3² that one does."""
    wide = np.full(1, 100.0)

    def found(enough: float) -> float:
        return float(minimise(lambda q: np.array([q[0], 4.0]), lambda q: np.array([[1.0], [0.0]]),
                              np.array([3.0]), -wide, wide, enough=enough).theta[0])

    share = 3.0**2 / (3.0**2 + 4.0**2)
    assert found(1.01 * share) == 3.0
    assert found(0.99 * share) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("rows", [1, 3])
def test_a_start_without_any_residual_is_the_end(rows: int) -> None:
    """What the guesses explain to the last digit is converged, after no step at all."""
    theta = np.array([0.3, -0.7])
    slopes = np.arange(2.0 * rows).reshape(rows, 2) + 1.0
    found = minimise(lambda q: slopes @ (q - theta), lambda q: slopes, theta,
                     np.full(2, -1.0), np.full(2, 1.0), 1e-8, 50)
    assert found.converged and found.cost == 0.0
    assert found.theta.tolist() == theta.tolist()
