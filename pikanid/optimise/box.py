"""Boxes: which bounds are met, and quadratic programmes, as every step within bounds is one."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError

from pikanid.approximators import Array


def box_minimum(matrix: Array, slope: Array, lower: Array, upper: Array) -> Array:
    """Minimum of ½dᵀMd + sᵀd over lower <= d <= upper, by active sets (M positive definite).

    Entries whose row of M is zero stay at zero.

    >>> box_minimum(np.diag([1.0, 2.0]), np.array([-3.0, -2.0]), np.zeros(2), np.array([2.0, 9.0]))
    array([2., 1.])

    Raises:
        LinAlgError: If the matrix is not positive definite.
    """
    from pikanid.optimise.active_set import box_minimum as minimum

    change = np.empty(slope.size)
    if not minimum(matrix, slope, lower, upper, change):
        raise LinAlgError("the reduced matrix is not positive definite")
    return change


def met(theta: Array, lower: Array, upper: Array) -> NDArray[np.bool_]:
    """Which entries of θ (n,) lie at a bound, up to rounding.

    >>> met(np.array([1.0, 5.0, 0.0]), np.array([1.0, 0.0, 0.0]), np.array([2.0, np.inf, 1.0]))
    array([ True, False,  True])
    """
    # plain numbers: for a few parameters NumPy's overhead is all there is
    found = [any(math.isfinite(b) and abs(q - b) <= 1e-6 * abs(b) for b in bounds)
             for q, *bounds in zip(theta.tolist(), lower.tolist(), upper.tolist(), strict=True)]
    return np.array(found, bool)

