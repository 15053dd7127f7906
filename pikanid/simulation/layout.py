"""How arrays travel between Python and the compiled kernels."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

STEEP = 1e-6  # where n < 1, the slope of bⁿ below this b counts as zero


class Seen(NamedTuple):
    """Which observations belong to which stop: those at stop i are first[i] ... first[i+1]-1."""

    first: np.ndarray
    output: np.ndarray
    row: np.ndarray
    inside: np.ndarray


class Work(NamedTuple):
    """Scratch arrays of one integration; the kernels themselves allocate nothing."""

    kx: np.ndarray
    kS: np.ndarray
    xt: np.ndarray
    St: np.ndarray
    xn: np.ndarray
    Sn: np.ndarray
    x: np.ndarray
    S: np.ndarray
    u: np.ndarray
    uc: np.ndarray
    held: np.ndarray
    slope: np.ndarray
    ud: np.ndarray
    f: np.ndarray
    before: np.ndarray
    after: np.ndarray
    start: np.ndarray
    y: np.ndarray
    J: np.ndarray
    fp: np.ndarray
    hp: np.ndarray
    gp: np.ndarray
    rp: np.ndarray
    s: np.ndarray
    g: np.ndarray
    ge: np.ndarray
    Ge: np.ndarray
    phi: np.ndarray
    G: np.ndarray
    Gs: np.ndarray
    Fs: np.ndarray
    Hs: np.ndarray
    gS: np.ndarray
    GS: np.ndarray
    ds: np.ndarray
    held_at_zero: np.ndarray
    eye: np.ndarray
    fx: np.ndarray
    matrix: np.ndarray
    change: np.ndarray
    right: np.ndarray
    still: np.ndarray
    constant: np.ndarray
    none: np.ndarray
    nud: np.ndarray
    nact: np.ndarray
    bs: np.ndarray
