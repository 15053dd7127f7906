"""Steps in a trust region, compiled: what MINPACK's `qrfac`, `lmpar` and `qrsolv` compute.

J. J. Moré, in Numerical Analysis, Lecture Notes in Mathematics 630, 1978, p. 105.
"""

from __future__ import annotations

import math

import numpy as np

from pikanid.storage.jit import inner_jit

TINY = float(np.finfo(float).tiny)  # definition: the least of numbers

inner = inner_jit(error_model="numpy")
_summing = inner_jit(error_model="numpy", fastmath={"reassoc"})


@_summing
def product(a: np.ndarray, b: np.ndarray, first: int) -> float:
    """Σ a b over the entries from `first` on."""
    total = 0.0
    for i in range(first, a.size):
        total += a[i] * b[i]
    return total


@inner
def length(diag: np.ndarray, step: np.ndarray) -> float:
    """|D p|."""
    total = 0.0
    for j in range(diag.size):
        total += (diag[j] * step[j]) ** 2
    return math.sqrt(total)


@inner
def factor(table: np.ndarray, order: np.ndarray, R: np.ndarray) -> None:
    """Householder's QR of the first n rows of the table (n + 1, rows), as columns, the largest
    that is left first; the last row becomes Qᵀ of itself.

    Fills order (n,) and the upper triangle of R (n, n): column order[j] is Q R[:, j].
    """
    n, rows = order.size, table.shape[1]
    for j in range(n):
        order[j] = j
    for j in range(n):
        best, most = j, -1.0
        for k in range(j, n):
            square = product(table[k], table[k], j)
            if square > most:
                best, most = k, square
        if best != j:
            for i in range(rows):
                value = table[j, i]
                table[j, i] = table[best, i]
                table[best, i] = value
            k = order[j]
            order[j] = order[best]
            order[best] = k
        own, norm = table[j], math.copysign(math.sqrt(most), table[j, j])
        for i in range(j):
            R[i, j] = own[i]
        R[j, j] = -norm
        if most == 0.0:
            continue
        own[j] += norm
        for k in range(j + 1, n + 1):
            share = product(own, table[k], j) / (norm * own[j])
            for i in range(j, rows):
                table[k, i] -= share * own[i]


@inner
def trust_step(diag: np.ndarray, qtr: np.ndarray, radius: float, par: float, order: np.ndarray,
               R: np.ndarray, spare: np.ndarray, turned: np.ndarray, S: np.ndarray,
               step: np.ndarray) -> float:
    """Fill step (n,) with Gauss-Newton's, -J⁺r, or where |D step| is longer than the radius with
    the damped one, (JᵀJ + par D²)⁻¹ of -Jᵀr, that is as long, both to a tenth.

    Args:
        diag: D (n,).
        qtr, order, R: Of J = QR, see `factor`.
        par: The damping to begin with; the right one is returned.
        spare, turned, S: (n + 2, 2 n), (n,) and (n, n) to work in.
    """
    n, w = order.size, spare[-1, :order.size]
    full = _solve(R, order, qtr, w, step)
    far = length(diag, step)
    over = far - radius
    if over <= 0.1 * radius:
        return 0.0
    low = over / radius / _bend(diag, R, order, w, step, far) if full else 0.0
    for j in range(n):
        w[j] = 0.0
        for i in range(j + 1):
            w[j] += R[i, j] * qtr[i]
        w[j] /= diag[order[j]]
    steep = math.sqrt(product(w, w, 0))
    high = steep / radius
    if high == 0.0:
        high = TINY / min(radius, 0.1)
    par = min(max(par, low), high)
    if par == 0.0:
        par = steep / far
    for turn in range(10):
        if par == 0.0:
            par = max(TINY, 0.001 * high)
        spare[:] = 0.0
        for j in range(n):
            for i in range(j + 1):
                spare[order[j], i] = R[i, j]
            spare[order[j], n + j] = math.sqrt(par) * diag[order[j]]
            spare[n, j] = qtr[j]
        factor(spare[:-1], turned, S)
        _solve(S, turned, spare[n], w, step)
        far = length(diag, step)
        before, over = over, far - radius
        if abs(over) <= 0.1 * radius or (low == 0.0 and over <= before < 0.0) or turn == 9:
            break
        if over > 0.0:
            low = max(low, par)
        else:
            high = min(high, par)
        par = max(low, par + over / radius / _bend(diag, S, turned, w, step, far))
    return par


@inner
def _solve(R: np.ndarray, order: np.ndarray, qtr: np.ndarray, w: np.ndarray, step: np.ndarray
           ) -> bool:
    """Fill step (n,) with minus the solution; False where R is singular: what it does not see of a
    step is zero.
    """
    n = rank = order.size
    for j in range(n - 1, -1, -1):
        if R[j, j] == 0.0:
            rank = j
    for j in range(n - 1, -1, -1):
        w[j] = 0.0
        if j < rank:
            w[j] = -qtr[j]
            for i in range(j + 1, rank):
                w[j] -= R[j, i] * w[i]
            w[j] /= R[j, j]
        step[order[j]] = w[j]
    return rank == n


@inner
def _bend(diag: np.ndarray, R: np.ndarray, order: np.ndarray, w: np.ndarray, step: np.ndarray,
          far: float) -> float:
    """|R⁻ᵀ D² p|²/|D p|²: how fast a step p becomes shorter with more damping."""
    for j in range(order.size):
        w[j] = diag[order[j]] ** 2 * step[order[j]] / far
        for i in range(j):
            w[j] -= R[i, j] * w[i]
        w[j] /= R[j, j]
    return product(w, w, 0)
