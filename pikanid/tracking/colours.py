"""The colour of the liquid: a range that is given, or what the first pictures show."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pikanid import errors
from pikanid.tracking.settings import TrackingSettings

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]
ENOUGH = 10_000  # numerical: pixels of a picture that tell its colours
SPACES = {"hsv": (179, 255, 255), "lab": (255, 255, 255)}  # definition: as OpenCV stores 8 bits


@dataclass(frozen=True)
class ColourRange:
    """Pixels that count as liquid: every component between two bounds.

    Attributes:
        space: "hsv" (hue from 0 to 179) or "lab", in OpenCV's 8 bits.
        low, high: Bounds; a hue may run over its end, as from 170 to 10.
    """

    space: str
    low: tuple[int, int, int]
    high: tuple[int, int, int]

    @classmethod
    def parse(cls, text: str) -> ColourRange:
        """A range from a text.

        Raises:
            BadSetting: If it is none.

        >>> ColourRange.parse("hsv:95..130,80..255,40..255").low
        (95, 80, 40)
        """
        space, _, rest = text.strip().lower().partition(":")
        found = re.fullmatch(r"\s*,\s*".join([r"(\d+)\.\.(\d+)"] * 3), rest.strip())
        if space not in SPACES or found is None:
            raise errors.BadSetting(errors.bad_colour_range(text))
        numbers = [int(n) for n in found.groups()]
        low, high = tuple(numbers[::2]), tuple(numbers[1::2])
        tops = SPACES[space]
        around = 1 if space == "hsv" else 0  # a hue is a circle
        if any(n > tops[k // 2] for k, n in enumerate(numbers)) or any(
                a > b for a, b in zip(low[around:], high[around:], strict=True)):
            raise errors.BadSetting(errors.bad_colour_range(text))
        return cls(space, low, high)  # type: ignore[arg-type]  # three each, by the pattern

    def mask(self, picture: Picture) -> NDArray[np.bool_]:
        """(H, W): which pixels of a picture (H, W, 3), BGR, lie within."""
        import cv2

        codes = {"hsv": cv2.COLOR_BGR2HSV, "lab": cv2.COLOR_BGR2LAB}
        shown = cv2.cvtColor(picture, codes[self.space])
        inside = (shown >= np.asarray(self.low)) & (shown <= np.asarray(self.high))
        if self.low[0] > self.high[0]:
            inside[..., 0] = (shown[..., 0] >= self.low[0]) | (shown[..., 0] <= self.high[0])
        return np.asarray(inside.all(axis=-1))


@dataclass(frozen=True)
class Colours:
    """How much of a pixel is liquid: a linear function of its colour, 0 in air, 1 in the liquid.

    The direction is Fisher's discriminant, S⁻¹(dye - air) with the covariance S within both (Ann.
    Eugenics 7, 1936): along it light, reflections and noise that the first pictures show matter
    least.

    Attributes:
        air, dye: Typical colours (3,), BGR.
        weights: (3,), and
        offset: of the function weights·colour + offset.
        spread: Standard deviation of its values within air and within liquid.
    """

    air: tuple[float, ...]
    dye: tuple[float, ...]
    weights: tuple[float, ...]
    offset: float
    spread: float

    def share(self, picture: Picture) -> NDArray[np.float32]:
        """(H, W): share of liquid in every pixel of a picture (H, W, 3), BGR."""
        import cv2

        matrix = np.array([[*self.weights, self.offset]], np.float32)
        return np.asarray(cv2.transform(picture.astype(np.float32), matrix))

    def shares(self, pixels: NDArray[np.uint8]) -> NDArray[np.float32]:
        """(...): share of liquid in pixels (..., 3), BGR."""
        return np.asarray(pixels @ np.asarray(self.weights, np.float32) + np.float32(self.offset))


def learn(pictures: Sequence[Picture], settings: TrackingSettings,
          within: ColourRange | None = None) -> Colours:
    """The colours in pictures (H, W, 3), BGR, of air above liquid.

    Args:
        pictures: The first ones, cut to the inside of the tank.
        settings: How clearly both have to differ.
        within: What counts as liquid; two groups of colours, the one below the liquid's, if None.

    Raises:
        BadRecording: If there are no two colours, one above the other.
    """
    coarse = max(int(np.sqrt(pictures[0].shape[0] * pictures[0].shape[1] / ENOUGH)), 1)
    pictures = [p[::coarse, ::coarse] for p in pictures]
    stacked = [np.asarray(p, np.float32) for p in pictures]
    height = stacked[0].shape[0]
    strip = max(height // 10, 1)
    if within is None:
        air = np.median(np.concatenate([p[:strip].reshape(-1, 3) for p in stacked]), axis=0)
        dye = np.median(np.concatenate([p[-strip:].reshape(-1, 3) for p in stacked]), axis=0)
        for _ in range(5):  # numerical: of two means from a good start
            masks = [((p - (air + dye) / 2) @ (dye - air)) > 0 for p in stacked]
            groups = [np.concatenate([p[m if k else ~m] for p, m in zip(stacked, masks,
                                                                        strict=True)])
                      for k in (0, 1)]
            if min(map(len, groups)) < 3 * strip:
                raise errors.BadRecording(errors.one_colour())
            air, dye = (np.median(g, axis=0) for g in groups)
    else:
        masks = [within.mask(p) for p in pictures]
        groups = [np.concatenate([p[m if k else ~m] for p, m in zip(stacked, masks, strict=True)])
                  for k in (0, 1)]
        if min(map(len, groups)) < 3 * strip:
            raise errors.BadRecording(errors.one_colour())
        air, dye = (np.median(g, axis=0) for g in groups)
    return _discriminant(air.astype(float), dye.astype(float), groups, settings)


def _discriminant(air: Array, dye: Array, groups: list[NDArray[np.float32]],
                  settings: TrackingSettings) -> Colours:
    difference = dye - air
    inner = []
    for group, middle in zip(groups, (air, dye), strict=True):
        # the blend of both at the surface, and whatever is neither, is no variation within
        along = (group - middle) @ difference / (difference @ difference)
        inner.append((group - middle)[np.abs(along) < 1 / 4])
    within = sum(part.T @ part / max(len(part), 1) for part in inner) / 2
    # rounding to whole grey levels is the least
    weights = np.linalg.solve(within + np.eye(3) / 12, difference)
    contrast = float(weights @ difference)
    if not contrast > settings.contrast**2:
        raise errors.BadRecording(errors.one_colour())
    weights = weights / contrast
    return Colours(tuple(air.tolist()), tuple(dye.tolist()), tuple(weights.tolist()),
                   float(-weights @ air), contrast**-0.5)
