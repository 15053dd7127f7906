"""A printed patch that can be recognised: waves of random directions, lengths and phases."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
WAVES = 24  # numerical: so many look like no pattern


@dataclass(frozen=True)
class Pattern:
    """A rectangle with a texture that is finer than none of a pixel: it can be moved exactly.

    Attributes:
        left, top, width, height: Of the rectangle [px], seen straight on.
        grey: Its mean [grey levels].
        contrast: Standard deviation of its texture [grey levels]; 0 is a blank sheet.
        shortest, longest: Of the waves [px].
        seed: Of the texture.
    """

    left: float
    top: float
    width: float = 40.0
    height: float = 40.0
    grey: float = 128.0
    contrast: float = 40.0
    shortest: float = 7.0
    longest: float = 25.0
    seed: int = 0

    def seen(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Share of pixels at (x, y) [px] that it fills, and its grey level there.

        >>> share, grey = Pattern(10, 10, contrast=0.0).seen(*np.array([[5.0, 20.0]] * 2))
        >>> share.tolist(), grey.tolist()
        ([0.0, 1.0], [128.0, 128.0])
        """
        across = np.clip(np.minimum(x - self.left, self.left + self.width - x) + 0.5, 0, 1)
        down = np.clip(np.minimum(y - self.top, self.top + self.height - y) + 0.5, 0, 1)
        share = across * down
        grey = np.full(np.shape(x), self.grey)
        there = share > 0
        rng = np.random.default_rng(self.seed)
        for _ in range(WAVES):
            turn, phase = rng.uniform(0, 2 * np.pi, 2)
            k = 2 * np.pi / rng.uniform(self.shortest, self.longest)
            along = np.cos(turn) * x[there] + np.sin(turn) * y[there]
            grey[there] += self.contrast * np.sqrt(2 / WAVES) * np.sin(k * along + phase)
        return share, np.clip(grey, 0, 255)
