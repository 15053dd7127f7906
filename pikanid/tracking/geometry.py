"""From the picture to the plane of the tank: perspective and lens, by the tank's own edges."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pikanid import errors

Array = NDArray[np.float64]
SIDES = ("left", "top", "right", "bottom")


@dataclass(frozen=True)
class Geometry:
    """Straightens points: first the lens, then the view.

    A point at distance r from the picture's middle, in half diagonals, belongs at r·(1 + lens·r²)
    (radial distortion of first order: D. C. Brown, Photogramm. Eng. 37, 1971).

    Attributes:
        homography: (3, 3) from the picture [px], pixel centres at whole numbers, to the tank's
            plane [m], from its lower left inner corner to the right and up.
        width: Of the tank's inside [m].
        lens: Of the distortion.
        middle: Of the picture [px].
        radius: Half its diagonal [px].
    """

    homography: tuple[tuple[float, ...], ...]
    width: float
    lens: float = 0.0
    middle: tuple[float, float] = (0.0, 0.0)
    radius: float = 1.0

    def plane(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Points (n,) of the picture [px] in the tank's plane [m], y up."""
        flat = _straight(np.column_stack([x, y]), self.lens, self.middle, self.radius)
        moved = np.column_stack([flat, np.ones(len(flat))]) @ np.asarray(self.homography).T
        return moved[:, 0] / moved[:, 2], moved[:, 1] / moved[:, 2]


def from_corners(corners: ArrayLike, width: float, height: float, size: tuple[int, int],
                 lens: float = 0.0) -> Geometry:
    """By where the picture shows four points of the tank that form a rectangle.

    Args:
        corners: (4, 2) upper left, upper right, lower right, lower left [px].
        width: Between left and right ones [m].
        height: Between upper and lower ones [m].
        size: Height and width of the picture [px].
        lens: Distortion: see `Geometry`.

    Raises:
        BadSetting: If the corners are no convex quadrangle, or a length is not positive.

    >>> g = from_corners([[10, 10], [30, 10], [30, 50], [10, 50]], 0.1, 0.2, (60, 40))
    >>> [a.round(3).tolist() for a in g.plane(np.array([20.0]), np.array([50.0]))]
    [[0.05], [0.0]]
    """
    points = np.asarray(corners, float)
    if points.shape != (4, 2) or not np.all(np.isfinite(points)) or not _convex(points):
        raise errors.BadSetting(errors.bad_corners())
    if not (0 < width < np.inf and 0 < height < np.inf):
        raise errors.BadSetting(errors.bad_tank(width, height))
    middle, radius = _picture(size)
    points = _straight(points, lens, middle, radius)
    there = np.array([[0, height], [width, height], [width, 0], [0, 0]])
    rows = []
    for (x, y), (u, v) in zip(points, there, strict=True):
        rows += [[x, y, 1, 0, 0, 0, -u * x, -u * y], [0, 0, 0, x, y, 1, -v * x, -v * y]]
    h = np.linalg.solve(np.asarray(rows, float), there.ravel())
    homography = tuple(tuple(map(float, row)) for row in np.append(h, 1.0).reshape(3, 3))
    return Geometry(homography, width, lens, middle, radius)


def from_edges(edges: Mapping[str, ArrayLike], width: float, height: float,
               size: tuple[int, int]) -> Geometry:
    """By points along the tank's four edges, which are straight: that shows the lens, too.

    Args:
        edges: "left", "top", "right", "bottom" -> (n, 2) points [px], two or more each; three or
            more where the lens bends the picture.
        width: Between the left and the right edge [m].
        height: Between the upper and the lower one [m].
        size: Height and width of the picture [px].

    Raises:
        BadSetting: If an edge is missing or has fewer than two points.
    """
    from scipy.optimize import minimize_scalar

    found = {side: np.asarray(edges.get(side, ()), float) for side in SIDES}
    for side, points in found.items():
        if points.ndim != 2 or points.shape[1:] != (2,) or len(points) < 2 or not np.all(
                np.isfinite(points)):
            raise errors.BadSetting(errors.bad_edge(side))
    middle, radius = _picture(size)

    def bent(lens: float) -> float:
        lines = [_line(_straight(p, lens, middle, radius)) for p in found.values()]
        return float(sum(left for _, _, left in lines))

    lens = 0.0
    if any(len(p) > 2 for p in found.values()):
        lens = float(minimize_scalar(bent, bounds=(-0.5, 0.5), method="bounded",
                                     options={"xatol": 1e-6}).x)  # numerical: what lenses have
    lines = {side: _line(_straight(p, lens, middle, radius))[:2] for side, p in found.items()}
    corners = [_meet(lines[a], lines[b]) for a, b in (
        ("left", "top"), ("right", "top"), ("right", "bottom"), ("left", "bottom"))]
    flat = from_corners(corners, width, height, size)
    return Geometry(flat.homography, width, lens, middle, radius)


def _picture(size: tuple[int, int]) -> tuple[tuple[float, float], float]:
    height, width = size
    return ((width - 1) / 2, (height - 1) / 2), float(np.hypot(width, height)) / 2


def _straight(points: Array, lens: float, middle: tuple[float, float], radius: float) -> Array:
    away = (points - np.asarray(middle)) / radius
    return np.asarray(middle + radius * away * (1 + lens * np.sum(away**2, axis=1))[:, None])


def _line(points: Array) -> tuple[Array, Array, float]:
    """A point of the nearest line, its direction, and the squares that are left."""
    mean = points.mean(axis=0)
    _, s, rows = np.linalg.svd(points - mean)
    return mean, rows[0], float(s[1] ** 2)


def _meet(a: tuple[Array, Array], b: tuple[Array, Array]) -> Array:
    steps = np.linalg.solve(np.column_stack([a[1], -b[1]]), b[0] - a[0])
    return np.asarray(a[0] + steps[0] * a[1])


def _convex(points: Array) -> bool:
    sides = np.roll(points, -1, axis=0) - points
    after = np.roll(sides, -1, axis=0)
    turns = sides[:, 0] * after[:, 1] - sides[:, 1] * after[:, 0]
    return bool(np.all(turns > 0))
