"""Where the tank's inside is: as given, or where the first pictures show dyed liquid."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pikanid import errors
from pikanid.tracking.colours import ColourRange, Picture

STEEPEST = 0.6  # numerical: slope of the steepest surface that a proposed region has room for
INSET = 0.02  # numerical: of the liquid's width, that walls and their blur take on either side
LEAST = 0.01  # numerical: share of the picture, less is no tank


@dataclass(frozen=True)
class Region:
    """A rectangle of the picture [px]: the tank's inside."""

    left: int
    top: int
    width: int
    height: int

    def cut(self, picture: Picture) -> Picture:
        """The part of a picture that lies within."""
        return picture[self.top:self.top + self.height, self.left:self.left + self.width]

    def moved(self, x: float, y: float) -> Region:
        """The region of a tank that has gone so far [px], to the nearest pixel.

        >>> Region(10, 20, 30, 40).moved(1.6, -2.0)
        Region(left=12, top=18, width=30, height=40)
        """
        return replace(self, left=self.left + round(x), top=self.top + round(y))

    def within(self, size: tuple[int, int]) -> bool:
        """Whether it lies in a picture of that height and width."""
        height, width = size
        return (min(self.left, self.top) >= 0 and self.left + self.width <= width
                and self.top + self.height <= height)

    def check(self, size: tuple[int, int]) -> None:
        """Refuse a region that is not within a picture of that height and width.

        Raises:
            BadSetting: If it is not, or too small to hold a surface.
        """
        if not self.within(size) or min(self.width, self.height) < 24:
            raise errors.BadSetting(errors.region_outside(
                (self.left, self.top, self.width, self.height), size))


def propose(pictures: Sequence[Picture], within: ColourRange | None = None) -> Region:
    """The region of the tank's inside: as wide as the liquid, with room above for its motion.

    Args:
        pictures: The first ones (H, W, 3), BGR, whole.
        within: The liquid's colour; what differs most from the picture's usual colour if None.

    Raises:
        BadRecording: If nothing stands out.
    """
    import cv2

    mean = np.mean(np.asarray(pictures, np.float32), axis=0).astype(np.uint8)
    masks = ([_standing_out(mean)] if within is None else
             [within.mask(p).astype(np.uint8) for p in pictures])
    mask = (np.mean(masks, axis=0) > 0.5).astype(np.uint8)
    mask = cv2.morphologyEx(mask, cv2.MORPH_OPEN, np.ones((5, 5), np.uint8))
    count, labels, about, _ = cv2.connectedComponentsWithStats(mask, connectivity=4)
    if count < 2:
        raise errors.BadRecording(errors.no_tank())
    largest = 1 + int(np.argmax(about[1:, cv2.CC_STAT_AREA]))
    liquid = labels == largest
    if liquid.mean() < LEAST:
        raise errors.BadRecording(errors.no_tank())
    deep = liquid.sum(axis=0)
    columns = np.flatnonzero(deep > np.median(deep[deep > 0]) / 2)
    rows = np.flatnonzero(liquid.sum(axis=1) > len(columns) / 2)
    inset = round(INSET * len(columns)) + 1
    left, right = int(columns[0]) + inset, int(columns[-1]) + 1 - inset
    room = int(STEEPEST * (right - left) / 2) + 20  # numerical: rows that blur and levels take
    top = max(int(rows[0]) - room, 0)
    bottom = int(rows[-1]) + 1 - inset
    found = Region(left, top, right - left, bottom - top)
    found.check(mean.shape[:2])
    return found


def _standing_out(picture: Picture) -> NDArray[np.uint8]:
    """(H, W) 0 or 1: pixels of another colour, whatever their brightness; Otsu's threshold."""
    import cv2

    lab = cv2.cvtColor(picture, cv2.COLOR_BGR2LAB).astype(np.float32)
    usual = np.median(lab.reshape(-1, 3), axis=0)
    away = np.hypot(lab[..., 1] - usual[1], lab[..., 2] - usual[2])
    grey = np.clip(2 * away, 0, 255).astype(np.uint8)
    level, mask = cv2.threshold(grey, 0, 1, cv2.THRESH_BINARY + cv2.THRESH_OTSU)
    if level < 16:  # numerical: eight steps of Lab, which noise can be
        raise errors.BadRecording(errors.no_tank())
    return np.asarray(mask, np.uint8)
