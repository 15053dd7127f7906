"""Compiled solutions of banded normal equations.

Compiled once and kept on disk, which is why this module is imported only where it is used.
"""

from __future__ import annotations

import numpy as np

from pikanid.storage.jit import cached_jit

_compiled = cached_jit(error_model="numpy", nogil=True)
_written_out = cached_jit(error_model="numpy", nogil=True, inline="always")

USUAL = 6  # numerical: kd + 1 of a second-order equation on the default grid: loops of known length
SINGULAR = 1e-14  # numerical: of a diagonal entry, below which its pivot is rounding


@_compiled
def factor_in_place(band: np.ndarray) -> bool:
    """Cholesky factor of a lower band, column after column: (n, kd + 1), row j column j of it.

    False where the matrix is not positive definite.
    """
    n, reach = band.shape
    for j in range(n):
        if not band[j, 0] > 0.0:
            return False
        band[j, 0] = np.sqrt(band[j, 0])
        last = min(reach, n - j)
        for i in range(1, last):
            band[j, i] /= band[j, 0]
        for i in range(1, last):
            share = band[j, i]
            for k in range(i, last):
                band[j + i, k - i] -= share * band[j, k]
    return True


@_compiled
def substitute(factor: np.ndarray, columns: np.ndarray) -> None:
    """Solve LLᵀ x = b in place for columns (n, q), L the lower band factor (kd + 1, n).

    Row by row, all columns at once: LAPACK takes them one after the other.
    """
    size, reach, count = factor.shape[1], factor.shape[0], columns.shape[1]
    for j in range(size):
        pivot = 1.0 / factor[0, j]
        for c in range(count):
            columns[j, c] *= pivot
        for k in range(1, min(reach, size - j)):
            for c in range(count):
                columns[j + k, c] -= factor[k, j] * columns[j, c]
    for j in range(size - 1, -1, -1):
        for k in range(1, min(reach, size - j)):
            for c in range(count):
                columns[j, c] -= factor[k, j] * columns[j + k, c]
        pivot = 1.0 / factor[0, j]
        for c in range(count):
            columns[j, c] *= pivot


@_written_out
def _eliminate(band: np.ndarray, columns: np.ndarray, j: int, reach: int) -> None:
    """Take row j of LDLᵀ out of the next rows, itself becoming row j of D⁻¹L⁻¹ of the columns."""
    pivot = 1.0 / band[j, 0]
    for i in range(1, reach):
        share = band[j, i] * pivot
        for k in range(i, reach):
            band[j + i, k - i] -= share * band[j, k]
        for c in range(columns.shape[1]):
            columns[j + i, c] -= share * columns[j, c]
    for i in range(1, reach):
        band[j, i] *= pivot
    for c in range(columns.shape[1]):
        columns[j, c] *= pivot


@_written_out
def _put_back(band: np.ndarray, columns: np.ndarray, j: int, reach: int) -> None:
    """Row j of the solution from the rows after it."""
    for k in range(1, reach):
        for c in range(columns.shape[1]):
            columns[j, c] -= band[j, k] * columns[j + k, c]


@_compiled
def solve_in_place(band: np.ndarray, columns: np.ndarray) -> bool:
    """Solve A x = b in place for columns (n, q), the lower band of A as in `factor_in_place`.

    False where A is not positive definite; the band is lost.  It is LDLᵀ, without square roots, and
    the columns follow in the same sweep: half the time of a factor first.
    """
    n, reach = band.shape
    usual = n - USUAL if reach == USUAL else -1
    for j in range(n):
        if not band[j, 0] > 0.0:
            return False
        if j <= usual:
            _eliminate(band, columns, j, USUAL)
        else:
            _eliminate(band, columns, j, min(reach, n - j))
    for j in range(n - 1, -1, -1):
        if j <= usual:
            _put_back(band, columns, j, USUAL)
        else:
            _put_back(band, columns, j, min(reach, n - j))
    return True


