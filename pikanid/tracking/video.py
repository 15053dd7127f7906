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
from pikanid.tracking.displacement import plane
from pikanid.tracking.edges import Edges, edges
from pikanid.tracking.frames import Film, Frame, open_film
from pikanid.tracking.geometry import Geometry
from pikanid.tracking.journal import Journal, question
from pikanid.tracking.marker import BACK, Marker, Place, Side, marker
from pikanid.tracking.region import Region, propose
from pikanid.tracking.settings import USUAL, TrackingSettings
from pikanid.tracking.surface import Surface, failed, surface
from pikanid.tracking.tracked import Seen, Track, without_repeats
from pikanid.tracking.volume import without_changes

UNREADABLE = "the picture cannot be read"
Watch = Callable[[Frame, Edges, Surface], None]


@dataclass(frozen=True, eq=False)
class Tracker:
    """Finds the surface in pictures of one camera.

    Attributes:
        region: Of the picture that is looked at.
        colours: Of air and liquid.
        settings: What counts as a surface.
        geometry: Straightens points; pixels are taken as they are if None.
        marker: Followed from picture to picture, if there is one.
    """

    region: Region
    colours: Colours
    settings: TrackingSettings = USUAL
    geometry: Geometry | None = None
    marker: Marker | None = None

    def find(self, picture: Picture, shift: tuple[float, float] | None = None
             ) -> tuple[Edges, Surface]:
        """The points and the surface in a picture (H, W, 3), BGR; points are in its pixels, whose
        centres are whole numbers.

        Args:
            picture: The picture.
            shift: How far the marker has moved to the right and down [px]; None if it is not seen.
        """
        if shift is None and self.moving:
            return _nothing("the marker on the tank is not seen")
        region = self.at(shift)
        if not region.within(picture.shape[:2]):
            return _nothing("the tank is not wholly in the picture")
        found = edges(region.cut(picture), self.colours, self.settings)
        if found.reason:
            return found, failed(found.reason)
        # a pixel's edges are whole numbers to `edges`, its centre is one to cameras
        moved = replace(found, x=found.x - 0.5 + region.left, y=found.y - 0.5 + region.top)
        gone = shift if self.moving and shift is not None else (0.0, 0.0)
        if self.geometry is None:
            bottom = self.region.top + region.height - 0.5 + gone[1]
            left = self.region.left - 0.5 + gone[0]
            x, y, walls = moved.x, bottom - moved.y, (left, left + region.width)
        else:
            (x, y), walls = self.geometry.plane(moved.x, moved.y), (0.0, self.geometry.width)
            if self.marker is not None and self.moving:
                away = plane(np.array([gone]), self.marker, self.geometry)[0]
                x, y = x - away[0], y - away[1]
        return moved, surface(x, y, *walls, region.width, self.settings)

    @property
    def moving(self) -> bool:
        """Whether the tank moves through the picture, with a marker on it."""
        return self.marker is not None and self.marker.on == "tank"

    def at(self, shift: tuple[float, float] | None) -> Region:
        """Where the tank's inside is when the marker has moved so far [px]."""
        return self.region.moved(*shift) if self.moving and shift is not None else self.region


def prepare(film: Film, region: Region | None = None, colour: ColourRange | None = None,
            geometry: Geometry | None = None, settings: TrackingSettings = USUAL,
            follow: tuple[Region, Side] | None = None) -> Tracker:
    """A tracker whose region and colours are learned from the first pictures, where not given.

    Args:
        film: The video.
        region: The tank's inside in the first picture.
        colour: Of the liquid.
        geometry: Straightens points.
        settings: What counts as a surface.
        follow: Where a marker is in the first picture, and what it is on.

    Raises:
        BadRecording: If these show no tank, or no two colours.
        BadSetting: If the region does not lie within the picture, or the marker has no texture.
    """
    with closing(film.frames()) as frames:
        first = [f.picture for f in islice(frames, settings.first) if f.picture is not None]
    if not first:
        raise errors.BadRecording(errors.no_video(film.path.name))
    made = None if follow is None else marker(follow[0], first, follow[1], settings)
    if made is not None and made.on == "tank":
        first = _steadied(first, made)
    if region is None:
        region = propose(first, colour)
    region.check(film.size)
    return Tracker(region, learn([region.cut(p) for p in first], settings, colour), settings,
                   geometry, made)


