"""Where the surface crosses each column of a picture, at sub-pixel accuracy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pikanid.tracking.colours import Colours, Picture
from pikanid.tracking.settings import TrackingSettings

Array = NDArray[np.float64]
REACHES = (4, 6, 9, 13, 19, 28)  # numerical: rows that a blurred edge may take on either side
SETTLED = 0.04  # numerical: of the contrast, by which a profile beyond its edge may still change


@dataclass(frozen=True)
class Edges:
    """Points of the surface in one picture.

    Attributes:
        x, y: (n,) columns and rows [px] of the points; pixel k reaches from k to k + 1.
        reason: Why there are none; empty if there are.
    """

    x: Array
    y: Array
    reason: str = ""


def edges(picture: Picture, colours: Colours, settings: TrackingSettings) -> Edges:
    """The surface's row in every column that shows one.

    In each column the edge is where the liquid that is missing within some rows of it says (moment
    edge: A. J. Tabatabai and O. R. Mitchell, IEEE T-PAMI 6, 1984); these rows are as many as the
    picture's mean edge is wide.

    Args:
        picture: (H, W, 3), BGR, cut to the inside of the tank.
        colours: Of air and liquid.
        settings: Which columns count.
    """
    width = picture.shape[1]
    mask = cleaned(picture, colours)
    wet = float(mask.mean())
    if wet < 1e-2:  # numerical: of the picture, less is no liquid
        return _none("no liquid in the region")
    if wet > 0.99:  # numerical: of the picture, more leaves no air
        return _none("nothing but liquid in the region")
    reach, band, columns, split = _band(picture, colours, _split(mask, width), settings)
    good = (columns >= settings.margin * width) & (columns < (1 - settings.margin) * width)
    if reach == 0:
        return _none("the surface leaves the region, or its edge is too blurred")
    middle = band.shape[0] // 2
    above = _smooth(band[middle - 2 * reach:middle - reach].mean(axis=0))
    below = _smooth(band[middle + reach:middle + 2 * reach].mean(axis=0))
    good &= (np.abs(above) < settings.unlike) & (np.abs(below - 1) < settings.unlike)
    if np.count_nonzero(good) < settings.columns * width:
        return _none("covered, or no clear edge in too many columns")
    liquid = (band[middle - reach:middle + reach] - above)[:, good].sum(axis=0)
    down = reach - liquid / (below - above)[good]
    return Edges(columns[good] + 0.5, split[good] + down)


def cleaned(picture: Picture, colours: Colours) -> NDArray[np.uint8]:
    """(H // 2, W // 2) 0 or 1: the largest connected piece of liquid, without specks and hairs, at
    half the resolution.
    """
    import cv2

    height, width = picture.shape[:2]
    half = colours.share(np.asarray(cv2.resize(
        picture[:height // 2 * 2, :width // 2 * 2], (width // 2, height // 2),
        interpolation=cv2.INTER_AREA), np.uint8))
    square = np.ones((3, 3), np.uint8)
    opened = cv2.morphologyEx((half > 0.5).astype(np.uint8), cv2.MORPH_OPEN, square)
    mask = np.asarray(cv2.morphologyEx(opened, cv2.MORPH_CLOSE, square), np.uint8)
    count, labels, about, _ = cv2.connectedComponentsWithStats(mask, connectivity=4)
    if count < 3:
        return mask
    return np.asarray(labels == 1 + np.argmax(about[1:, cv2.CC_STAT_AREA]), np.uint8)


def _split(mask: NDArray[np.uint8], whole: int) -> NDArray[np.intp]:
    """(whole,) row at which each column's liquid begins, at the resolution of the mask."""
    height, width = mask.shape
    rows = np.zeros((height + 1, width), np.int32)
    np.cumsum(mask, axis=0, out=rows[1:])
    # The split that fits two levels best: liquid below counts for it, liquid above against.
    gain = rows[-1] - 2 * rows + np.arange(height + 1, dtype=np.int32)[:, None]
    rough = 2 * np.argmax(gain, axis=0)
    return np.pad(np.repeat(rough, 2), (0, whole - 2 * width), mode="edge")


def _band(picture: Picture, colours: Colours, rough: NDArray[np.intp], settings: TrackingSettings
          ) -> tuple[int, NDArray[Any], NDArray[np.intp], NDArray[np.intp]]:
    """How far the edge reaches, rows around it (4·reach, n) in the columns that hold them, these
    columns, and the rows; reach is 0 where no width fits.
    """
    height, width = picture.shape[:2]
    split = rough
    packed = np.ascontiguousarray(picture).view("V3")[..., 0]  # a pixel is one thing to take
    for reach in REACHES:
        columns = np.flatnonzero((split >= 2 * reach) & (split <= height - 2 * reach))
        if len(columns) < settings.columns * width:
            break
        band = colours.shares(_cut(packed, split[columns], columns, 2 * reach))
        if split is rough:
            # centred on the row where half is liquid
            split = rough.copy()
            split[columns] += np.rint(2 * reach - band.sum(axis=0)).astype(int)
            columns = columns[(split[columns] >= 2 * reach)
                              & (split[columns] <= height - 2 * reach)]
            if len(columns) < settings.columns * width:
                break
            band = colours.shares(_cut(packed, split[columns], columns, 2 * reach))
        profile = band.mean(axis=1)
        low, high = profile[:reach // 2 + 1].mean(), profile[-(reach // 2 + 1):].mean()
        near = max(abs(profile[reach - 1:reach + 1].mean() - low),
                   abs(profile[3 * reach - 1:3 * reach + 1].mean() - high))
        if near < SETTLED * abs(high - low):
            return reach, band, columns, split[columns]
    return 0, np.empty((0, 0)), np.empty(0, np.intp), np.empty(0, np.intp)


def _cut(packed: NDArray[np.void], split: NDArray[np.intp], columns: NDArray[np.intp],
         half: int) -> NDArray[np.uint8]:
    """Pixels (2·half, n, 3) in the rows around the split of each column."""
    width = packed.shape[1]
    first = (split - half) * width + columns
    taken = packed.ravel().take(first + width * np.arange(2 * half)[:, None])
    return np.asarray(taken.view(np.uint8).reshape(2 * half, len(columns), 3))


def _smooth(levels: Array) -> Array:
    """A level of neighbouring columns changes slowly: running mean."""
    from scipy.ndimage import uniform_filter1d

    return np.asarray(uniform_filter1d(levels, 9, mode="nearest"))  # numerical: columns, < 16


def _none(reason: str) -> Edges:
    return Edges(np.empty(0), np.empty(0), reason)
