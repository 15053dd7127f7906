"""What was found in all pictures of a clip, and what becomes of it: a recording, a summary."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pikanid import errors
from pikanid.recording import Recording
from pikanid.tracking.colours import Colours
from pikanid.tracking.deviation import deviations
from pikanid.tracking.displacement import metres, pixels, with_displacement
from pikanid.tracking.geometry import Geometry
from pikanid.tracking.marker import Marker, Place
from pikanid.tracking.region import Region
from pikanid.tracking.settings import MODES, TrackingSettings
from pikanid.tracking.surface import Surface, failed

Array = NDArray[np.float64]
REPEATED = "the same picture as the one before"
SHAPES = tuple(f"shape_{k}" for k in range(2, 2 + MODES))  # definition: names by degree
LATE = 1.5  # numerical: intervals between two pictures from which on one is missing


@dataclass(frozen=True)
class Seen:
    """One picture's number, time [s] and surface, whether it equals the one before, and where the
    marker is, if one is followed.
    """

    number: int
    time: float
    surface: Surface
    repeated: bool = False
    place: Place | None = None

    @property
    def shift(self) -> tuple[float, float] | None:
        """How far the marker has moved [px]; none if it was not found."""
        return None if self.place is None or self.place.reason else (self.place.x, self.place.y)


def without_repeats(seen: Sequence[Seen]) -> tuple[Seen, ...]:
    """Repeated pictures say nothing of their own, unless most are: a camera without noise at rest.
    """
    if 2 * sum(s.repeated for s in seen) > len(seen):
        return tuple(seen)
    return tuple(_nothing_new(s) if s.repeated else s for s in seen)


def _nothing_new(seen: Seen) -> Seen:
    surface = seen.surface if seen.surface.reason else failed(REPEATED)
    return replace(seen, surface=surface,
                   place=None if seen.place is None else Place(reason=REPEATED))


@dataclass(frozen=True, eq=False)
class Track:
    """The surface in every picture.

    Attributes:
        name: Of the video.
        seen: The pictures in their order.
        rate: Pictures per second, as stated.
        promised: How many pictures the file said it has; 0 if it did not.
        region: Of the picture.
        colours: Of air and liquid.
        settings: By which it was found.
        geometry: How points were straightened; None if they were not.
        flipped: Whether angles count as seen from behind the picture.
        notes: What happened.
        marker: What was followed; None if nothing was.
        pixel: Length of a pixel [m] at the marker; the tank's own, by `geometry`, if None.
    """

    name: str
    seen: tuple[Seen, ...]
    rate: float
    promised: int
    region: Region
    colours: Colours
    settings: TrackingSettings
    geometry: Geometry | None = None
    flipped: bool = False
    notes: tuple[str, ...] = ()
    marker: Marker | None = None
    pixel: float | None = None

    @cached_property
    def time(self) -> Array:
        """Of every picture (n,) [s]."""
        return np.array([s.time for s in self.seen])

    @cached_property
    def theta(self) -> Array:
        """Angle (n,) [rad] of every picture; NaN where none was found."""
        sign = -1.0 if self.flipped else 1.0
        return sign * np.array([s.surface.theta for s in self.seen])

    @cached_property
    def sigma(self) -> Array:
        """Standard errors (n, 2 + modes): angle [rad], level, shapes; NaN where there are none."""
        count = 2 + MODES
        variance, finer = (np.array([getattr(s.surface, name) for s in self.seen])
                           for name in ("variance", "finer"))
        gains = np.array([s.surface.gains or (np.nan,) * count for s in self.seen])
        one = deviations(self.theta, variance, finer, gains[:, 0], self.settings)
        return np.asarray(gains * (one / gains[:, 0])[:, None])

    @cached_property
    def motion(self) -> tuple[Array, Array]:
        """The tank's displacement (n, 2) since the first picture, in the model's positive direction
        and up, and its standard errors [m]; NaN where the marker was not found.
        """
        assert self.marker is not None
        where, sigma = pixels([s.place or Place() for s in self.seen])
        where, sigma = metres(where, sigma, self.marker, self.geometry, self.pixel)
        return where * [-1.0 if self.flipped else 1.0, 1.0], sigma

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why each picture has no angle; empty where it has one."""
        return tuple(s.surface.reason for s in self.seen)

    @property
    def dropped(self) -> tuple[float, ...]:
        """Times [s] of pictures after which at least one is missing."""
        if len(self.seen) < 3:
            return ()
        steps = np.diff(self.time)
        late = np.flatnonzero(steps > LATE * np.median(steps))
        return tuple(self.time[late].tolist())

    def recording(self) -> Recording:
        """Angle ``theta`` [rad], the surface's ``level``, and ``shape_2`` to ``shape_4`` (Legendre
        coefficients over the width) in px, or in m where corners were given; where a marker was
        followed, the tank's position ``x``, ``y`` [m] and acceleration ``u_x`` [m/s²].  Each has a
        sigma for every picture.

        Raises:
            BadRecording: If fewer than two pictures show a surface, or too few the marker.
        """
        if np.count_nonzero(np.isfinite(self.theta)) < 2:
            raise errors.BadRecording(errors.no_surface(
                self.name, len(self.seen), [*self._failures()]))
        unit = "px" if self.geometry is None else "m"
        values: dict[str, Array] = {"theta": self.theta}
        values["level"] = np.array([s.surface.level for s in self.seen])
        shapes = np.array([s.surface.shape or (np.nan,) * MODES for s in self.seen])
        if self.flipped:
            shapes[:, 1] *= -1  # the odd one
        values |= dict(zip(SHAPES, shapes.T, strict=True))
        sigma = dict(zip(values, self.sigma.T, strict=True))
        units = {name: "rad" if name == "theta" else unit for name in values}
        made = Recording.from_arrays(self.time, values, units, sigma, name=self.name)
        made = Recording(made.channels, made.name, (*self.notes, *self.sentences()))
        return made if self.marker is None else with_displacement(made, self.time, *self.motion)

    def sentences(self) -> list[str]:
        """What is wrong with the video, one sentence each."""
        n = len(self.seen)
        said = [f"{count} of {n} frames have no angle: {why}."
                for why, count in self._failures().items()]
        said += [f"{count} of {n} frames have no position: {why}."
                 for why, count in self._lost().items()]
        if self.dropped:
            said.append(f"Frames are missing after {len(self.dropped)} of {n}, first after "
                        f"{self.dropped[0]:.4g} s.")
        if self.promised > n:
            said.append(f"The video ends after {n} of {self.promised} frames; those were read.")
        return said

    def summary(self) -> dict[str, Any]:
        """How good it is, as numbers: for JSON."""
        sigma = self.sigma[:, 0]
        there = np.isfinite(sigma)
        middle = float(np.median(sigma[there])) if there.any() else None
        about = {} if self.marker is None else {"marker": self._followed(self.marker)}
        return {
            "frames": len(self.seen), "angles": int(there.sum()), "rate": self.rate,
            "failed": dict(self._failures()), "dropped_after": list(self.dropped),
            "sigma_median": middle,
            "sigma_largest": float(np.max(sigma[there])) if there.any() else None,
            "points_median": float(np.median([s.surface.points for s in self.seen])),
            "region": [self.region.left, self.region.top, self.region.width, self.region.height],
            "air_bgr": list(self.colours.air), "dye_bgr": list(self.colours.dye),
            "notes": [*self.notes, *self.sentences()],
            **about,
            "failures": [{"frame": s.number, "time": s.time, "reason": s.surface.reason}
                         for s in self.seen if s.surface.reason]}

    def _followed(self, marker: Marker) -> dict[str, Any]:
        sigma = self.motion[1][:, 0]
        there = np.isfinite(sigma)
        a = marker.area
        return {"area": [a.left, a.top, a.width, a.height], "on": marker.on, "found": int(
            there.sum()), "failed": dict(self._lost()),
            "sigma_median": float(np.median(sigma[there])) if there.any() else None}

    def _lost(self) -> Counter[str]:
        return Counter(s.place.reason for s in self.seen if s.place and s.place.reason)

    def _failures(self) -> Counter[str]:
        return Counter(reason for reason in self.reasons if reason)
