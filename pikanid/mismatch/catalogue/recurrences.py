"""What goes on step by step along a motion: lags, and loops of hysteresis.

Imported where it is used: numba takes its time.
"""

from __future__ import annotations

import numpy as np

from pikanid.storage.jit import cached_jit


@cached_jit()
def lagged(t: np.ndarray, y: np.ndarray, rate: np.ndarray, tau: float) -> np.ndarray:
    """A first-order lag tau of y (L,) with its rate (L,) at times t.

    Exact for parabolas through values and the rate that a step begins with (the next one may jump,
    as an input does); for straight lines where the lag is longer than a step.
    """
    out = np.empty(len(y))
    state = y[0]
    out[0] = state
    for k in range(len(t) - 1):
        h = t[k + 1] - t[k]
        slope = (y[k + 1] - y[k]) / h
        left = rate[k] if tau < h else slope
        bend = 2 * (slope - left) / h
        before = y[k] - tau * (left - tau * bend)
        after = y[k + 1] - tau * (left + h * bend - tau * bend)
        state = after + (state - before) * np.exp(-h / tau)
        out[k + 1] = state
    return out


@cached_jit()
def lag_of_held(t: np.ndarray, u: np.ndarray, tau: float) -> np.ndarray:
    """What a first-order lag tau takes from a held signal u (L,), in each step as the straight line
    of the same mean and moment: (3, L) at its left end, its middle and its right end.
    """
    out = np.zeros((3, len(u)))
    state = u[0]
    for k in range(len(t) - 1):
        h = t[k + 1] - t[k]
        keep, off = np.exp(-h / tau), state - u[k]
        mean = off * tau / h * (1 - keep)
        moment = off * (tau / h) * (tau / h * (1 - keep) - keep)
        tilt = 6 * moment - 3 * mean
        out[0, k], out[1, k], out[2, k] = mean - tilt, mean, mean + tilt
        state = u[k] + off * keep
    return out


@cached_jit()
def bouc_wen(q: np.ndarray) -> np.ndarray:
    """Bouc and Wen's z along q (L,), q in units of the yield displacement: dz = dq (1 - sgn(dq) z)
    when loaded further, dz = dq when unloaded; exact along straight lines.
    """
    z = np.zeros(len(q))
    for k in range(len(q) - 1):
        dq = q[k + 1] - q[k]
        if dq == 0:
            z[k + 1] = z[k]
            continue
        sense = 1.0 if dq > 0 else -1.0
        now = sense * z[k]
        free = min(abs(dq), max(-now, 0.0))
        now += free
        if now >= 0:
            now = 1 - (1 - now) * np.exp(-(abs(dq) - free))
        z[k + 1] = sense * now
    return z
