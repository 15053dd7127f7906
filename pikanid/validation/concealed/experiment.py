"""An experiment: what the shuttle was told to do, sample by sample."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pikanid.validation.concealed.arrays import Array

RATE = 100.0  # definition: [Hz] of every recording


@dataclass(frozen=True, eq=False)
class Experiment:
    """Recorded inputs on a uniform grid; compared and hashed by identity.

    Attributes:
        kind: Name of the excitation.
        t: (N,) [s].
        u_x: (N,) acceleration along x, which drives the nominal model [m/s²].
        u_y: (N,) acceleration along y [m/s²].
        pitch: (N,) inclination of the shuttle about y [rad].
        quiet: Length of the stretch at the start without any motion [s].
    """

    kind: str
    t: Array
    u_x: Array
    u_y: Array
    pitch: Array
    quiet: float

    @property
    def duration(self) -> float:
        """[s]."""
        return float(self.t[-1])


def grid(duration: float) -> Array:
    """(N,) times 0, 0.01, ... [s], each the double next to its decimal.

    >>> grid(0.03).tolist()
    [0.0, 0.01, 0.02, 0.03]
    """
    return np.arange(round(duration * RATE) + 1) / RATE
