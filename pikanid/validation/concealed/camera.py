"""The surface of the liquid as a camera sees it from the side, and its angle by a line fit.

Looking along y, the camera sees dyed liquid up to the highest point of each line of sight: the
silhouette max_y η(x, y).  The angle is that of the least-squares line through the silhouette over
the visible width; it is positive where the liquid rises on the side that the tank pushes with,
as the pendulum's angle under a positive acceleration.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from pikanid.validation.concealed.arrays import Array
from pikanid.validation.concealed.tank import MODES, Tank, shape

VISIBLE = 0.9  # definition: of the radius: the rim of the glass hides the rest
COLUMNS, DEPTHS = 37, 9  # definition: sampling points of the picture


def silhouette(tank: Tank, states: Array) -> tuple[Array, Array]:
    """Places x (K,) across the tank [m] and the visible elevations (M, K) there [m].

    Args:
        tank: The tank.
        states: (M, 10) amplitudes and velocities of its modes.
    """
    basis = _basis()
    amplitudes = states[:, 0::2]
    highest = np.full((len(states), COLUMNS), -np.inf)
    for j in range(DEPTHS):
        # A sum in fixed order gives the same bits with any number of threads.
        seen = sum(amplitudes[:, n, None] * basis[n, :, j] for n in range(len(MODES)))
        np.maximum(highest, seen, out=highest)
    return _places() * tank.radius, highest


def surface_angle(tank: Tank, states: Array) -> Array:
    """(M,) angle of the line fitted to the silhouette [rad].

    >>> tilted = Tank(0.033, 0.09, tilt=0.1)
    >>> 0.09 < float(surface_angle(tilted, tilted.rest()[None])[0]) < 0.11
    True
    """
    x, highest = silhouette(tank, states)
    slope = np.sum(highest * x, axis=1) / np.sum(x * x)
    return -np.arctan(slope)


@lru_cache(maxsize=1)
def _places() -> Array:
    return np.linspace(-VISIBLE, VISIBLE, COLUMNS)


@lru_cache(maxsize=1)
def _basis() -> Array:
    """(5, COLUMNS, DEPTHS) ψ_n over one half of the surface; the other half looks the same."""
    values = np.empty((len(MODES), COLUMNS, DEPTHS))
    for i, x in enumerate(_places()):
        for j, share in enumerate(np.linspace(0.0, 1.0, DEPTHS)):
            y = share * math.sqrt(1.0 - x * x)
            r, phi = math.hypot(x, y), math.atan2(y, x)
            for n, (order, number) in enumerate(MODES):
                values[n, i, j] = shape(order, number, r) * math.cos(order * phi)
    return values
