"""Pictures of a tilted surface of dyed liquid, drawn to the truth; knows nothing of the tracker."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter


def picture(theta: float, size: tuple[int, int] = (160, 200), blur: float = 0.8,
            noise: float = 3.0, seed: int = 0, level: float | None = None,
            dye: tuple[float, float, float] = (190.0, 60.0, 50.0),
            air: tuple[float, float, float] = (215.0, 215.0, 205.0)) -> NDArray[np.uint8]:
    """One picture, (H, W, 3) RGB, of a surface that rises to the right by `theta` [rad].

    A pixel is liquid by the share of its area below the line y(x) = level - tan(theta)·(x - W/2).

    Args:
        theta: Angle of the surface [rad].
        size: H, W [px].
        blur: Standard deviation of the optics' Gaussian blur [px].
        noise: Standard deviation of the sensor's noise [grey levels].
        seed: Of the noise.
        level: Row of the surface at the middle [px]; half the height if None.
        dye: Colour of the liquid.
        air: Colour above it.

    >>> picture(0.1, (40, 60)).shape
    (40, 60, 3)
    """
    height, width = size
    parts = 8
    x = (np.arange(width * parts) + 0.5) / parts - width / 2
    surface = (height / 2 if level is None else level) - np.tan(theta) * x
    share = np.clip(np.arange(1, height + 1)[:, None] - surface, 0.0, 1.0)
    liquid = share.reshape(height, width, parts).mean(axis=2)
    liquid = gaussian_filter(liquid, blur)[..., None]
    colours = liquid * np.asarray(dye) + (1 - liquid) * np.asarray(air)
    colours += noise * np.random.default_rng(seed).standard_normal(colours.shape)
    return np.clip(np.rint(colours), 0, 255).astype(np.uint8)
