"""Draws a scene: exact shares of area below the surface, then light, optics and sensor."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pikanid import errors
from pikanid.tracking.render.passing import Array
from pikanid.tracking.render.pattern import Pattern
from pikanid.tracking.render.scene import Scene

PARTS = 4  # numerical: strips of a pixel's width whose share below the surface is exact
PAD = 4  # numerical: standard deviations of the blur that reach around the tank
DRAWN = 8  # numerical: pictures' worth of noise; which of it a picture gets is drawn
Picture = NDArray[np.uint8]


class Stage:
    """A scene with everything that stays the same from picture to picture drawn already.

    Args:
        scene: What is shown.

    >>> stage = Stage(Scene(size=(60, 80), tank=(20, 5, 40, 50)))
    >>> stage.picture(0.1).shape
    (60, 80, 3)
    """

    def __init__(self, scene: Scene):
        self.scene = scene
        self._drawn: NDArray[np.float32] | None = None
        corners = scene.corners
        pad = scene.thickness + int(np.ceil(PAD * scene.blur)) + 1
        height, width = scene.size
        low = np.maximum(np.floor(corners.min(axis=0)).astype(int) - pad, 0)
        high = np.minimum(np.ceil(corners.max(axis=0)).astype(int) + pad, (width, height))
        self.box = (slice(low[1], high[1]), slice(low[0], high[0]))
        across = low[0] + (np.arange((high[0] - low[0]) * PARTS) + 0.5) / PARTS - 0.5
        down = np.arange(low[1], high[1], dtype=float)
        self.x, self.z, self.scale = (a.astype(np.float32) for a in self._plane(across, down))
        self.inside = self._inside().astype(np.float32)
        self.whole = self._whole(self.inside)
        self.depths = self.z.max(axis=1), self.z.min(axis=1)
        light = self.light = self._light().astype(np.float32)
        above = np.asarray(scene.outside) * np.ones((height, width, 1))
        above[self.box] += self._wall()[..., None] * (
            np.asarray(scene.wall) - np.asarray(scene.outside))
        above[self.box] += self._whole(self.inside)[..., None] * (
            np.asarray(scene.air) - above[self.box])
        if scene.pattern is not None:
            self._print(scene.pattern, above)
        self.above = self._blurred(above * light + self._glare()).astype(np.float32)
        difference = (np.asarray(scene.dye) - np.asarray(scene.air)) * light[self.box]
        self.difference = difference.astype(np.float32)

    def at(self, x: float, y: float) -> Stage:
        """The same when the tank has gone so far [px]; noise goes on."""
        after = Stage(self.scene.at(x, y))
        after._drawn = self._drawn
        return after

    def surface(self, theta: float) -> Array:
        """Heights (2,) [px] at both walls of a flat surface that rises to the right."""
        half = np.tan(theta) * self.scene.tank[2] / 2
        return np.array([-half, half])

    def picture(self, surface: float | ArrayLike, rng: np.random.Generator | None = None,
                number: int = 0) -> Picture:
        """One picture (H, W, 3), RGB.

        Args:
            surface: Angle [rad] of a flat surface that rises to the right, or heights [px] above
                rest (n,) at even distances from wall to wall; (m, n) for m moments of an exposure,
                of which the picture is the mean.
            rng: Draws the sensor's noise; none if None.
            number: Of the picture, from 0: covers and splashes are seen in some.

        Raises:
            BadSetting: If heights are no numbers, or only one.
        """
        heights = np.asarray(surface, float)
        if heights.ndim == 0:
            heights = self.surface(float(heights))
        if heights.ndim > 2 or heights.shape[-1] < 2 or not np.all(np.isfinite(heights)):
            raise errors.BadSetting(errors.bad_surface(heights.shape))
        moments = np.atleast_2d(heights)
        share = np.mean([self._share(one) for one in moments], axis=0)
        across, down = (np.arange(n, dtype=float) for n in self.scene.size[::-1])
        down = down[:, None]
        for splash in self.scene.splashes:
            drops = splash.share(across[self.box[1]], down[self.box[0]], number)
            share = np.maximum(share, (drops * self.whole).astype(np.float32))
        shown = self.above.copy()
        shown[self.box] += self._blurred(self.difference * share[..., None])
        for cover in self.scene.covers:
            hidden = self._blurred(cover.share(across, down, number).astype(np.float32))[..., None]
            shown += hidden * (np.asarray(cover.colour, np.float32) * self.light - shown)
        if rng is not None and self.scene.noise:
            shown += self._noise(rng)
        shown += 0.5  # to the nearest grey level
        return np.asarray(np.clip(shown, 0, 255.5, out=shown).astype(np.uint8))

    def _plane(self, across: Array, down: Array) -> tuple[Array, Array, Array]:
        """Where on the tank's plane points of the picture lie, from the left wall and above rest
        [px], and how many rows one of these is there.
        """
        scene = self.scene
        h = np.linalg.inv(scene.homography)

        def at(rows: Array) -> tuple[Array, Array]:
            depth = h[2, 0] * across + h[2, 1] * rows[:, None] + h[2, 2]
            x = (h[0, 0] * across + h[0, 1] * rows[:, None] + h[0, 2]) / depth
            y = (h[1, 0] * across + h[1, 1] * rows[:, None] + h[1, 2]) / depth
            return x - scene.place[0], scene.waterline - y

        x, z = at(down)
        scale = 1 / (at(down - 0.5)[1] - at(down + 0.5)[1])
        return x, z, scale

    def _share(self, heights: Array) -> NDArray[np.float32]:
        """Share of liquid in every pixel of the box."""
        width = self.scene.tank[2]
        climb, reach = self.scene.meniscus
        x = np.linspace(0, width, max(4 * width, len(heights)))
        line = np.interp(x, np.linspace(0, width, len(heights)), heights)
        line += climb * (np.exp(-x / reach) + np.exp(-(width - x) / reach))
        # rows that lie under the surface everywhere, and those that it crosses somewhere
        under = self.depths[0] < line.min() - 1
        crossed = ~under & (self.depths[1] < line.max() + 1)
        share = np.where(under[:, None], self.whole, 0).astype(np.float32)
        above = np.interp(self.x[crossed], x, line) - self.z[crossed]
        strips = np.clip(above * self.scale[crossed] + 0.5, 0, 1) * self.inside[crossed]
        share[crossed] = self._whole(strips)
        return share

    def _noise(self, rng: np.random.Generator) -> NDArray[np.float32]:
        """Noise of one picture: a stretch of a long row of numbers, which begins anywhere."""
        if self._drawn is None:
            self._drawn = rng.standard_normal(DRAWN * self.above.size, dtype=np.float32)
            self._drawn *= self.scene.noise
        first = int(rng.integers(self._drawn.size - self.above.size))
        return self._drawn[first:first + self.above.size].reshape(self.above.shape)

    def _inside(self) -> Array:
        _, _, width, height = self.scene.tank
        floor = -self.scene.level * height
        across = np.clip(np.minimum(self.x, width - self.x) * PARTS + 0.5, 0, 1)
        down = np.clip(np.minimum(self.z - floor, floor + height - self.z) + 0.5, 0, 1)
        return np.asarray(across * down)

    def _wall(self) -> Array:
        _, _, width, height = self.scene.tank
        t, floor = self.scene.thickness, -self.scene.level * height
        outer = ((self.x > -t) & (self.x < width + t) & (self.z > floor - t)
                 & (self.z < floor + height))
        return self._whole(outer.astype(float))

    def _print(self, pattern: Pattern, picture: Array) -> None:
        """Draw a patch into a picture (H, W, 3)."""
        right, down = (np.array([near, near + size]) + gone for near, size, gone in (
            (pattern.left, pattern.width, self.scene.shift[0]),
            (pattern.top, pattern.height, self.scene.shift[1])))
        corners = self.scene.seen(np.array([(x, y) for x in right for y in down]))
        low = np.maximum(np.floor(corners.min(axis=0)).astype(int) - 1, 0)
        high = np.maximum(np.ceil(corners.max(axis=0)).astype(int) + 2, 0)
        part = picture[low[1]:high[1], low[0]:high[0]]
        y, x = (a + first for a, first in zip(np.indices(part.shape[:2], float), low[::-1],
                                              strict=True))
        at = np.stack([x, y, np.ones_like(x)], axis=-1) @ np.linalg.inv(self.scene.homography).T
        share, grey = pattern.seen(at[..., 0] / at[..., 2] - self.scene.shift[0],
                                   at[..., 1] / at[..., 2] - self.scene.shift[1])
        part += share[..., None] * (grey[..., None] - part)

    def _whole(self, fine: NDArray[Any]) -> NDArray[Any]:
        rows, columns = fine.shape
        return np.asarray(fine.reshape(rows, columns // PARTS, PARTS).mean(axis=2))

    def _light(self) -> Array:
        height, width = self.scene.size
        right, down = self.scene.light
        x = 2 * (np.arange(width) + 0.5) / width - 1
        y = 2 * (np.arange(height) + 0.5) / height - 1
        return np.maximum(1 + right * x + down * y[:, None], 0)[..., None]

    def _glare(self) -> Array:
        height, width = self.scene.size
        y, x = np.mgrid[:height, :width]
        total = np.zeros((height, width))
        for spot in self.scene.glare:
            total += spot.strength * np.exp(-0.5 * (((x - spot.x) / spot.width) ** 2
                                                    + ((y - spot.y) / spot.height) ** 2))
        return total[..., None]

    def _blurred(self, shown: NDArray) -> NDArray:
        if not self.scene.blur:
            return shown
        try:
            import cv2
        except ImportError:
            raise errors.BadSetting(errors.not_installed("A renderer", "cv2", "video")) from None
        reach = int(np.ceil(PAD * self.scene.blur))
        return np.asarray(cv2.GaussianBlur(shown, (2 * reach + 1,) * 2, self.scene.blur,
                                           borderType=cv2.BORDER_REPLICATE))


def picture(surface: float | ArrayLike, scene: Scene | None = None, seed: int = 0) -> Picture:
    """One picture (H, W, 3), RGB: see `Stage.picture`.

    >>> picture(0.1, Scene(size=(60, 80), tank=(20, 5, 40, 50))).dtype
    dtype('uint8')
    """
    return Stage(scene or Scene()).picture(surface, np.random.default_rng(seed))
