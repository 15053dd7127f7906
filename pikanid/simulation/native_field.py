"""Right-hand side or outputs of a smooth model along many states, from its tape's machine code."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from pikanid.simulation.bound_tape import bound
from pikanid.simulation.native_call import call_native
from pikanid.simulation.native_tape import native_field
from pikanid.simulation.tape import GROUPS, Tape
from pikanid.storage.jit import cached_jit

_call: Any = call_native  # its definition has an argument more: the compiler's context


class NativeField:
    """Rows of f or h with their derivatives by the states and by the `free` parameters."""

    def __init__(self, program: Tape, name: Literal["f", "h"], rows: tuple[int, ...],
                 free: tuple[int, ...]):
        n, _, P, _, _ = program.sizes
        self.n, self.b = n, len(free)
        lanes = (*free, *(P + k for k in range(n)))
        self.code, self.kept = native_field(program, lanes, name)
        tape = bound(program, lanes, self.code)
        self.at = tape.out[GROUPS.index(name)][list(rows)]
        self.r, self.d = tape.r, tape.d
        self.d[1 + np.arange(n), self.b + np.arange(n)] = 1.0

    def __call__(self, t: np.ndarray, x: np.ndarray, u: np.ndarray, p: np.ndarray
                 ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Values (M, E), ∂/∂x (M, E, n), ∂/∂p (M, E, b) at t (M,), x (M, n), u (M, m), p (P,)."""
        shape = (t.size, self.at.size)
        values = np.empty(shape)
        jx, jp = np.empty((*shape, self.n)), np.empty((*shape, self.b))
        # registers of its own for every call: threads may share the field
        t, x, u, p = map(np.ascontiguousarray, (t, x.T, u, p))
        _along(self.code, self.at, self.r.copy(), self.d.copy(), t, x, u, p, values, jx, jp)
        return values, jx, jp


@cached_jit(error_model="numpy", nogil=True)
def _along(code: np.ndarray, at: np.ndarray, r: np.ndarray, d: np.ndarray, t: np.ndarray,
           x: np.ndarray, u: np.ndarray, p: np.ndarray, values: np.ndarray, jx: np.ndarray,
           jp: np.ndarray) -> None:
    """Fill values, jx and jp; x is (n, M), `at` the registers of the results."""
    n, m, b = x.shape[0], u.shape[1], jp.shape[2]
    for k in range(p.size):
        r[1 + n + m + k] = p[k]
    _call(code[0], r, d)
    _call(code[1], r, d)
    for q in range(t.size):
        r[0] = t[q]
        for k in range(n):
            r[1 + k] = x[k, q]
        for k in range(m):
            r[1 + n + k] = u[q, k]
        _call(code[2], r, d)
        _call(code[3], r, d)
        for e in range(at.size):
            values[q, e] = r[at[e]]
            for k in range(b):
                jp[q, e, k] = d[at[e], k]
            for k in range(n):
                jx[q, e, k] = d[at[e], b + k]
