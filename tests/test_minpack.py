"""Bounded least squares to the last digit, also where residuals are small."""

from __future__ import annotations

import numpy as np
import pytest

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
