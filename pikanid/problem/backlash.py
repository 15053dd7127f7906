"""Play and limited rate along a recorded input; imported where used: numba takes its time."""

from __future__ import annotations

import numpy as np

from pikanid.storage.jit import cached_jit


@cached_jit()
def play(time: np.ndarray, values: np.ndarray, slopes: np.ndarray, half: float, start: float
         ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray,
                    np.ndarray]:
    """Carrier, its slope, the side of contact, and whether there was none yet, from each knot (K,)
    on, and how fast that knot moves with `half` and with what acts first.

    Args:
        time: (N,) knots of the input u.
        values: (N,) of u at its knots, from the right.
        slopes: (N,) of u behind them.
        half: Half the play, in the unit of u.
        start: Where in the play u begins, in half plays; NaN where nothing acts before.
    """
    N = len(time)
    knots, carriers = np.empty(2 * N), np.empty(2 * N)
    rates, sides, moves = np.empty(2 * N), np.empty(2 * N), np.zeros(2 * N)
    untouched, shifts = np.empty(2 * N), np.zeros(2 * N)
    count, carrier, side, free = 0, 0.0, 0.0, 0.0
    if not np.isnan(start):
        carrier, side, free = values[0], start, 1.0
    for k in range(N):
        u, slope = values[k], slopes[k]
        v = carrier + side * half
        if u - half > v:
            carrier, side, free = u, -1.0, 0.0
        elif u + half < v:
            carrier, side, free = u, 1.0, 0.0
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
            untouched[count] = free
            count += 1
        if follows:
            if touch > time[k]:
                moves[count], shifts[count] = (side + way) / slope, free / slope
            carrier, side, free = u + slope * (touch - time[k]), -way, 0.0
            knots[count], carriers[count], rates[count], sides[count] = touch, carrier, slope, side
            untouched[count] = free
            count += 1
            carrier += slope * (time[k + 1] - touch)
    return (knots[:count], carriers[:count], rates[:count], sides[:count], untouched[:count],
            moves[:count], shifts[:count])


@cached_jit()
def limited(knots: np.ndarray, carriers: np.ndarray, rates: np.ndarray, sides: np.ndarray,
            untouched: np.ndarray, moves: np.ndarray, shifts: np.ndarray, half: float, most: float
            ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray,
                       np.ndarray]:
    """What follows v = carrier + side·half no faster than `most`: w = c + s·half + q·most, with
    s = ∂w/∂half, q = ∂w/∂most, and o = ∂w/∂v(0).

    Args:
        knots, carriers, rates, sides, untouched, moves, shifts: (K,) as from `play`.
        half: Half the play.
        most: Greatest rate [1/s].

    Returns:
        Knots, c, its slope, s, q, its slope, and o, each (up to 3K,).
    """
    K = len(knots)
    out, count = np.zeros((7, 3 * K)), 0
    c, s, q, o = carriers[0], sides[0], 0.0, untouched[0]
    for k in range(K):
        t, stop = knots[k], knots[k + 1] if k + 1 < K else np.inf
        v, slope = carriers[k] + sides[k] * half, rates[k]
        gap = v - (c + s * half + q * most)
        # when v is met, and how that moment moves with `half` and `most`
        met, by_half, by_most, by_start = t, moves[k], 0.0, shifts[k]
        if abs(gap) > 1e-12 * (abs(v) + half + abs(q) * most):
            way = np.sign(gap)
            closing = most - way * slope
            met = t + abs(gap) / closing if closing > 0.0 else np.inf
            out[:, count] = t, c, 0.0, s, q, way, o
            count += 1
            if met >= stop:
                q += way * (stop - t)
                continue
            by_half = (s - sides[k]) / (slope - way * most)
            by_start = (o - untouched[k]) / (slope - way * most)
            by_most = (q + way * (met - t)) / (slope - way * most)
        c, s, q, o = carriers[k] + slope * (met - t), sides[k], 0.0, untouched[k]
        if abs(slope) > most:
            # v runs ahead from here on
            way = np.sign(slope)
            excess = slope - way * most
            c -= excess * (by_half * half + by_most * most)
            s, q, o = s + excess * by_half, excess * by_most, o + excess * by_start
            out[:, count] = met, c, 0.0, s, q, way, o
            q += way * (stop - met)
        else:
            out[:, count] = met, c, slope, s, q, 0.0, o
            c += slope * (stop - met) if slope != 0.0 else 0.0
        count += 1
    return (out[0, :count], out[1, :count], out[2, :count], out[3, :count], out[4, :count],
            out[5, :count], out[6, :count])
