"""What goes on step by step along a motion: linear systems, lags, and loops of hysteresis.

Imported where it is used: numba takes its time.
"""

from __future__ import annotations

import numpy as np

from pikanid.storage.jit import cached_jit


@cached_jit()
def follow(A: np.ndarray, F: np.ndarray, h: np.ndarray, start: np.ndarray, parts: int
           ) -> np.ndarray:
    """Many linear systems that share their matrix, X' = A(t) X + F(t): X (L, n, m) by the classical
    Runge-Kutta method.

    Args:
        A: (3, L-1, n, n) at the left end, the middle and the right end of each step; a parabola
            between.
        F: (3, L-1, n, m) likewise.
        h: (L-1,) steps.
        start: (n, m) X at the beginning.
        parts: That every step is cut into.
    """
    steps, n, m = F.shape[1:]
    out = np.empty((steps + 1, n, m))
    out[0] = start
    x, probe, slope, total = start.copy(), start.copy(), np.empty((n, m)), np.empty((n, m))
    a, f = np.empty((3, n, n)), np.empty((3, n, m))
    for k in range(steps):
        size = h[k] / parts
        for part in range(parts):
            for place in range(3):
                s = (part + 0.5 * place) / parts
                left, middle, right = (1 - s) * (1 - 2 * s), 4 * s * (1 - s), s * (2 * s - 1)
                for i in range(n):
                    for j in range(n):
                        a[place, i, j] = (left * A[0, k, i, j] + middle * A[1, k, i, j]
                                          + right * A[2, k, i, j])
                    for j in range(m):
                        f[place, i, j] = (left * F[0, k, i, j] + middle * F[1, k, i, j]
                                          + right * F[2, k, i, j])
            for stage in range(4):
                place = (stage + 1) // 2
                weight = 2.0 if 0 < stage < 3 else 1.0
                for i in range(n):
                    for j in range(m):
                        slope[i, j] = f[place, i, j]
                    for q in range(n):
                        factor = a[place, i, q]
                        if factor != 0.0:
                            for j in range(m):
                                slope[i, j] += factor * probe[q, j]
                ahead = size if stage == 2 else 0.5 * size
                for i in range(n):
                    for j in range(m):
                        if stage == 0:
                            total[i, j] = slope[i, j]
                        else:
                            total[i, j] += weight * slope[i, j]
                        probe[i, j] = x[i, j] + ahead * slope[i, j]
            for i in range(n):
                for j in range(m):
                    x[i, j] += size / 6 * total[i, j]
                    probe[i, j] = x[i, j]
        out[k + 1] = x
    return out


@cached_jit()
def lagged(t: np.ndarray, y: np.ndarray, tau: float, held: bool = False) -> np.ndarray:
    """A first-order lag tau of y (L,) at times t; of a held signal the mean over each step."""
    out = np.empty(len(y))
    state = y[0]
    out[0] = state
    for k in range(len(t) - 1):
        h = t[k + 1] - t[k]
        keep = np.exp(-h / tau)
        if held:
            out[k] = y[k] + (state - y[k]) * (1 - keep) * tau / h
            state = y[k] + (state - y[k]) * keep
        else:
            slope = (y[k + 1] - y[k]) / h
            state = (state - y[k] + slope * tau) * keep + y[k + 1] - slope * tau
            out[k + 1] = state
    if held:
        out[-1] = state
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
