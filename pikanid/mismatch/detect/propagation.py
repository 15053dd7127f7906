"""Small deviations carried along a motion, X' = A(t) X + F(t), for many forces F that share A.

One step of a Runge-Kutta method is linear in X and F: its matrices are found once, and serve every
force.  Imported where it is used: numba takes its time.
"""

from __future__ import annotations

import numpy as np

from pikanid.simulation.sdirk_table import NODES, SDIRK
from pikanid.simulation.support import solve_small
from pikanid.storage.jit import cached_jit, inner_jit

TOGETHER = 8  # numerical: motions side by side, to hide how long one step takes


@inner_jit()
def keep(x: np.ndarray, k: int, M: np.ndarray, B: np.ndarray) -> None:
    """What the k-th step makes of X, and of F at three places, from the columns of x (n, 4 n)."""
    n = len(x)
    for i in range(n):
        for j in range(n):
            M[k, i, j] = x[i, j]
            for place in range(3):
                B[place, i, j, k] = x[i, (place + 1) * n + j]


@cached_jit()
def step_matrices(A: np.ndarray, h: np.ndarray, parts: int) -> tuple[np.ndarray, np.ndarray]:
    """(M (L-1, n, n), B (3, n, n, L-1)): a step takes X to M X + B[0] F_left + B[1] F_middle
    + B[2] F_right, by the classical method.

    Args:
        A: (3, L-1, n, n) at the left end, the middle and the right end of each step; a parabola
            between, as F.
        h: (L-1,) steps.
        parts: That every step is cut into.
    """
    steps, n = A.shape[1:3]
    m = 4 * n  # columns: X, and F at each of the three places
    M, B = np.empty((steps, n, n)), np.empty((3, n, n, steps))
    a, weights = np.empty((3, n, n)), np.empty((3, 3))
    x, probe, slope, total = np.empty((n, m)), np.empty((n, m)), np.empty((n, m)), np.empty((n, m))
    for k in range(steps):
        size = h[k] / parts
        for i in range(n):
            for j in range(m):
                x[i, j] = 1.0 if i == j else 0.0
                probe[i, j] = x[i, j]
        for part in range(parts):
            for place in range(3):
                s = (part + 0.5 * place) / parts
                weights[place, 0] = (1 - s) * (1 - 2 * s)
                weights[place, 1] = 4 * s * (1 - s)
                weights[place, 2] = s * (2 * s - 1)
                for i in range(n):
                    for j in range(n):
                        a[place, i, j] = (weights[place, 0] * A[0, k, i, j]
                                          + weights[place, 1] * A[1, k, i, j]
                                          + weights[place, 2] * A[2, k, i, j])
            for stage in range(4):
                place = (stage + 1) // 2
                weight = 2.0 if 0 < stage < 3 else 1.0
                ahead = size if stage == 2 else 0.5 * size
                for i in range(n):
                    for j in range(m):
                        slope[i, j] = weights[place, j // n - 1] if j >= n and j % n == i else 0.0
                    for q in range(n):
                        for j in range(m):
                            slope[i, j] += a[place, i, q] * probe[q, j]
                for i in range(n):
                    for j in range(m):
                        total[i, j] = weight * slope[i, j] + (total[i, j] if stage else 0.0)
                        probe[i, j] = x[i, j] + ahead * slope[i, j]
            for i in range(n):
                for j in range(m):
                    x[i, j] += size / 6 * total[i, j]
                    probe[i, j] = x[i, j]
        keep(x, k, M, B)
    return M, B


@cached_jit(error_model="numpy")
def stiff_matrices(A: np.ndarray, h: np.ndarray, parts: int) -> tuple[np.ndarray, np.ndarray]:
    """As `step_matrices`, by the L-stable method: for motions that forget within a step."""
    steps, n = A.shape[1:3]
    m, stages = 4 * n, len(NODES)
    M, B = np.empty((steps, n, n)), np.empty((3, n, n, steps))
    a, matrix, x = np.empty((n, n)), np.empty((n, n)), np.empty((n, m))
    K, weights = np.empty((stages, n, m)), np.empty(3)
    for k in range(steps):
        size = h[k] / parts
        for i in range(n):
            for j in range(m):
                x[i, j] = 1.0 if i == j else 0.0
        for part in range(parts):
            for stage in range(stages):
                s = (part + NODES[stage]) / parts
                weights[0] = (1 - s) * (1 - 2 * s)
                weights[1] = 4 * s * (1 - s)
                weights[2] = s * (2 * s - 1)
                for i in range(n):
                    for j in range(n):
                        a[i, j] = (weights[0] * A[0, k, i, j] + weights[1] * A[1, k, i, j]
                                   + weights[2] * A[2, k, i, j])
                        matrix[i, j] = (1.0 if i == j else 0.0) - SDIRK[0, 0] * size * a[i, j]
                slope = K[stage]
                for i in range(n):
                    for j in range(m):
                        slope[i, j] = weights[j // n - 1] if j >= n and j % n == i else 0.0
                for q in range(n):
                    for j in range(m):
                        reached = x[q, j]
                        for before in range(stage):
                            reached += size * SDIRK[stage, before] * K[before, q, j]
                        for i in range(n):
                            slope[i, j] += a[i, q] * reached
                solve_small(matrix, slope)
            for stage in range(stages):
                for i in range(n):
                    for j in range(m):
                        x[i, j] += size * SDIRK[stages - 1, stage] * K[stage, i, j]
        keep(x, k, M, B)
    return M, B


@cached_jit()
def add_forces(B: np.ndarray, forces: np.ndarray, owner: np.ndarray, row: np.ndarray,
               G: np.ndarray) -> None:
    """Add what forces do in each step to G (m, n, L-1).

    Args:
        B: (3, n, n, L-1) of `step_matrices`.
        forces: (J, L), cubics between neighbouring values.
        owner: (J,) in which of the m each acts.
        row: (J,) in which equation.
    """
    n, steps = G.shape[1:]
    middle = np.empty(steps)
    for j in range(len(forces)):
        r, s = row[j], owner[j]
        for k in range(steps):
            middle[k] = 0.5 * (forces[j, k] + forces[j, k + 1])
        for k in range(1, steps - 1):
            middle[k] += (forces[j, k] - forces[j, k - 1] + forces[j, k + 1]
                          - forces[j, k + 2]) / 16
        for i in range(n):
            for k in range(steps):
                G[s, i, k] += (B[0, i, r, k] * forces[j, k] + B[1, i, r, k] * middle[k]
                               + B[2, i, r, k] * forces[j, k + 1])


@cached_jit()
def add_outputs(M: np.ndarray, G: np.ndarray, start: np.ndarray, C: np.ndarray, y: np.ndarray
                ) -> None:
    """Add C X (m, q, L) to y, for X beginning at `start` (m, n) and going on to M X + G.

    Args:
        M: (L-1, n, n).
        G: (m, n, L-1).
        start: (m, n).
        C: (L, q, n).
        y: (m, q, L).
    """
    m, n, steps = G.shape
    x, after = np.empty((n, TOGETHER)), np.empty((n, TOGETHER))
    seen = np.empty(TOGETHER)
    for first in range(0, m, TOGETHER):
        for i in range(n):
            for s in range(TOGETHER):
                x[i, s] = start[first + s, i]
        for k in range(steps + 1):
            for o in range(C.shape[1]):
                for s in range(TOGETHER):
                    seen[s] = 0.0
                for i in range(n):
                    c = C[k, o, i]
                    for s in range(TOGETHER):
                        seen[s] += c * x[i, s]
                for s in range(TOGETHER):
                    y[first + s, o, k] += seen[s]
            if k < steps:
                for i in range(n):
                    for s in range(TOGETHER):
                        after[i, s] = G[first + s, i, k]
                    for j in range(n):
                        factor = M[k, i, j]
                        for s in range(TOGETHER):
                            after[i, s] += factor * x[j, s]
                for i in range(n):
                    for s in range(TOGETHER):
                        x[i, s] = after[i, s]