@_compiled
def trace_of_quotient(share: np.ndarray, band: np.ndarray, lift: float) -> float:
    """tr(A⁻¹ A_d) of lower bands (kd + 1, n), A_d the share; A's diagonal rises by its `lift`.

    NaN where A is not positive definite.  Of Z = A⁻¹ the band is enough, and follows from the
    factor A = LLᵀ backwards (K. Takahashi, J. Fagan and M.-S. Chin, PICA Conf. 1973): with
    l = L[j+1:, j]/L[j, j],  Z[j+1:, j] = -Z[j+1:, j+1:] l  and  Z[j, j] = L[j, j]⁻² - l·Z[j+1:, j].
    """
    reach, n = band.shape
    inverse, column = np.empty((n, reach)), np.empty(reach)  # row j: column j of L, then of Z
    for j in range(n):
        for k in range(reach):
            inverse[j, k] = band[k, j]
        inverse[j, 0] *= 1.0 + lift
    if not factor_in_place(inverse):
        return np.nan
    trace = 0.0
    for j in range(n - 1, -1, -1):
        last, pivot = min(reach, n - j), inverse[j, 0]
        for k in range(1, last):
            column[k] = inverse[j, k] / pivot
        inverse[j, 0] = 1.0 / pivot**2
        for i in range(1, last):
            total = 0.0
            for k in range(1, last):
                total -= column[k] * inverse[j + min(i, k), abs(i - k)]
            inverse[j, i] = total
        for k in range(1, last):
            inverse[j, 0] -= column[k] * inverse[j, k]
            trace += 2.0 * share[k, j] * inverse[j, k]
        trace += share[0, j] * inverse[j, 0]
    return trace


@_compiled
def reduce_block(band: np.ndarray, damping: float, right: np.ndarray, corner: np.ndarray,
                 columns: np.ndarray, solved: np.ndarray, schur: np.ndarray, slope: np.ndarray
                 ) -> float:
    """Fill solved (n, b + 1) with A⁻¹ right and add corner - rightᵀ solved at columns (b,).

    band (kd + 1, n) is the lower one of A; its diagonal and that of the corner are raised by the
    share `damping` first.  The part by θ goes to schur (symmetric), the last column to slope; the
    last entry of the product is returned, NaN where A is not positive definite.  Sums of some rows
    are summed up in turn: the difference may be all that is left of large numbers.
    """
    count = right.shape[1]
    factor = np.empty((band.shape[1], band.shape[0]))
    for m in range(factor.shape[0]):
        for k in range(factor.shape[1]):
            factor[m, k] = band[k, m]
        factor[m, 0] *= 1.0 + damping
    solved[:] = right
    if not solve_in_place(factor, solved):
        return np.nan
    total, part = np.zeros((count, count)), np.empty((count, count))
    for begin in range(0, right.shape[0], 64):
        part[:] = 0.0
        for m in range(begin, min(begin + 64, right.shape[0])):
            for i in range(count):
                for j in range(count):
                    part[i, j] += right[m, i] * solved[m, j]
        for i in range(count):
            for j in range(count):
                total[i, j] += part[i, j]
    for i in range(count - 1):
        for j in range(count - 1):
            schur[columns[i], columns[j]] += 0.5 * (
                corner[i, j] - total[i, j] + corner[j, i] - total[j, i])
        schur[columns[i], columns[i]] += damping * corner[i, i]
        slope[columns[i]] += corner[i, count - 1] - total[i, count - 1]
    return total[count - 1, count - 1]


@_compiled
def follow_theta(solved: np.ndarray, change: np.ndarray, columns: np.ndarray, order: np.ndarray,
                 move: np.ndarray) -> None:
    """move[order[k + m]] = -(solved[m] · [change[columns], 1]), the first k entries left alone."""
    held, b = order.size - solved.shape[0], columns.size
    for m in range(solved.shape[0]):
        total = solved[m, b]
        for k in range(b):
            total += solved[m, k] * change[columns[k]]
        move[order[held + m]] = -total


@_compiled
def penalised(data: np.ndarray, rough: np.ndarray, rho: float, right: np.ndarray,
              bent: np.ndarray, probe: np.ndarray) -> tuple[float, float]:
    """Use of the data and change of their cost at the minimum of a quadratic of A_d + ρ A_q.

    data and rough are the lower bands (n, kd + 1) as in `factor_in_place`, probe (n, q) the probes
    divided by their number, right (n, q + 1) A_d times the probes and minus the data's slope, bent
    (n,) the slope of the roughness.  Returns Σ probeᵀ(A_d + ρ A_q)⁻¹ A_d probe, NaN where the
    matrix is not positive definite beyond rounding, and xᵀA_d x + 2 xᵀ slope at the minimum x.
    """
    band, solved = data + rho * rough, right.copy()
    n, q = probe.shape
    for j in range(n):
        solved[j, q] -= rho * bent[j]
    if not solve_in_place(band, solved):
        return np.nan, np.nan
    used = change = 0.0
    for j in range(n):
        if band[j, 0] < SINGULAR * (data[j, 0] + rho * rough[j, 0]):
            return np.nan, np.nan
        for c in range(q):
            used += probe[j, c] * solved[j, c]
        total = 0.5 * data[j, 0] * solved[j, q] - right[j, q]
        for k in range(1, min(data.shape[1], n - j)):
            total += data[j, k] * solved[j + k, q]
        change += 2.0 * solved[j, q] * total
    return used, change
