"""Which stops a simulation makes, what is seen and put in at each, compiled: one pass for each.

Compiled once and kept on disk, which is why this module is imported only where it is used.
"""

from __future__ import annotations

import numpy as np

from pikanid.simulation.support import kernel


@kernel
def lay_out(times: np.ndarray, gap: float, wanted: np.ndarray, shown: np.ndarray, T: np.ndarray,
            first: np.ndarray, stop: np.ndarray, output: np.ndarray, row: np.ndarray,
            inside: np.ndarray) -> int:
    """Fill T with the stops, whose number is returned, and the rest as `layout.Seen` has it.

    Args:
        times: (K,) sorted, two or more; those closer than `gap`, which differ by rounding only,
            become one stop.
        wanted, shown: (N,) times of the observations, and which output each is of; each belongs to
            the nearest stop.
        T, first: (K,) and (K + 1,) to fill.
        stop, output, row, inside: (N,) to work in and to fill.
    """
    count = 1
    T[0] = times[0]
    for k in range(1, times.size):
        if times[k] - times[k - 1] > gap:
            T[count] = times[k]
            count += 1
    if count < 2:
        T[1] = T[0] + 1e-9
        count = 2
    for k in range(count + 1):
        first[k] = 0
    k = 1
    for i in range(wanted.size):
        if i == 0 or wanted[i] < wanted[i - 1]:
            k = 1
        while k < count - 1 and T[k] < wanted[i]:
            k += 1
        stop[i] = k - 1 if wanted[i] - T[k - 1] < T[k] - wanted[i] else k
        first[stop[i] + 1] += 1
    for k in range(count):
        first[k + 1] += first[k]
    for i in range(wanted.size):
        at = first[stop[i]]
        first[stop[i]] += 1
        output[at], row[at], inside[at] = shown[i], i, wanted[i] > times[0]
    for k in range(count, 0, -1):
        first[k] = first[k - 1]
    first[0] = 0
    return count


@kernel
def draw(T: np.ndarray, knots: np.ndarray, values: np.ndarray, slopes: np.ndarray, slack: float,
         late: float, j: int, U: np.ndarray, V: np.ndarray, jumps: np.ndarray) -> None:
    """Fill column j of U and V (L, m) with an input's values right of each stop and its slopes, and
    mark in jumps (L,) where these change by more than rounding.

    Args:
        T: (L,) stops; between them no knot lies.
        knots, values, slopes, slack: (K,) as `HeldInput.lines` has them.
        late: The input's delay.
    """
    last, k, largest, steepest = T.size - 1, 0, 0.0, 0.0
    for i in range(T.size):
        # by what holds half-way to the next stop: at the stop itself rounding would decide
        t = (T[i] if i == last else 0.5 * (T[i] + T[i + 1])) - late
        while k < knots.size - 1 and knots[k + 1] <= t + slack:
            k += 1
        slope = 0.0 if t < knots[0] else slopes[k]
        value = values[k] + slope * max(t - knots[k], 0.0)
        if i == last:
            slope = V[i - 1, j]
        else:
            value -= slope * (0.5 * (T[i] + T[i + 1]) - T[i])
        U[i, j], V[i, j] = value, slope
        largest, steepest = max(largest, abs(value)), max(steepest, abs(slope))
    for i in range(1, T.size):
        end = U[i - 1, j] + V[i - 1, j] * (T[i] - T[i - 1])
        if abs(U[i, j] - end) > 1e-9 * largest or abs(V[i, j] - V[i - 1, j]) > 1e-9 * steepest:
            jumps[i] = True
