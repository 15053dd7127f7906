"""The play operator along a recorded input; imported where it is used: numba takes its time."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True)
def play(time: np.ndarray, values: np.ndarray, slopes: np.ndarray, half: float
         ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Carrier, its slope and the side of contact, from each knot (K,) on.

    Args:
        time: (N,) knots of the input u.
        values: (N,) of u at its knots, from the right.
        slopes: (N,) of u behind them.
        half: Half the play, in the unit of u.
    """
    N = len(time)
    knots, carriers = np.empty(2 * N), np.empty(2 * N)
    rates, sides = np.empty(2 * N), np.empty(2 * N)
    count, carrier, side = 0, 0.0, 0.0
    for k in range(N):
        u, slope = values[k], slopes[k]
        v = carrier + side * half
        if u - half > v:
            carrier, side = u, -1.0
        elif u + half < v:
            carrier, side = u, 1.0
        v = carrier + side * half
        way = np.sign(slope)
        # how far u must still go before it pushes
        gap = (v - u) * way + half if way != 0.0 else np.inf
        if gap <= 1e-12 * (half + abs(u)):
            gap = 0.0
        touch = time[k] + gap / abs(slope) if way != 0.0 else np.inf
        follows = k + 1 < N and touch < time[k + 1]
        if not follows or touch > time[k]:
            knots[count], carriers[count], rates[count], sides[count] = time[k], carrier, 0.0, side
            count += 1
        if follows:
            carrier, side = u + slope * (touch - time[k]), -way
            knots[count], carriers[count], rates[count], sides[count] = touch, carrier, slope, side
            count += 1
            carrier += slope * (time[k + 1] - touch)
    return knots[:count], carriers[:count], rates[:count], sides[:count]
