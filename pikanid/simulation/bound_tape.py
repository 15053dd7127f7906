"""How a tape's machine code travels to the compiled integrators, with its registers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from pikanid.simulation.tape import GROUPS, Tape


class BoundTape(NamedTuple):
    """One tape with registers for so many derivatives.

    `code` holds the addresses of `native_tape.FUNCTIONS`, `out` (groups, results) the registers of
    results; values `r` (R,), derivatives `d` (R, lanes) and `ds` (R, switches) by the signs, zero
    where nothing is written; `matrix`, `again`, `right` and `change` are scratch for signs that are
    held at zero; `sizes` states, inputs, parameters, outputs, switching functions.  `flag` holds
    (0, 1): a constant in a call would have the callee compiled for it.
    """

    code: np.ndarray
    out: np.ndarray
    r: np.ndarray
    d: np.ndarray
    ds: np.ndarray
    sizes: np.ndarray
    flag: np.ndarray
    matrix: np.ndarray
    again: np.ndarray
    right: np.ndarray
    change: np.ndarray


def bound(tape: Tape, active: Sequence[int], code: np.ndarray) -> BoundTape:
    """A tape with registers for derivatives by the `active` parameters and initial states."""
    n, m, P, _, K = tape.sizes
    R, lanes, first = tape.registers, len(active), 1 + n + m
    results = [tape.outputs.get(g, np.empty(0, np.int64)) for g in GROUPS]
    out = np.zeros((len(GROUPS), max(map(len, results))), np.int64)
    for k, found in enumerate(results):
        out[k, :len(found)] = found
    r, d, ds = np.zeros(R), np.zeros((R, lanes)), np.zeros((R, K))
    places, numbers = tape.constants
    r[places] = numbers
    for lane, a in enumerate(active):
        if a < P:
            d[first + a, lane] = 1.0
    ds[first + P + np.arange(K), np.arange(K)] = 1.0
    return BoundTape(
        code, out, r, d, ds, np.array(tape.sizes, np.int64), np.array([0, 1]),
        np.zeros((K, K)), np.zeros((K, K)), np.zeros((K, 1)), np.zeros((K, lanes)))
