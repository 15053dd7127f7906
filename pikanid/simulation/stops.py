"""Which stops a simulation makes and what is seen at each, compiled: one pass over all times.

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
