"""Play and limited rate along a recorded input; imported where used: numba takes its time."""

from __future__ import annotations

import numpy as np

from pikanid.storage.jit import cached_jit


@cached_jit()
def play(time: np.ndarray, values: np.ndarray, slopes: np.ndarray, half: float
         ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Carrier, its slope and the side of contact, from each knot (K,) on, and how fast that knot
    moves with `half`.

    Args:
        time: (N,) knots of the input u.
        values: (N,) of u at its knots, from the right.
        slopes: (N,) of u behind them.
        half: Half the play, in the unit of u.
    """
    N = len(time)
    knots, carriers = np.empty(2 * N), np.empty(2 * N)
    rates, sides, moves = np.empty(2 * N), np.empty(2 * N), np.zeros(2 * N)
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
            moves[count] = (side + way) / slope if touch > time[k] else 0.0
            carrier, side = u + slope * (touch - time[k]), -way
            knots[count], carriers[count], rates[count], sides[count] = touch, carrier, slope, side
            count += 1
            carrier += slope * (time[k + 1] - touch)
    return knots[:count], carriers[:count], rates[:count], sides[:count], moves[:count]


@cached_jit()
def limited(knots: np.ndarray, carriers: np.ndarray, rates: np.ndarray, sides: np.ndarray,
            moves: np.ndarray, half: float, most: float
            ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """What follows v = carrier + side·half no faster than `most`: w = c + s·half + q·most, with
    s = ∂w/∂half and q = ∂w/∂most.

    Args:
        knots, carriers, rates, sides, moves: (K,) as from `play`.
        half: Half the play.
        most: Greatest rate [1/s].

    Returns:
        Knots, c, its slope, s, q and its slope, each (up to 3K,).
    """
    K = len(knots)
    out, count = np.zeros((6, 3 * K)), 0
    c, s, q = carriers[0], sides[0], 0.0
    for k in range(K):
        t, stop = knots[k], knots[k + 1] if k + 1 < K else np.inf
        v, slope = carriers[k] + sides[k] * half, rates[k]
        gap = v - (c + s * half + q * most)
        # when v is met, and how that moment moves with `half` and `most`
        met, by_half, by_most = t, moves[k], 0.0
        if abs(gap) > 1e-12 * (abs(v) + half + abs(q) * most):
            way = np.sign(gap)
            closing = most - way * slope
            met = t + abs(gap) / closing if closing > 0.0 else np.inf
            out[:, count] = t, c, 0.0, s, q, way
            count += 1
            if met >= stop:
                q += way * (stop - t)
                continue
            by_half = (s - sides[k]) / (slope - way * most)
            by_most = (q + way * (met - t)) / (slope - way * most)
        c, s, q = carriers[k] + slope * (met - t), sides[k], 0.0
        if abs(slope) > most:
            # v runs ahead from here on
            way = np.sign(slope)
            excess = slope - way * most
            c -= excess * (by_half * half + by_most * most)
            s, q = s + excess * by_half, excess * by_most
            out[:, count] = met, c, 0.0, s, q, way
            q += way * (stop - met)
        else:
            out[:, count] = met, c, slope, s, q, 0.0
            c += slope * (stop - met) if slope != 0.0 else 0.0
        count += 1
    return (out[0, :count], out[1, :count], out[2, :count], out[3, :count], out[4, :count],
            out[5, :count])
