"""Compiled sums over local bases: `width` functions live at a time, consecutive ones.

A sparse matrix says the same in more general terms; on a short recording, to build one and to look
up its product takes longer than the sums themselves.  Compiled once and kept on disk,
which is why this module is imported only where it is used.
"""

from __future__ import annotations

import numpy as np

from pikanid.storage.jit import cached_jit

_compiled = cached_jit(error_model="numpy", nogil=True)


@_compiled
def tabulate(knots: np.ndarray, degree: int, derivative: int, t: np.ndarray, first: np.ndarray,
             values: np.ndarray) -> bool:
    """B-splines that live at t (M,), or their derivative; False where a time has none.

    Fills first (M,), the first of them, and values (M, degree + 1).  Of degree - derivative by the
    recurrence of Cox and de Boor, then up again by
        B'_{i,k} = k (B_{i,k-1}/(ξ_{i+k}-ξ_i) - B_{i+1,k-1}/(ξ_{i+k+1}-ξ_{i+1}))
    (de Boor, A Practical Guide to Splines, ch. X).  From the right at knots, from the left at the
    last one.
    """
    count = knots.size - degree - 1
    start, stop, low = knots[degree], knots[count], degree - derivative
    spans = knots[:count + 1]
    j, known = degree, -1
    inverse = np.empty((degree + 1, degree + 1))  # of ξ_{j+1+i} - ξ_{j+1+i-order}, by order and i
    for m in range(t.size):
        x = t[m]
        if not (start <= x <= stop):
            return False
        if not (knots[j] <= x < knots[j + 1]):
            j = (np.searchsorted(spans, x) if x == stop else
                 np.searchsorted(spans, x, side="right")) - 1
        row = values[m]
        first[m] = j - degree
        if j != known:
            known = j
            for order in range(1, degree + 1):
                for i in range(order):
                    inverse[order, i] = 1.0 / (knots[j + 1 + i] - knots[j + 1 + i - order])
        if low < 0:
            row[:] = 0.0
            continue
        row[0] = 1.0
        for order in range(1, low + 1):
            carried = 0.0
            for i in range(order):
                share = row[i] * inverse[order, i]
                row[i] = carried + (knots[j + 1 + i] - x) * share
                carried = (x - knots[j + 1 + i - order]) * share
            row[order] = carried
        for order in range(low + 1, degree + 1):
            carried = 0.0
            for i in range(order):
                share = order * row[i] * inverse[order, i]
                row[i] = carried - share
                carried = share
            row[order] = carried
    return True


@_compiled
def weigh(first: np.ndarray, local: np.ndarray, c: np.ndarray, out: np.ndarray,
          column: int) -> None:
    """out[m, column] = Σ_a local[m, a] c[first[m] + a]."""
    for m in range(first.size):
        total, at = 0.0, first[m]
        for a in range(local.shape[1]):
            total += local[m, a] * c[at + a]
        out[m, column] = total


@_compiled
def weigh_all(first: np.ndarray, local: np.ndarray, offset: np.ndarray, width: np.ndarray,
              c: np.ndarray, out: np.ndarray) -> None:
    """out[k, m] = Σ_a local_k[m, a] c[first[k, m] + a] of several bases at the same times.

    local holds them one behind the other, basis k (M, width[k]) from offset[k] on.
    """
    for k in range(out.shape[0]):
        for m in range(out.shape[1]):
            total, at, place = 0.0, first[k, m], offset[k] + m * width[k]
            for a in range(width[k]):
                total += local[place + a] * c[at + a]
            out[k, m] = total


@_compiled
def spread(active: np.ndarray, rows: np.ndarray, place: np.ndarray, first: np.ndarray,
           local: np.ndarray) -> None:
    """local[m, place[active[m] + a] - first[m]] = rows[m, a]."""
    for m in range(active.size):
        for a in range(rows.shape[1]):
            local[m, place[active[m] + a] - first[m]] = rows[m, a]


@_compiled
def join_kinks(t: np.ndarray, derivative: int, active: np.ndarray, rows: np.ndarray,
               split: np.ndarray, beside: np.ndarray, times: np.ndarray, orders: np.ndarray,
               scale: np.ndarray, place: np.ndarray, first: np.ndarray, local: np.ndarray) -> None:
    """Fill local[m, place[j] - first[m]] with the derivative of kink j at t[m], over scale[j].

    active (M,) and rows (M, k + 1) are the splines that live at t and that derivative of them;
    kinks (J,) in the order of their times, their split and beside as in `KinkTable`.
    """
    k = rows.shape[1] - 1
    for m in range(t.size):
        j = np.searchsorted(split, active[m], side="right")
        while j < split.size and split[j] <= active[m] + k:
            value, left = 0.0, orders[j] - derivative
            if left >= 0 and t[m] >= times[j]:
                value = 1.0
                for i in range(left):
                    value *= (t[m] - times[j]) / (i + 1)
            for a in range(k + 1):
                value -= rows[m, a] * beside[j, active[m] - split[j] + k + a]
            local[m, place[j] - first[m]] = value / scale[j]
            j += 1


@_compiled
def project(first: np.ndarray, local: np.ndarray, y: np.ndarray, band: np.ndarray,
            right: np.ndarray) -> None:
    """Add BᵀB to the band (n, width), row j its column j from the diagonal down, and Bᵀy to right
    (n, 1), B having the rows local (M, width) from columns first (M,) on.
    """
    for m in range(first.size):
        for a in range(local.shape[1]):
            right[first[m] + a, 0] += local[m, a] * y[m]
            for b in range(local.shape[1] - a):
                band[first[m] + a, b] += local[m, a] * local[m, a + b]
