"""Normal equations of whole families: evaluated and summed up in one compiled call each.

Rows that nothing else needs are never kept, which an iterate of a thousand of them notices.  The
module is imported only where it is used, as `banded_products` is.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from pikanid.optimise.banded_products import put_away
from pikanid.simulation.native_call import call_native
from pikanid.storage.jit import cached_jit

_compiled = cached_jit(error_model="numpy", nogil=True)
_call: Any = call_native  # its definition has an argument more: the compiler's context


@_compiled
def add_samples(weight: np.ndarray, target: np.ndarray, first: np.ndarray, local: np.ndarray,
                c: np.ndarray, at: int, starts: np.ndarray, columns: np.ndarray,
                right: np.ndarray) -> float:
    """Add Jᵀr of samples of a state to right (n,); their ‖r‖².

    r is weight (M, 1) times (Σ_a local[m, a] c[first[m] + a] - target (1, M)), local (M, width) the
    state's basis; the rest is as in `banded_products.add_products`.
    """
    cost, width = 0.0, local.shape[1]
    for g in range(columns.shape[0]):
        for m in range(starts[g], starts[g + 1]):
            value = 0.0
            for a in range(width):
                value += local[m, a] * c[first[m] + a]
            residual = weight[m, 0] * (value - target[0, m])
            cost += residual**2
            scaled = weight[m, 0] * residual
            for a in range(width):
                right[columns[g, at + a]] += scaled * local[m, a]
    return cost


@_compiled
def add_equations(code: np.ndarray, registers: np.ndarray, r: np.ndarray, d: np.ndarray,
                  t: np.ndarray, u: np.ndarray, p: np.ndarray, c: np.ndarray, first: np.ndarray,
                  local: np.ndarray, offset: np.ndarray, width: np.ndarray, weight: np.ndarray,
                  factor: np.ndarray, at: np.ndarray, starts: np.ndarray, columns: np.ndarray,
                  whole: np.ndarray, corner: np.ndarray) -> float:
    """Add VᵀV of the rows r = factor (E,) times weight (M, E) times (f - top) of a smooth model.

    f runs from machine code as in `native_field`, from t (M,), states that are local bases with
    coefficients c (n,), as in `approximators.tables.Bases`, inputs u (M, m) and parameters p (P,);
    `registers` (E,) hold it.  The rest is as in `banded_products.add_products`, tops included.
    """
    E, m, b, w = registers.size, u.shape[1], corner.shape[0] - 1, columns.shape[1]
    n, size, cost = at.size - E, w + b + 1, 0.0
    row, gram = np.empty(size), np.empty((size, size))
    for k in range(p.size):
        r[1 + n + m + k] = p[k]
    _call(code[0], r, d)
    _call(code[1], r, d)
    for g in range(columns.shape[0]):
        gram[:] = 0.0
        for q in range(starts[g], starts[g + 1]):
            r[0] = t[q]
            for k in range(n):
                place, total = offset[k] + q * width[k], 0.0
                for a in range(width[k]):
                    total += local[place + a] * c[first[k, q] + a]
                r[1 + k] = total
            for k in range(m):
                r[1 + n + k] = u[q, k]
            _call(code[2], r, d)
            _call(code[3], r, d)
            for e in range(E):
                scale, known = factor[e] * weight[q, e], registers[e]
                row[:] = 0.0
                for k in range(n):
                    slope = scale * d[known, b + k]
                    if slope != 0.0:
                        place = offset[k] + q * width[k]
                        for a in range(width[k]):
                            row[at[k] + a] += slope * local[place + a]
                place, top = offset[n + e] + q * width[n + e], 0.0
                for a in range(width[n + e]):
                    top += local[place + a] * c[first[n + e, q] + a]
                    row[at[n + e] + a] -= scale * local[place + a]
                for j in range(b):
                    row[w + j] = scale * d[known, j]
                row[size - 1] = scale * (r[known] - top)
                cost += row[size - 1] ** 2
                for i in range(size):
                    left = row[i]
                    for j in range(i + 1):
                        gram[i, j] += left * row[j]
        put_away(gram, columns, g, whole, corner)
    return cost
