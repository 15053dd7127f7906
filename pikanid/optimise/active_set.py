"""Compiled active-set method for quadratic programmes in a box of a few dimensions.

J. Nocedal and S. J. Wright, Numerical Optimization, 2nd ed. (2006), section 16.5.  Compiled once
and kept on disk, which is why this module is imported only where it is used.
"""

from __future__ import annotations

import numpy as np

from pikanid.optimise.small_matrices import scaled_factor, solve_factored
from pikanid.storage.jit import cached_jit

_compiled = cached_jit(error_model="numpy", nogil=True)

OUTWARD = 1e-12  # numerical: of the largest scaled slope, below which a multiplier is rounding


@_compiled
def box_minimum(matrix: np.ndarray, slope: np.ndarray, lower: np.ndarray, upper: np.ndarray,
                change: np.ndarray) -> bool:
    """Fill change (b,) with the minimum of ½dᵀMd + sᵀd over lower <= d <= upper.

    Entries whose diagonal of M is zero have no influence and stay where they are.  False where the
    rows and columns of those that are free are not positive definite.
    """
    size = slope.size
    bound, root, largest = np.empty(size, np.bool_), np.empty(size), 1.0
    for i in range(size):
        bound[i] = lower[i] >= upper[i] or matrix[i, i] == 0.0
        if not (bound[i] or matrix[i, i] > 0.0):
            return False
        root[i] = np.sqrt(matrix[i, i]) if matrix[i, i] > 0.0 else 1.0
        largest = max(largest, abs(slope[i] / root[i]))
        change[i] = min(max(0.0, lower[i]), upper[i])
    scale, factor, solved = np.empty(size), np.empty((size, size)), np.empty(size)
    for _ in range(4 * size + 4):
        free = np.flatnonzero(~bound)
        if not scaled_factor(matrix, free, scale, factor):
            return False
        for k in range(free.size):
            solved[k] = -_pull(matrix, slope, change, bound, free[k]) / scale[k]
        solve_factored(factor, free.size, solved)
        for k in range(free.size):
            change[free[k]] = solved[k] / scale[k]
        worst, most = -1, 0.0
        for i in range(size):
            beyond = root[i] * max(lower[i] - change[i], change[i] - upper[i])
            if not bound[i] and beyond > most:
                worst, most = i, beyond
        if worst >= 0:
            change[worst] = lower[worst] if change[worst] < lower[worst] else upper[worst]
            bound[worst] = True
            continue
        every, most = np.ones(size, np.bool_), OUTWARD * largest
        for i in range(size):
            if bound[i] and lower[i] < upper[i] and matrix[i, i] > 0.0:
                pull = _pull(matrix, slope, change, every, i) / root[i]
                outward = -pull if change[i] <= lower[i] else pull
                if outward > most:
                    worst, most = i, outward
        if worst < 0:
            break
        bound[worst] = False
    for i in range(size):
        change[i] = min(max(change[i], lower[i]), upper[i])
    return True


@_compiled
def _pull(matrix: np.ndarray, slope: np.ndarray, change: np.ndarray, counted: np.ndarray, i: int
          ) -> float:
    """Entry i of Md + s, of those entries of d alone that are counted."""
    total = slope[i]
    for j in range(slope.size):
        if counted[j]:
            total += matrix[i, j] * change[j]
    return total
