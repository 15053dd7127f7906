"""Compiled algebra of the reduced matrix of θ: a few rows, where a call takes longer than its work.

Compiled once and kept on disk, which is why this module is imported only where it is used.
"""

from __future__ import annotations

import numpy as np

from pikanid.storage.jit import cached_jit

_compiled = cached_jit(error_model="numpy", nogil=True)


@_compiled
def scaled_factor(matrix: np.ndarray, which: np.ndarray, root: np.ndarray,
                  factor: np.ndarray) -> bool:
    """Cholesky factor of the rows and columns `which` (k,), scaled by the root of the diagonal.

    Fills root (k,) and the lower triangle of factor (k, k); False where that part is not positive
    definite.
    """
    for i in range(which.size):
        if not matrix[which[i], which[i]] > 0.0:
            return False
        root[i] = np.sqrt(matrix[which[i], which[i]])
    for i in range(which.size):
        for j in range(i + 1):
            total = matrix[which[i], which[j]] / (root[i] * root[j])
            for k in range(j):
                total -= factor[i, k] * factor[j, k]
            if j < i:
                factor[i, j] = total / factor[j, j]
            elif total > 0.0:
                factor[i, i] = np.sqrt(total)
            else:
                return False
    return True


@_compiled
def solve_factored(factor: np.ndarray, size: int, column: np.ndarray) -> None:
    """Solve LLᵀx = column in place, L the first rows of a factor, as many as `size`."""
    for i in range(size):
        for k in range(i):
            column[i] -= factor[i, k] * column[k]
        column[i] /= factor[i, i]
    for i in range(size - 1, -1, -1):
        for k in range(i + 1, size):
            column[i] -= factor[k, i] * column[k]
        column[i] /= factor[i, i]


@_compiled
def fall(matrix: np.ndarray, slope: np.ndarray, change: np.ndarray) -> float:
    """By how much dᵀMd + 2sᵀd lies below zero at a change d (b,)."""
    total = 0.0
    for i in range(slope.size):
        bent = 2.0 * slope[i]
        for j in range(slope.size):
            bent += matrix[i, j] * change[j]
        total -= change[i] * bent
    return total


@_compiled
def free_minimum(matrix: np.ndarray, slope: np.ndarray, theta: np.ndarray, lower: np.ndarray,
                 upper: np.ndarray, change: np.ndarray) -> float:
    """Fill change (b,) with the minimum of ½dᵀMd + sᵀd; by how much dᵀMd + 2sᵀd falls there.

    NaN unless θ + d lies inside the box, lower < upper holds and the matrix is positive definite,
    or θ has no freedom at all.
    """
    size = slope.size
    if (lower >= upper).all():
        for i in range(size):
            change[i] = min(max(0.0, lower[i] - theta[i]), upper[i] - theta[i])
        return fall(matrix, slope, change)
    root, factor = np.empty(size), np.empty((size, size))
    if not ((lower < upper).all() and scaled_factor(matrix, np.arange(size), root, factor)):
        return np.nan
    for i in range(size):
        change[i] = -slope[i] / root[i]
    solve_factored(factor, size, change)
    for i in range(size):
        change[i] /= root[i]
        if not lower[i] - theta[i] <= change[i] <= upper[i] - theta[i]:
            return np.nan
    return fall(matrix, slope, change)


@_compiled
def strictly_inside(theta: np.ndarray, lower: np.ndarray, upper: np.ndarray,
                    inside: np.ndarray) -> None:
    """Fill inside (b,): which entries of θ are farther than 1e-6 of it from either bound."""
    for k in range(theta.size):
        inside[k] = True
        for bound in (lower[k], upper[k]):
            if np.isfinite(bound) and abs(theta[k] - bound) <= 1e-6 * abs(bound):
                inside[k] = False


@_compiled
def regular_inverse(matrix: np.ndarray, inside: np.ndarray, out: np.ndarray) -> bool:
    """Fill out (b, b) with the inverse of the rows and columns `inside` (b,), zero elsewhere.

    False unless that part is positive definite and, scaled, far from singular.
    """
    which = np.flatnonzero(inside)
    size = which.size
    root, factor = np.empty(size), np.empty((size, size))
    if not scaled_factor(matrix, which, root, factor):
        return False
    for j in range(size):
        if factor[j, j] < 1e-3:
            return False
    out[:] = 0.0
    lower = np.zeros((size, size))  # the factor's inverse
    for j in range(size):
        for i in range(j, size):
            rest = 1.0 if i == j else 0.0
            for k in range(j, i):
                rest -= factor[i, k] * lower[k, j]
            lower[i, j] = rest / factor[i, i]
    for i in range(size):
        for j in range(size):
            total = 0.0
            for k in range(max(i, j), size):
                total += lower[k, i] * lower[k, j]
            out[which[i], which[j]] = total / (root[i] * root[j])
    return True


@_compiled
def inverse_diagonal(matrix: np.ndarray, inside: np.ndarray, out: np.ndarray) -> None:
    """Fill out (b,) with the diagonal of the inverse of the rows and columns `inside` (b,).

    Zero outside; infinite inside where that part is not positive definite.
    """
    which = np.flatnonzero(inside)
    size = which.size
    root, factor, column = np.empty(size), np.empty((size, size)), np.empty(size)
    out[:] = 0.0
    if not scaled_factor(matrix, which, root, factor):
        out[which] = np.inf
        return
    for j in range(size):  # column j of the factor's inverse, whose squares sum up
        total = 0.0
        for i in range(j, size):
            rest = 1.0 if i == j else 0.0
            for k in range(j, i):
                rest -= factor[i, k] * column[k]
            column[i] = rest / factor[i, i]
            total += column[i] ** 2
        out[which[j]] = total / root[j] ** 2


@_compiled
def scale_triangle(R: np.ndarray, norms: np.ndarray) -> None:
    """Clear R (k, n) below its diagonal and divide its columns by their norms, which fill norms
    (n,); columns of zeros stay.
    """
    for j in range(norms.size):
        total = 0.0
        for i in range(R.shape[0]):
            if i > j:
                R[i, j] = 0.0
            total += R[i, j] ** 2
        norms[j] = np.sqrt(total)
        for i in range(min(j + 1, R.shape[0])):
            if total > 0.0:
                R[i, j] /= norms[j]


@_compiled
def inverse_square(sizes: np.ndarray, axes: np.ndarray, norms: np.ndarray, out: np.ndarray) -> None:
    """Fill out (n, n) with (AᵀA)⁻¹, A having singular values (s,), falling, and right singular
    vectors (s, n) when its columns are divided by norms (n,); values below 1e-12 count as that.
    """
    for i in range(norms.size):
        for j in range(norms.size):
            total = 0.0
            for k in range(sizes.size):
                total += axes[k, i] * axes[k, j] / max(sizes[k], 1e-12 * sizes[0]) ** 2
            out[i, j] = total / (norms[i] * norms[j])


@_compiled
def deviations(sensitivity: np.ndarray, covariance: np.ndarray, out: np.ndarray) -> None:
    """Fill out (N,) with √diag(J C Jᵀ)."""
    n = covariance.shape[0]
    for row in range(out.size):
        total = 0.0
        for i in range(n):
            along = 0.0
            for j in range(n):
                along += covariance[i, j] * sensitivity[row, j]
            total += along * sensitivity[row, i]
        out[row] = 0.0 if total < 0.0 else np.sqrt(total)
