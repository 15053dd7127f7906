"""From where a marker is in every picture to the tank's position and acceleration."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pikanid.recording import Recording
from pikanid.recording.acceleration import acceleration
from pikanid.tracking.deviation import restlessness
from pikanid.tracking.geometry import Geometry
from pikanid.tracking.marker import Marker, Place

Array = NDArray[np.float64]


def pixels(places: Sequence[Place]) -> tuple[Array, Array]:
    """Displacements (n, 2) to the right and down [px], and their standard errors; NaN where the
    marker was not found.

    The first picture is like itself, and noise may be like the first one's by chance: none is surer
    than half of the others.  Where places jump about more than they should, all errors are larger.

    >>> where, sigma = pixels([Place(0.0, 0.0, 0.0, 0.0), Place(1.0, 0.0, 0.01, 0.02)])
    >>> where[1].tolist(), sigma[0].round(3).tolist()
    ([1.0, 0.0], [0.01, 0.02])
    """
    where = np.array([(p.x, p.y) for p in places])
    sigma = np.array([(p.sx, p.sy) for p in places])
    for k in range(2):
        own = sigma[sigma[:, k] > 0, k]
        if own.size:  # else pictures have no noise at all
            sigma[:, k] = np.maximum(sigma[:, k], np.median(own))
        sigma[:, k] *= restlessness(where[:, k], np.where(sigma[:, k] > 0, sigma[:, k], np.nan))
    return where, sigma


def metres(where: Array, sigma: Array, marker: Marker, geometry: Geometry | None,
           pixel: float | None) -> tuple[Array, Array]:
    """The tank's displacement (n, 2) to the right and up [m], and its standard errors.

    Args:
        where: (n, 2) displacements of the marker to the right and down [px].
        sigma: (n, 2) their standard errors.
        marker: What was followed; one on the background goes the other way.
        geometry: Of a tank seen askew.
        pixel: Length of a pixel [m] at the marker; that in the tank's plane, by `geometry`, if
            None.
    """
    sign = 1.0 if marker.on == "tank" else -1.0
    if pixel is not None:
        scale = np.array([1.0, -1.0]) * pixel
        return sign * scale * where, np.abs(scale) * sigma
    assert geometry is not None
    there = plane(where, marker, geometry)
    steps = [plane(where + sigma * np.eye(2)[k], marker, geometry) - there for k in range(2)]
    return sign * there, np.sqrt(steps[0] ** 2 + steps[1] ** 2)


def plane(where: Array, marker: Marker, geometry: Geometry) -> Array:
    """How far (n, 2) [m] a marker in the tank's plane has moved there, by its place [px]."""
    a = marker.area
    x, y = a.left + (a.width - 1) / 2, a.top + (a.height - 1) / 2
    begin = np.column_stack(geometry.plane(np.array([x]), np.array([y])))
    return np.column_stack(geometry.plane(x + where[:, 0], y + where[:, 1])) - begin


def with_displacement(recording: Recording, time: Array, where: Array, sigma: Array) -> Recording:
    """A recording with the tank's position ``x``, ``y`` [m] and its acceleration ``u_x`` [m/s²].

    Args:
        recording: Of the surface.
        time: (n,) of the pictures [s].
        where: (n, 2) displacements [m].
        sigma: (n, 2) their standard errors.

    Raises:
        BadRecording: If too few pictures show the marker.
    """
    # pictures that are all alike are as sure as rounding of grey levels lets them be
    sigma = np.where(sigma > 0, sigma, np.finfo(float).eps)
    moved = Recording.from_arrays(time, dict(zip("xy", where.T, strict=True)),
                                  {"x": "m", "y": "m"}, dict(zip("xy", sigma.T, strict=True)))
    found = acceleration(moved["x"], "u_x")
    errors = np.asarray(found.channel.sigma)
    note = (f"Acceleration 'u_x' is that of a smoothing spline through 'x', as smooth as the "
            f"standard errors of 'x' say: half of an oscillation at {found.band:.3g} Hz is left; "
            f"its standard error is {np.median(errors):.2g} m/s^2 (median), {np.max(errors):.2g} "
            "m/s^2 (largest).")
    made = recording.with_channels(moved["x"], moved["y"], found.channel)
    return Recording(made.channels, made.name, (*recording.notes, note))
