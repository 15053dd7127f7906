"""Pictures of a tilted surface by counting: every pixel is 8 x 8 points, liquid or air.

It shares nothing with `pikanid.tracking.render`, against which and the tracker it is a witness.
"""

from __future__ import annotations

import math

import numpy as np

FINE = 8


def crude_picture(degrees: float, seed: int, height: int = 200, width: int = 240,
                  noise: float = 4.0, dark: bool = False) -> np.ndarray:
    """(height, width, 3) BGR: the liquid is green, or dark grey, and rises to the right."""
    rows, columns = np.indices((height * FINE, width * FINE))
    x = (columns + 0.5) / FINE - width / 2
    y = (rows + 0.5) / FINE - 0.55 * height
    wet = y > -math.tan(math.radians(degrees)) * x
    share = np.add.reduceat(np.add.reduceat(wet.astype(float), range(0, height * FINE, FINE), 0),
                            range(0, width * FINE, FINE), 1) / FINE**2
    liquid, air = ((60.0, 60.0, 60.0) if dark else (70.0, 150.0, 60.0)), (210.0, 200.0, 190.0)
    shown = np.stack([share * a + (1 - share) * b for a, b in zip(liquid, air, strict=True)], 2)
    shown = shown + np.random.default_rng(seed).normal(0, noise, shown.shape)
    return np.clip(shown.round(), 0, 255).astype(np.uint8)
