"""A video of a liquid's surface becomes an angle and its standard error for every frame."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import closing
from dataclasses import asdict, dataclass, replace
from itertools import islice
from pathlib import Path

import numpy as np

from pikanid import errors
from pikanid.settings import of_kind
from pikanid.tracking.colours import ColourRange, Colours, Picture, learn
from pikanid.tracking.edges import Edges, edges
from pikanid.tracking.frames import Film, Frame, open_film
from pikanid.tracking.geometry import Geometry
from pikanid.tracking.journal import Journal, question
from pikanid.tracking.region import Region, propose
from pikanid.tracking.settings import USUAL, TrackingSettings
from pikanid.tracking.surface import Surface, failed, surface
from pikanid.tracking.tracked import Seen, Track, without_repeats
from pikanid.tracking.volume import without_changes

Watch = Callable[[Frame, Edges, Surface], None]


@dataclass(frozen=True, eq=False)
class Tracker:
    """Finds the surface in pictures of one camera.

    Attributes:
        region: Of the picture that is looked at.
        colours: Of air and liquid.
        settings: What counts as a surface.
        geometry: Straightens points; pixels are taken as they are if None.
    """

    region: Region
    colours: Colours
    settings: TrackingSettings = USUAL
    geometry: Geometry | None = None

    def find(self, picture: Picture) -> tuple[Edges, Surface]:
        """The points and the surface in a picture (H, W, 3), BGR; points are in its pixels, whose
        centres are whole numbers.
        """
        region = self.region
        found = edges(region.cut(picture), self.colours, self.settings)
        if found.reason:
            return found, failed(found.reason)
        # a pixel's edges are whole numbers to `edges`, its centre is one to cameras
        moved = replace(found, x=found.x - 0.5 + region.left, y=found.y - 0.5 + region.top)
        if self.geometry is None:
            bottom, left = region.top + region.height - 0.5, region.left - 0.5
            x, y, walls = moved.x, bottom - moved.y, (left, left + region.width)
        else:
            (x, y), walls = self.geometry.plane(moved.x, moved.y), (0.0, self.geometry.width)
        return moved, surface(x, y, *walls, region.width, self.settings)


def prepare(film: Film, region: Region | None = None, colour: ColourRange | None = None,
            geometry: Geometry | None = None, settings: TrackingSettings = USUAL) -> Tracker:
    """A tracker whose region and colours are learned from the first pictures, where not given.

    Raises:
        BadRecording: If these show no tank, or no two colours.
        BadSetting: If the region does not lie within the picture.
    """
    with closing(film.frames()) as frames:
        first = [f.picture for f in islice(frames, settings.first) if f.picture is not None]
    if not first:
        raise errors.BadRecording(errors.no_video(film.path.name))
    if region is None:
        region = propose(first, colour)
    region.check(film.size)
    return Tracker(region, learn([region.cut(p) for p in first], settings, colour), settings,
                   geometry)


def track(path: str | os.PathLike[str], rate: float | None = None, region: Region | None = None,
          colour: ColourRange | str | None = None, geometry: Geometry | None = None,
          flip: bool = False, settings: TrackingSettings = USUAL,
          journal: str | os.PathLike[str] | None = None,
          step: Callable[[int], None] = lambda number: None, watch: Watch | None = None) -> Track:
    """The surface in every picture of a video; one picture at a time is held in memory.

    Args:
        path: Of any video that OpenCV reads, or of a folder of numbered images.
        rate: Pictures per second; as the file says if None.
        region: The tank's inside; proposed from the first pictures if None.
        colour: Range of the liquid's colour, or its text; learned from the first pictures if None.
        geometry: Straightens perspective and lens.
        flip: Whether the picture's left is the model's positive direction.
        settings: What counts as a surface.
        journal: A file that keeps what was found if the run is stopped; it goes on there when it is
            repeated.  Deleted at the end.
        step: Called with the number of pictures that are done.
        watch: Called with every picture and what was found in it.

    Raises:
        BadRecording: If the file is no video, or its first pictures show no liquid.
        BadSetting: If rate or region cannot be, or OpenCV is not installed.
    """
    of_kind(settings, TrackingSettings)
    film = open_film(path, rate)
    within = ColourRange.parse(colour) if isinstance(colour, str) else colour
    tracker = prepare(film, region, within, geometry, settings)
    asked = {**question(film.path), "rate": film.rate, "settings": asdict(settings),
             "region": asdict(tracker.region), "colours": asdict(tracker.colours),
             "geometry": None if geometry is None else asdict(geometry)}
    # what is watched has to be seen from the first picture on
    kept = Journal(None if journal is None else Path(journal), asked, resume=watch is None)
    seen = list(kept.found)
    notes = (f"The first {len(seen)} frames were found by a run that was stopped.",) if seen else ()
    done = False
    try:
        with closing(film.frames(max(len(seen) - 1, 0))) as frames:
            # the last one that is known comes again: the next may repeat it
            before = next(frames).picture if seen else None
            for frame in frames:
                found, here = _looked_at(frame, tracker)
                again = _same(frame.picture, before)
                before = frame.picture
                seen.append(Seen(frame.number, frame.time, here, again))
                kept.add(seen[-1])
                if watch is not None:
                    watch(frame, found, here)
                step(len(seen))
        done = True
    finally:
        kept.close(done)
    width = tracker.region.width if geometry is None else geometry.width
    kept_ones = without_changes(without_repeats(seen), width, settings)
    return Track(film.path.stem, _timed(kept_ones, film.rate), film.rate,
                 film.promised, tracker.region, tracker.colours, settings, geometry, flip, notes)


def _same(picture: Picture | None, before: Picture | None) -> bool:
    """Whether two pictures are equal in every pixel; a few rows mostly tell."""
    return (picture is not None and before is not None
            and np.array_equal(picture[::32], before[::32]) and np.array_equal(picture, before))


def _looked_at(frame: Frame, tracker: Tracker) -> tuple[Edges, Surface]:
    if frame.picture is None:
        nothing = Edges(np.empty(0), np.empty(0), "the picture cannot be read")
        return nothing, failed(nothing.reason)
    return tracker.find(frame.picture)


def _timed(seen: tuple[Seen, ...], rate: float) -> tuple[Seen, ...]:
    """Times that do not rise are replaced by numbers over the rate."""
    times = np.array([s.time for s in seen])
    if np.all(np.diff(times) > 0):
        return seen
    return tuple(replace(s, time=s.number / rate) for s in seen)
