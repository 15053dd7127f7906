"""Perspective and lens: angles of a tank seen from the side, by its corners and edges."""

from __future__ import annotations

import numpy as np
import pytest

from pikanid import errors
from pikanid.tracking.geometry import from_corners, from_edges
from pikanid.tracking.render import Scene

TURNED = Scene(yaw=0.3, pitch=0.2)


def seen_line(degrees: float) -> np.ndarray:
    left, _, width, _ = TURNED.tank
    x = np.linspace(left + 10, left + width - 10, 50)
    y = TURNED.waterline - np.tan(np.radians(degrees)) * (x - left - width / 2)
    return TURNED.seen(np.column_stack([x, y]))


def angle(x: np.ndarray, y: np.ndarray) -> float:
    return float(np.degrees(np.arctan(np.polyfit(x, y, 1)[0])))


@pytest.mark.parametrize("degrees", [-25.0, 0.0, 10.0])
def test_corners_straighten_a_turned_view(degrees: float) -> None:
    points = seen_line(degrees)
    assert abs(angle(points[:, 0], -points[:, 1]) - degrees) > 0.3  # what it would be without
    flat = from_corners(TURNED.corners, 0.066, 0.0858, TURNED.size)
    assert angle(*flat.plane(*points.T)) == pytest.approx(degrees, abs=1e-6)
    assert flat.plane(*TURNED.corners.T)[1][2] == pytest.approx(0.0, abs=1e-9)


def bent(points: np.ndarray, lens: float) -> np.ndarray:
    """Where a lens shows points: the inverse of r (1 + lens r^2), by iteration."""
    middle, radius = np.array([319.5, 239.5]), np.hypot(640, 480) / 2
    away = (points - middle) / radius
    shown = away.copy()
    for _ in range(50):
        shown = away / (1 + lens * np.sum(shown**2, axis=1))[:, None]
    return middle + radius * shown


def test_edges_show_the_lens() -> None:
    a, b, c, d = TURNED.corners
    s = np.linspace(0, 1, 15)[:, None]
    edges = {side: bent(p + s * (q - p), 0.12) for side, (p, q) in {
        "left": (a, d), "top": (a, b), "right": (b, c), "bottom": (d, c)}.items()}
    found = from_edges(edges, 0.066, 0.0858, TURNED.size)
    assert found.lens == pytest.approx(0.12, abs=1e-4)
    assert angle(*found.plane(*bent(seen_line(12.0), 0.12).T)) == pytest.approx(12.0, abs=1e-3)


def test_what_is_no_tank_is_refused() -> None:
    corners = TURNED.corners
    with pytest.raises(errors.BadSetting, match="convex"):
        from_corners(corners[::-1], 0.1, 0.1, (480, 640))
    with pytest.raises(errors.BadSetting, match="tank of"):
        from_corners(corners, 0.0, 0.1, (480, 640))
    with pytest.raises(errors.BadSetting, match="left edge"):
        from_edges({}, 0.1, 0.1, (480, 640))
