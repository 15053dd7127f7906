"""Boxes: which bounds are met, and quadratic programmes, as every step within bounds is one."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError

from pikanid.approximators import Array
from pikanid.optimise.cholesky import solve_positive


def box_minimum(matrix: Array, slope: Array, lower: Array, upper: Array) -> Array:
    """Minimum of ½dᵀMd + sᵀd over lower <= d <= upper, by active sets (M positive definite).

    Entries whose row of M is zero stay at zero.

    >>> box_minimum(np.diag([1.0, 2.0]), np.array([-3.0, -2.0]), np.zeros(2), np.array([2.0, 9.0]))
    array([2., 1.])

    Raises:
        LinAlgError: If the matrix is not positive definite.
    """
    if slope.size == 0:
        return np.zeros(0)
    from pikanid.optimise.small_matrices import free_minimum

    change = np.empty(slope.size)
    if not math.isnan(free_minimum(matrix, slope, np.zeros(slope.size), lower, upper, change)):
        return change  # nearly always: no bound is met
    diagonal = matrix.diagonal()
    # A parameter without influence here (damping of a body at rest) stays where it is.
    bound = (lower >= upper) | (diagonal == 0.0)
    if bound.all():
        return np.clip(0.0, lower, upper)
    if not (bound | (diagonal > 0.0)).all():
        raise LinAlgError("the reduced matrix is not positive definite")
    root = np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    change = np.clip(0.0, lower, upper)
    for _ in range(4 * slope.size + 4):
        free = np.flatnonzero(~bound)
        if free.size:
            held = slope[free] + matrix[np.ix_(free, np.flatnonzero(bound))] @ change[bound]
            change[free] = _minimum(matrix[np.ix_(free, free)], held, root[free])
        over = np.maximum(lower - change, change - upper)
        if np.any(over[free] > 0.0):
            worst = int(free[np.argmax((over * root)[free])])
            change[worst] = lower[worst] if change[worst] < lower[worst] else upper[worst]
            bound[worst] = True
            continue
        if free.size == slope.size:
            return change
        pull = (matrix @ change + slope) / root
        outward = np.where(change <= lower, -pull, pull)
        wrong = np.where(bound & (lower < upper) & (diagonal > 0.0), outward, 0.0)
        if wrong.max() <= 1e-12 * max(1.0, float(np.abs(slope / root).max())):
            break
        bound[int(np.argmax(wrong))] = False
    return np.clip(change, lower, upper)


def met(theta: Array, lower: Array, upper: Array) -> NDArray[np.bool_]:
    """Which entries of θ (n,) lie at a bound, up to rounding.

    >>> met(np.array([1.0, 5.0, 0.0]), np.array([1.0, 0.0, 0.0]), np.array([2.0, np.inf, 1.0]))
    array([ True, False,  True])
    """
    # plain numbers: for a few parameters NumPy's overhead is all there is
    found = [any(math.isfinite(b) and abs(q - b) <= 1e-6 * abs(b) for b in bounds)
             for q, *bounds in zip(theta.tolist(), lower.tolist(), upper.tolist(), strict=True)]
    return np.array(found, bool)


def _minimum(matrix: Array, slope: Array, root: Array) -> Array:
    """Minimum of ½dᵀMd + sᵀd, M scaled by the root of its diagonal."""
    return -solve_positive(matrix / (root[:, None] * root), slope / root) / root