def _steadied(pictures: list[Picture], marker: Marker) -> list[Picture]:
    """Pictures in which the marker was found, moved so that it stays where it was first."""
    places: list[Place] = []
    for picture in pictures:
        places.append(marker.find(picture, places))
    return [np.roll(picture, (-round(p.y), -round(p.x)), axis=(0, 1))
            for picture, p in zip(pictures, places, strict=True) if not p.reason]


def track(path: str | os.PathLike[str], rate: float | None = None, region: Region | None = None,
          colour: ColourRange | str | None = None, geometry: Geometry | None = None,
          flip: bool = False, settings: TrackingSettings = USUAL,
          journal: str | os.PathLike[str] | None = None,
          step: Callable[[int], None] = lambda number: None, watch: Watch | None = None,
          follow: tuple[Region, Side] | None = None, pixel: float | None = None) -> Track:
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
        follow: Where a patch with texture is in the first picture, and what it is on: "tank" where
            the camera stands, "background" where it moves with the tank.
        pixel: Length of a pixel [m] at that patch; the tank's own, by `geometry`, if None.

    Raises:
        BadRecording: If the file is no video, or its first pictures show no liquid.
        BadSetting: If rate, region or marker cannot be, nothing tells how long a pixel is at the
            marker, or OpenCV is not installed.
    """
    of_kind(settings, TrackingSettings)
    if pixel is not None and not 0 < pixel < np.inf:
        raise errors.BadSetting(errors.bad_pixel(pixel))
    if follow is not None and pixel is None and geometry is None:
        raise errors.BadSetting(errors.no_scale())
    film = open_film(path, rate)
    within = ColourRange.parse(colour) if isinstance(colour, str) else colour
    tracker = prepare(film, region, within, geometry, settings, follow)
    asked = {**question(film.path), "rate": film.rate, "settings": asdict(settings),
             "region": asdict(tracker.region), "colours": asdict(tracker.colours),
             "geometry": None if geometry is None else asdict(geometry),
             "follow": None if follow is None else [asdict(follow[0]), follow[1]]}
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
                place = _followed(frame, tracker, seen)
                found, here = _looked_at(frame, tracker, place)
                again = _same(frame.picture, before)
                before = frame.picture
                seen.append(Seen(frame.number, frame.time, here, again, place))
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
                 film.promised, tracker.region, tracker.colours, settings, geometry, flip, notes,
                 tracker.marker, pixel)


def _same(picture: Picture | None, before: Picture | None) -> bool:
    """Whether two pictures are equal in every pixel; a few rows mostly tell."""
    return (picture is not None and before is not None
            and np.array_equal(picture[::32], before[::32]) and np.array_equal(picture, before))


def _followed(frame: Frame, tracker: Tracker, seen: list[Seen]) -> Place | None:
    if tracker.marker is None:
        return None
    if frame.picture is None:
        return Place(reason=UNREADABLE)
    return tracker.marker.find(frame.picture, [s.place for s in seen[-BACK:] if s.place])


def _looked_at(frame: Frame, tracker: Tracker, place: Place | None) -> tuple[Edges, Surface]:
    if frame.picture is None:
        return _nothing(UNREADABLE)
    return tracker.find(frame.picture, None if place is None or place.reason else
                        (place.x, place.y))


def _nothing(reason: str) -> tuple[Edges, Surface]:
    return Edges(np.empty(0), np.empty(0), reason), failed(reason)


def _timed(seen: tuple[Seen, ...], rate: float) -> tuple[Seen, ...]:
    """Times that do not rise are replaced by numbers over the rate."""
    times = np.array([s.time for s in seen])
    if np.all(np.diff(times) > 0):
        return seen
    return tuple(replace(s, time=s.number / rate) for s in seen)
