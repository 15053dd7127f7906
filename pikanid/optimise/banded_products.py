"""Compiled sums for the normal equations of local bases.

Compiled once and kept on disk, which is why this module is imported only where it is used.
"""

from __future__ import annotations

import numpy as np

from pikanid.storage.jit import cached_jit, inner_jit

_compiled = cached_jit(error_model="numpy", nogil=True)


@inner_jit(error_model="numpy")
def put_away(gram: np.ndarray, columns: np.ndarray, g: int, whole: np.ndarray, corner: np.ndarray
             ) -> None:
    """Add the products (lower triangle of gram) of stretch g's rows where they belong, see
    `add_products`.
    """
    w, size, kd = columns.shape[1], gram.shape[0], whole.shape[1] - corner.shape[0] - 1
    for i in range(w):
        one = columns[g, i]
        for j in range(i + 1):
            other = columns[g, j]
            whole[min(one, other), abs(one - other)] += gram[i, j]
        for k in range(w, size):
            whole[one, kd + 1 + k - w] += gram[k, i]
    for k in range(w, size):
        for j in range(w, size):
            corner[k - w, j - w] += gram[max(k, j), min(k, j)]


@_compiled
def add_products(weight: np.ndarray, factor: np.ndarray, value: np.ndarray, target: np.ndarray,
                 by_state: np.ndarray, by_theta: np.ndarray, topped: bool, local: np.ndarray,
                 offset: np.ndarray, width: np.ndarray, at: np.ndarray, starts: np.ndarray,
                 columns: np.ndarray, whole: np.ndarray, corner: np.ndarray) -> float:
    """Add VᵀV of a family's rows V = [∂r/∂local coefficients | ∂r/∂θ | r]; its ‖r‖².

    r is factor (E,) times weight (M, E) times (value (M, E) - target (E, M)); by_state (M, E, n)
    and by_theta (M, E, b) are slopes of the value, empty ones zero; if `topped`, target e is the
    top of chain e.  Table k, states before tops, has its basis (M, width[k])
    in local from offset[k] on, and its place among the w coefficients columns[g] (G, w) of stretch
    g, rows starts[g] to starts[g + 1], from at[k] on.  Products of the coefficients with each other
    go to the band, with the others behind it: whole (n, kd + 1 + b + 1); those of the others to
    corner (b + 1, b + 1).
    """
    w, states = columns.shape[1], by_state.shape[2]
    size, cost = w + corner.shape[0], 0.0
    row, gram = np.zeros(size), np.empty((size, size))
    for g in range(columns.shape[0]):
        gram[:] = 0.0
        for m in range(starts[g], starts[g + 1]):
            for e in range(value.shape[1]):
                row[:w] = 0.0
                scale = factor[e] * weight[m, e]
                for s in range(states):
                    slope = scale * by_state[m, e, s]
                    if slope != 0.0:  # an output mostly shows one state only
                        for a in range(width[s]):
                            row[at[s] + a] += slope * local[offset[s] + m * width[s] + a]
                if topped:
                    k = at.size - value.shape[1] + e
                    for a in range(width[k]):
                        row[at[k] + a] -= scale * local[offset[k] + m * width[k] + a]
                for j in range(by_theta.shape[2]):
                    row[w + j] = scale * by_theta[m, e, j]
                row[size - 1] = scale * (value[m, e] - target[e, m])
                cost += row[size - 1] ** 2
                for i in range(size):
                    left = row[i]
                    for j in range(i + 1):
                        gram[i, j] += left * row[j]
        put_away(gram, columns, g, whole, corner)
    return cost


@_compiled
def add_up(groups: np.ndarray, ratio: float, out: np.ndarray) -> None:
    """Fill out (n, k) with the sum of all groups (G, n, k), the second one times a ratio."""
    for m in range(out.shape[0]):
        for k in range(out.shape[1]):
            out[m, k] = ratio * groups[1, m, k] + groups[0, m, k]
            for g in range(2, groups.shape[0]):
                out[m, k] += groups[g, m, k]


@_compiled
def carry(weight: np.ndarray, factor: np.ndarray, by_state: np.ndarray, by_theta: np.ndarray,
          topped: bool, first: np.ndarray, local: np.ndarray, offset: np.ndarray,
          width: np.ndarray, follow: np.ndarray, out: np.ndarray) -> None:
    """Fill out (E, M, b): derivatives of a family's residuals by θ, the coefficients following.

    follow (n, b) is how they do, table k's functions at m being those from first[k, m] on; the rest
    is as in `add_products`.
    """
    states, b = by_state.shape[2], out.shape[2]
    for e in range(out.shape[0]):
        for m in range(out.shape[1]):
            scale = factor[e] * weight[m, e]
            for j in range(b):
                out[e, m, j] = scale * by_theta[m, e, j] if by_theta.size > 0 else 0.0
            for k in range(first.shape[0]):
                if k < states:
                    slope = scale * by_state[m, e, k]
                else:
                    slope = -scale if topped and k == first.shape[0] - out.shape[0] + e else 0.0
                if slope != 0.0:
                    for a in range(width[k]):
                        share = slope * local[offset[k] + m * width[k] + a]
                        for j in range(b):
                            out[e, m, j] += share * follow[first[k, m] + a, j]


@_compiled
def add_product(band: np.ndarray, columns: np.ndarray, out: np.ndarray) -> None:
    """Add A times columns (n, q) to out (n, q), band (n, kd + 1) as in `factor_in_place`."""
    n, count = columns.shape
    for j in range(n):
        for c in range(count):
            out[j, c] += band[j, 0] * columns[j, c]
        for k in range(1, min(band.shape[1], n - j)):
            for c in range(count):
                out[j, c] += band[j, k] * columns[j + k, c]
                out[j + k, c] += band[j, k] * columns[j, c]
