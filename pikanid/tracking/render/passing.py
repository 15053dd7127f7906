"""What is in the way for some pictures only: something in front of the tank, and drops."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Colour = tuple[float, float, float]
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Cover:
    """Something in front of the tank, as a cable, a finger or an arm: a line with a thickness.

    Attributes:
        start, end: Of the line (x, y) [px], in the first picture that shows it.
        radius: Half its thickness [px].
        first, last: Pictures between which it is seen, both included, counted from 0.
        speed: By which it moves (x, y) [px per picture].
        colour: RGB from 0 to 255.
    """

    start: tuple[float, float]
    end: tuple[float, float]
    radius: float
    first: int = 0
    last: int = 0
    speed: tuple[float, float] = (0.0, 0.0)
    colour: Colour = (60.0, 50.0, 45.0)

    def share(self, x: Array, y: Array, number: int) -> Array:
        """Share of each pixel at (x, y) [px] that is covered in a picture.

        >>> cable = Cover((0, 5), (9, 5), 2.0, first=3, last=4)
        >>> [float(cable.share(np.array(4.0), np.array(5.0), k)) for k in (2, 3, 5)]
        [0.0, 1.0, 0.0]
        """
        shape = np.broadcast_shapes(x.shape, y.shape)
        if not self.first <= number <= self.last:
            return np.zeros(shape)
        gone = number - self.first
        ax, ay = (p + gone * v for p, v in zip(self.start, self.speed, strict=True))
        dx, dy = self.end[0] - self.start[0], self.end[1] - self.start[1]
        along = np.clip(((x - ax) * dx + (y - ay) * dy) / max(dx**2 + dy**2, 1e-12), 0, 1)
        away = np.hypot(x - ax - along * dx, y - ay - along * dy)
        return np.asarray(np.clip(self.radius - away + 0.5, 0, 1))


@dataclass(frozen=True)
class Splash:
    """Drops of the liquid that are thrown up and fall back.

    Attributes:
        x, y: Where they leave the surface [px].
        first, last: Pictures between which they are seen, both included, counted from 0.
        drops: How many.
        radius: Of the largest [px]; the smallest have a third of it.
        rise: Greatest speed upwards [px per picture]; to the sides they have half of it.
        fall: Acceleration downwards [px per picture²].
        seed: Of sizes and speeds.
    """

    x: float
    y: float
    first: int = 0
    last: int = 0
    drops: int = 30
    radius: float = 9.0
    rise: float = 9.0
    fall: float = 0.45
    seed: int = 0

    def share(self, x: Array, y: Array, number: int) -> Array:
        """Share of each pixel at (x, y) [px] that drops fill in a picture."""
        shape = np.broadcast_shapes(x.shape, y.shape)
        total = np.zeros(shape)
        if not self.first <= number <= self.last:
            return total
        rng, t = np.random.default_rng(self.seed), number - self.first
        sizes = self.radius * rng.uniform(1 / 3, 1, self.drops)
        sides = self.rise * rng.uniform(-1 / 2, 1 / 2, self.drops)
        rises = self.rise * rng.uniform(1 / 4, 1, self.drops)
        for size, side, rise in zip(sizes, sides, rises, strict=True):
            away = np.hypot(x - self.x - side * t, y - self.y + rise * t - self.fall * t**2 / 2)
            total = np.maximum(total, np.clip(size - away + 0.5, 0, 1))
        return total
