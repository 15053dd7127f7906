"""The surface's angle in one picture: sub-pixel points by column, a robust line, its error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pikanid import errors

Array = NDArray[np.float64]

HUBER = 1.345  # definition: 95 % efficiency under normal noise (Huber, Robust Statistics, 1981)
MAD = 1.4826  # definition: median absolute deviation to standard deviation, normal noise


@dataclass(frozen=True)
class Surface:
    """What one picture says.

    Attributes:
        theta: Angle [rad], positive where the surface rises to the right; NaN if it failed.
        sigma: Its standard error [rad]; NaN if it failed.
        level: Height of the surface at the middle above the picture's lower edge [px].
        reason: Why it failed; empty if it did not.
    """

    theta: float
    sigma: float
    level: float
    reason: str = ""


def find(picture: NDArray[np.uint8], window: int = 8, lags: int = 5) -> Surface:
    """The surface in a picture whose upper rows show air and whose lower rows show liquid.

    Colours are projected onto the difference of both; in each column the edge is where the
    brightness that is missing in a window of 2·`window` rows says (moment edge).  The line is
    Huber's, its error the Newey-West sandwich over `lags` columns, since blur ties neighbours.

    Args:
        picture: (H, W, 3) RGB, cut to the inside of the tank.
        window: Rows above and below the edge that are summed.
        lags: Columns over which errors are taken to be correlated.

    Raises:
        BadRecording: If it is no colour picture.

    >>> from pikanid.tracking.render import picture
    >>> found = find(picture(0.1))
    >>> bool(abs(found.theta - 0.1) < 5 * found.sigma < 0.02)
    True
    """
    if picture.ndim != 3 or picture.shape[2] != 3:
        raise errors.BadRecording(
            errors.not_of_kind("The picture", f"array of shape {picture.shape}", "(H, W, 3)"))
    height, width = picture.shape[:2]
    values = picture.astype(float)
    band = max(height // 10, 1)
    air, dye = (np.median(part, axis=(0, 1)) for part in (values[:band], values[-band:]))
    contrast = float(np.sum((dye - air) ** 2))
    spread = float(np.std(values[:band] - air) + np.std(values[-band:] - dye))
    if np.sqrt(contrast) <= 5 * max(spread, 1.0):
        return _failed("no liquid below and air above")
    score = (values - air) @ (dye - air) / contrast
    rows = np.cumsum(np.vstack([np.zeros(width), score]), axis=0)
    # The split that fits two levels best: liquid below counts for, air above against.
    gain = rows[-1] - 2 * rows + np.arange(height + 1)[:, None] - height / 2
    split = np.argmax(gain, axis=0)
    columns = np.flatnonzero((split >= 2 * window) & (split <= height - 2 * window))
    if len(columns) < width / 2:
        return _failed("the surface leaves the picture in half of the columns")
    at = split[columns]

    def total(first: NDArray[np.int64], last: NDArray[np.int64]) -> Array:
        return rows[last, columns] - rows[first, columns]

    above = total(at - 2 * window, at - window) / window
    below = total(at + window, at + 2 * window) / window
    sharp = np.abs(below - above - 1) < 0.5
    if np.count_nonzero(sharp) < width / 2:
        return _failed("no clear edge in half of the columns")
    liquid = (total(at - window, at + window) - 2 * window * above)[sharp] / (below - above)[sharp]
    return _line(columns[sharp] + 0.5 - width / 2, height - at[sharp] - window + liquid, lags)


def _failed(reason: str) -> Surface:
    return Surface(float("nan"), float("nan"), float("nan"), reason)


def _line(x: Array, y: Array, lags: int) -> Surface:
    design = np.column_stack([np.ones_like(x), x])
    weight = np.ones_like(x)
    for _ in range(20):
        root = np.sqrt(weight)
        line = np.linalg.lstsq(design * root[:, None], y * root, rcond=None)[0]
        left = y - design @ line
        scale = max(MAD * float(np.median(np.abs(left))), 1e-6)
        weight = np.minimum(1.0, HUBER * scale / np.maximum(np.abs(left), 1e-12))
    if scale > 2.0:
        return _failed("the surface is no line")
    scores = design * (weight * left)[:, None]
    meat = scores.T @ scores
    for lag in range(1, lags + 1):
        cross = scores[lag:].T @ scores[:-lag]
        meat += (1 - lag / (lags + 1)) * (cross + cross.T)
    bread = np.linalg.inv(design.T @ (design * (np.abs(left) <= HUBER * scale)[:, None]))
    slope = float(line[1])
    error = float(np.sqrt((bread @ meat @ bread)[1, 1])) / (1 + slope**2)
    return Surface(float(np.arctan(slope)), error, float(line[0]))
