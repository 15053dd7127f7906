"""Where a patch with texture is in every picture, at sub-pixel accuracy, and how sure that is.

Normalised correlation finds the whole pixel.  Around it the picture is a gain times the patch of
the first picture, plus an offset, plus the patch's gradient times what is left of the shift: linear
least squares, iterated (B. D. Lucas and T. Kanade, IJCAI 1981; the patch's gradient instead of the
picture's: S. Baker and I. Matthews, Int. J. Comput. Vis. 56, 2004).  What noise does to that shift
is what the residual says of its spectrum: for white noise the Cramér-Rao bound, and blur and
compression, by which neighbouring pixels err alike, are counted too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from pikanid import errors
from pikanid.tracking.colours import Picture
from pikanid.tracking.region import Region
from pikanid.tracking.settings import TrackingSettings

Array = NDArray[np.float64]
Side = Literal["tank", "background"]
LEAST = 12  # limit: pixels of a patch's side, below which it has no texture to speak of
PAD = 8  # numerical: pixels around a patch, at whose rim blur and spline are not exact
BLUR = 1.0  # numerical: [px], beyond which interpolation of an undersampled edge errs little
REACH = 16  # numerical: pixels around the expected place; twice that after each picture without it
BACK = 8  # numerical: pictures looked back upon; after so many without it, it may be anywhere
ROUNDS = 20  # numerical: of least squares, which mostly takes four
SETTLED = 1e-4  # numerical: pixels that a round may still move it
FAR = 1.5  # numerical: pixels from the whole one, beyond which least squares went astray
BLOCKS = 4  # numerical: of a patch along either side; one that is unlike all others is covered
SLACK = 0.25  # numerical: pixels of blur or warp that are no cover
TWIN = 0.9  # numerical: of the best likeness, that another place may not have


@dataclass(frozen=True)
class Place:
    """How far a patch has moved since the first picture.

    Attributes:
        x, y: To the right and down [px]; NaN if it was not found.
        sx, sy: Standard errors of a single picture [px].
        reason: Why it was not found; empty if it was.
    """

    x: float = np.nan
    y: float = np.nan
    sx: float = np.nan
    sy: float = np.nan
    reason: str = ""


@dataclass(frozen=True, eq=False)
class Marker:
    """A patch that is followed.

    Attributes:
        area: Where it is in the first picture.
        first: That picture around it (H + 2 PAD, W + 2 PAD), grey.
        on: What it is fixed to: the tank that moves before a standing camera, or the background of
            a camera that moves with the tank.
        settings: What counts as the patch.
    """

    area: Region
    first: NDArray[np.float32]
    on: Side
    settings: TrackingSettings

    def find(self, picture: Picture, before: Sequence[Place] = ()) -> Place:
        """Its place in a picture (H, W, 3), BGR, by those in the pictures before (the last BACK of
        them count): it goes on as fast as it went.
        """
        left, top, likeness = self._whole_pixel(picture, before)
        if not likeness:
            return Place(reason="the marker is not in sight, or not alone")
        shift, gain, left_over, alike = self._refined(_grey(picture, Region(
            left, top, self.area.width, self.area.height)))
        if shift is None or alike < self.settings.alike or self._covered(gain, left_over):
            return Place(reason="the marker is covered, or unlike its first picture")
        # the residual has the noise of two pictures; that of the first one moves all alike
        noise = np.abs(np.fft.rfft2(left_over)) ** 2 / 2
        sx, sy = np.sqrt(np.sum(self._gains * noise, axis=(1, 2))) / gain / left_over.size
        if max(sx, sy) > self.settings.vague:
            return Place(reason="the marker is too blurred to tell its place")
        return Place(float(left - self.area.left + shift[0]), float(top - self.area.top + shift[1]),
                     float(sx), float(sy))

    def _whole_pixel(self, picture: Picture, before: Sequence[Place]) -> tuple[int, int, float]:
        """Left, top and likeness of the place most like it; likeness 0 where none is, or two are.
        """
        import cv2

        height, width = picture.shape[:2]
        at, reach = _expected(before[-BACK:], max(height, width))
        x, y = self.area.left + at[0], self.area.top + at[1]
        left, right = max(x - reach, 0), min(x + reach + self.area.width, width)
        top, bottom = max(y - reach, 0), min(y + reach + self.area.height, height)
        if right - left < self.area.width or bottom - top < self.area.height:
            return 0, 0, 0.0
        within = cv2.cvtColor(picture[top:bottom, left:right], cv2.COLOR_BGR2GRAY)
        inner = self.first[PAD:-PAD, PAD:-PAD]
        score = cv2.matchTemplate(within, inner.astype(np.uint8), cv2.TM_CCOEFF_NORMED)
        _, best, _, (column, row) = cv2.minMaxLoc(score)
        if not np.isfinite(best) or best < self.settings.alike / 2:
            return 0, 0, 0.0
        half = self.area.width // 2, self.area.height // 2
        score[max(row - half[1], 0):row + half[1] + 1,
              max(column - half[0], 0):column + half[0] + 1] = -1
        if score.max() > TWIN * best:
            return 0, 0, 0.0
        return left + column, top + row, float(best)

    def _refined(self, around: NDArray[np.float32]
                 ) -> tuple[tuple[float, float] | None, float, Array, float]:
        """Shift [px] from the whole pixel, gain, residual (H, W) and correlation with the patch."""
        from scipy.ndimage import spline_filter

        design, inverse = self._equations
        smooth = spline_filter(_smooth(around), 3, output=np.float64, mode="nearest")
        shift = np.zeros(2)
        for _ in range(ROUNDS):
            seen = _shifted(smooth, *shift)[PAD:-PAD, PAD:-PAD]
            found = inverse @ seen.ravel()
            gain = float(found[0])
            step = found[2:] / gain if gain > 0 else np.full(2, np.nan)
            shift -= step
            if not np.all(np.abs(shift) < FAR):
                return None, gain, seen, 0.0
            if np.max(np.abs(step)) < SETTLED:
                break
        left = seen - (design @ found).reshape(seen.shape)
        spread = float(np.var(seen))
        alike = 1 - float(np.mean(left**2)) / spread if spread > 0 else 0.0
        return (float(shift[0]), float(shift[1])), gain, left, float(np.sqrt(max(alike, 0.0)))

    def _covered(self, gain: float, left: Array) -> bool:
        """Whether a part of it is more unlike the patch than the rest, and than blur makes it."""
        apart = _blocks(left**2)
        allowed = np.median(apart) + (gain * SLACK) ** 2 * _blocks(self._slope[0]**2
                                                                   + self._slope[1]**2)
        return bool(np.max(apart / allowed) > self.settings.cover)

    @cached_property
    def _patch(self) -> Array:
        return _smooth(self.first)

    @cached_property
    def _slope(self) -> tuple[Array, Array]:
        """Gradient to the right and down (H, W) [grey levels per px]."""
        from scipy.ndimage import spline_filter

        smooth = spline_filter(self._patch, 3, output=np.float64, mode="nearest")
        # of the spline, as it is for the pictures: no bias by another derivative
        h = 1e-3  # numerical: [px]
        right, down = (
            (_shifted(smooth, x, y) - _shifted(smooth, -x, -y))[PAD:-PAD, PAD:-PAD] / (2 * h)
            for x, y in ((h, 0.0), (0.0, h)))
        return right, down

    @cached_property
    def _equations(self) -> tuple[Array, Array]:
        """Design matrix (pixels, 4) of patch, offset and slopes, and its pseudo-inverse."""
        inner = self._patch[PAD:-PAD, PAD:-PAD]
        design = np.column_stack([a.ravel() for a in (inner, np.ones_like(inner), *self._slope)])
        return design, np.asarray(np.linalg.pinv(design), float)

    @cached_property
    def _gains(self) -> Array:
        """(2, H, W // 2 + 1): share of the noise at each frequency that both shifts take."""
        height, width = self._slope[0].shape
        rows = self._equations[1][2:].reshape(2, height, width)
        gains = np.abs(np.fft.rfft2(rows)) ** 2
        gains[..., 1:(width + 1) // 2] *= 2  # those of negative frequency
        return np.asarray(gains)


def marker(area: Region, pictures: Sequence[Picture], on: Side, settings: TrackingSettings
           ) -> Marker:
    """A patch of the first of some pictures (H, W, 3), BGR.

    Raises:
        BadSetting: If it does not lie within the picture, is too small, or has no texture that can
            be recognised.
    """
    height, width = pictures[0].shape[:2]
    place = (area.left, area.top, area.width, area.height)
    if (min(area.left, area.top) < 0 or min(area.width, area.height) < LEAST
            or area.left + area.width > width or area.top + area.height > height):
        raise errors.BadSetting(errors.marker_outside(place, (height, width), LEAST))
    made = Marker(area, _grey(pictures[0], area), on, settings)
    x, y = (a.ravel() for a in made._slope)
    slopes = np.linalg.eigvalsh(np.array([[x @ x, x @ y], [x @ y, y @ y]]) / x.size)
    if slopes[0] < settings.texture**2 or made.find(pictures[0]).reason:
        raise errors.BadSetting(errors.marker_without_texture(place))
    return made


def _expected(before: Sequence[Place], whole: int) -> tuple[tuple[int, int], int]:
    """Where the patch should be (x, y) [px] from its first place, and how far to look around."""
    if not before:
        return (0, 0), REACH
    known = [k for k, p in enumerate(before) if not p.reason]
    if not known:
        return (0, 0), whole if len(before) >= BACK else REACH * 2**len(before)
    last, lost = before[known[-1]], len(before) - 1 - known[-1]
    steady = lost == 0 and known[-1] - 1 in known
    x, y = ((2 * getattr(last, c) - getattr(before[-2], c)) if steady else getattr(last, c)
            for c in "xy")
    return (round(x), round(y)), REACH * 2**lost


def _grey(picture: Picture, area: Region) -> NDArray[np.float32]:
    """An area of a picture and PAD pixels around it, grey; beyond its rim as at the rim."""
    import cv2

    height, width = picture.shape[:2]
    top, left = max(area.top - PAD, 0), max(area.left - PAD, 0)
    bottom = min(area.top + area.height + PAD, height)
    right = min(area.left + area.width + PAD, width)
    grey = cv2.cvtColor(picture[top:bottom, left:right], cv2.COLOR_BGR2GRAY).astype(np.float32)
    missing = ((top - area.top + PAD, area.top + area.height + PAD - bottom),
               (left - area.left + PAD, area.left + area.width + PAD - right))
    return np.pad(grey, missing, mode="edge")


def _smooth(grey: NDArray[np.float32]) -> Array:
    import cv2

    return np.asarray(cv2.GaussianBlur(grey, (0, 0), BLUR), float)


def _shifted(spline: Array, x: float, y: float) -> Array:
    """A picture at its pixels' places plus (x, y) [px], of its cubic spline's coefficients; exact
    but for a rim of four pixels.
    """
    for axis, shift in enumerate((y, x)):
        whole = int(np.floor(shift))
        t = shift - whole
        weights = ((1 - t) ** 3 / 6, (3 * t**3 - 6 * t**2 + 4) / 6,
                   (-3 * t**3 + 3 * t**2 + 3 * t + 1) / 6, t**3 / 6)
        spline = np.sum([w * np.roll(spline, 1 - whole - k, axis=axis)
                         for k, w in enumerate(weights)], axis=0)
    return np.asarray(spline)


def _blocks(values: Array) -> Array:
    """Means (BLOCKS, BLOCKS) over parts of a patch."""
    rows, columns = (np.arange(BLOCKS) * n // BLOCKS for n in values.shape)
    sums = np.add.reduceat(np.add.reduceat(values, rows, axis=0), columns, axis=1)
    counts: Any = np.outer(*(np.diff(np.append(edges, n)) for edges, n in
                             zip((rows, columns), values.shape, strict=True)))
    return np.asarray(sums / counts)
