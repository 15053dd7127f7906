"""How arrays travel between Python and the compiled kernels."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

STEEP = 1e-6  # numerical: where n < 1, the slope of bⁿ below this b counts as zero


class Seen(NamedTuple):
    """Which observations belong to which stop: those at stop i are first[i] ... first[i+1]-1."""

    first: np.ndarray
    output: np.ndarray
    row: np.ndarray
    inside: np.ndarray


class Stages(NamedTuple):
    """Scratch for a step of a tape: slopes kx (stages, n) and kS (stages, n, A), and the states x
    (n,) and S (n, A) of a stage.
    """

    kx: np.ndarray
    kS: np.ndarray
    x: np.ndarray
    S: np.ndarray


class Newton(NamedTuple):
    """As `Stages`, for an implicit step: where a stage starts (n,), derivatives dx (registers, n)
    by the states, `slide` (switches, n) of signs by them, and the linear equations of a stage.
    """

    kx: np.ndarray
    kS: np.ndarray
    x: np.ndarray
    S: np.ndarray
    start: np.ndarray
    dx: np.ndarray
    matrix: np.ndarray
    change: np.ndarray
    right: np.ndarray
    slide: np.ndarray


def work_dtype(n: int, m: int, P: int, q: int, k: int, stages: int, constants: int, rows: int,
               width: int) -> np.dtype:
    """One record of scratch for n states, m inputs, P parameters, q outputs and k switches.

    Kernels get it as one pointer: as a tuple of arrays each of its fields would travel as seven
    arguments through every call, and most of the time to compile a model went there.  There is room
    for sensitivities by every parameter and initial state; `act` says how many are in use.
    """
    A, big = P + n + 1, max(n, k)
    shapes: dict[str, tuple[int, ...]] = {
        "p": (P + constants,), "kx": (stages, n), "kS": (stages, A, n),
        **dict.fromkeys(("xt", "xn", "x", "f", "before", "after", "start"), (n,)),
        **dict.fromkeys(("St", "Sn", "S", "eye", "fx"), (A, n)),
        **dict.fromkeys(("u", "uc", "held", "slope"), (m,)),
        **dict.fromkeys(("ud", "still"), (m, A)),
        "y": (q,), "J": (q, A), "fp": (n, P + 1), "hp": (q, P + 1),
        "by": (stages, n * (n + m)), "stage_fp": (stages, n, P + 1),
        **dict.fromkeys(("gp", "rp"), (k, P + 1)),
        **dict.fromkeys(("s", "g", "ge", "Ge", "phi", "G"), (k,)),
        "Gs": (k, k), "Fs": (n, k), "Hs": (q, k),
        **dict.fromkeys(("gS", "GS", "ds"), (k, A)),
        "matrix": (big, big), "change": (big, 1), "right": (n, A), "bs": (rows, width)}
    integers = {"held_at_zero": k, "constant": n}
    return np.dtype(
        [(name, "f8", tuple(max(length, 1) for length in shape)) for name, shape in shapes.items()]
        + [(name, "i8", (max(length, 1),)) for name, length in integers.items()])
