"""How a tape travels to the compiled interpreter, with its registers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pikanid.simulation.tape import GROUPS, Tape

NOTHING = np.zeros((5, len(GROUPS)), np.int64)  # native: all is interpreted


class BoundTape(NamedTuple):
    """One tape with registers for so many derivatives.

    `code` (ops, 4) of all groups, `span` (groups, 3) first and last operation and number of results
    of each, `out` (groups, results) their registers; values `r` (R,), derivatives `d` (R, lanes)
    and `ds` (R, switches) by the signs, which of them are not all zero (`live`, `signed`);
    `native` (5, groups) holds addresses of machine code, zero where there is none;
    `matrix`, `again`, `right` and `change` are scratch for signs that are held at zero;
    `sizes` states, inputs, parameters, outputs, switching functions.  `group` and `flag` hold the
    numbers of the groups and (0, 1): a constant in a call would have the callee compiled for it.
    """

    code: np.ndarray
    span: np.ndarray
    out: np.ndarray
    r: np.ndarray
    d: np.ndarray
    ds: np.ndarray
    live: np.ndarray
    signed: np.ndarray
    sizes: np.ndarray
    group: np.ndarray
    flag: np.ndarray
    native: np.ndarray
    matrix: np.ndarray
    again: np.ndarray
    right: np.ndarray
    change: np.ndarray


def bound(tape: Tape, lanes: int, code: np.ndarray = NOTHING) -> BoundTape:
    """A tape with registers for `lanes` derivatives; `code` as in `native_tape.Native`."""
    R, K = tape.registers, tape.sizes[4]
    ends = np.cumsum([0, *(len(tape.code[g]) for g in GROUPS)])
    results = [tape.outputs.get(g, np.empty(0, np.int64)) for g in GROUPS]
    out = np.zeros((len(GROUPS), max(map(len, results))), np.int64)
    for k, found in enumerate(results):
        out[k, :len(found)] = found
    span = np.array([[a, b, len(f)] for a, b, f in zip(ends[:-1], ends[1:], results, strict=True)])
    r = np.zeros(R)
    places, numbers = tape.constants
    r[places] = numbers
    return BoundTape(
        np.concatenate([tape.code[g] for g in GROUPS]), span.astype(np.int64), out, r,
        np.zeros((R, lanes)), np.zeros((R, K)), np.zeros(R, np.bool_), np.zeros(R, np.bool_),
        np.array(tape.sizes, np.int64), np.arange(len(GROUPS)), np.array([0, 1]), code,
        np.zeros((K, K)), np.zeros((K, K)), np.zeros((K, 1)), np.zeros((K, lanes)))
