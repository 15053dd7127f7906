"""A local fit from one evaluation to the end, compiled: `lmder` and a model's simulation in turns.

Compiled once and kept on disk, for all models, which is why this module is imported only where it
is used.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from pikanid.objective.shooting import REFUSED
from pikanid.objective.standardised import standardise
from pikanid.optimise.lmder import EVALUATE, LINEARISE, THETA, TRIAL, go_on
from pikanid.optimise.trust_region import product
from pikanid.simulation.native_call import call_integrate
from pikanid.storage.jit import cached_jit

_integrate: Any = call_integrate  # its definition has an argument more: the compiler's context


@cached_jit(error_model="numpy", _nrt=False, nogil=True)
def descend(address: int, before: Any, start: Any, p: np.ndarray, act: np.ndarray, own: np.ndarray,
            seen: Any, first: Any, simulated: Any, standardised: Any, measured: Any, work: Any
            ) -> tuple[int, int]:
    """From the starting point to where the fit ends; why, and which buffers are those of θ, or -1
    where it is the start, or not finite.

    Args:
        address, before, start, p, act, seen: Of the simulation and what it takes, see `integrate`.
        own: (A,) places of the active parameters in θ.
        first: Outputs (rows,) and sensitivities (rows, A) at the starting point.
        simulated: States (2, L, n) or (2, 0, n), outputs (2, rows), sensitivities (2, rows, A) and,
            in the same memory, (2, rows·A).
        standardised: Residuals (2, rows) and Jᵀ (2, A, rows).
        measured: Data (rows,) and 1/σ.
        work: Of `lmder.go_on`, from the table on, as `Descent` begins.
    """
    table, points, state, orders, triangles, spare = work
    best, new, r, columns = -1, 0, standardised[0][0], standardised[1][0]
    standardise(first[0], first[1], 0, own, measured[0], measured[1], r, columns)
    told = go_on(LINEARISE, r, columns, table, points, state, orders, triangles, spare)
    while told == EVALUATE:
        for a in range(act.size):
            p[act[a]] = points[TRIAL, own[a]]
        X, Y, J = simulated[0][new], simulated[1][new], simulated[2][new]
        r, columns = standardised[0][new], standardised[1][new]
        status = _integrate(address, (*before, *start, p, act, *seen, X, Y, J))
        if status < 0:
            return status, best
        # by their squares, as `Simulator.run` sees it
        flat = simulated[3][new]
        finite = status == 0 and product(Y, Y, 0) + product(flat, flat, 0) < np.inf
        if finite:
            standardise(Y, J, 0, own, measured[0], measured[1], r, columns)
        else:
            r[:] = REFUSED
            columns[:] = 0.0
        told = go_on(EVALUATE, r, columns, table, points, state, orders, triangles, spare)
        taken = told != EVALUATE
        for j in range(own.size):
            taken = taken and points[THETA, j] == points[TRIAL, j]
        if told == LINEARISE:
            told = go_on(LINEARISE, r, columns, table, points, state, orders, triangles, spare)
        if taken:
            best, new = (new if finite else -1), 1 - new
    return told, best
