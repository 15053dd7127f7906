"""What was found, drawn into the pictures: a video, a contact sheet, and the angle over time."""

from __future__ import annotations

import os
import secrets
from collections.abc import Collection, Iterator, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pikanid import errors
from pikanid.figures import BAND, COLOURS, NARROW, WIDE, new_figure, tidy
from pikanid.storage.outputs import finished
from pikanid.tracking.colours import Picture
from pikanid.tracking.edges import Edges
from pikanid.tracking.frames import Film, Frame
from pikanid.tracking.region import Region
from pikanid.tracking.surface import Surface
from pikanid.tracking.tracked import Seen, Track
from pikanid.tracking.video import Tracker

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

POINT, LINE = (0, 255, 255), (255, 0, 255)  # layout: colours, BGR
BOX, TEXT, MARKER = (0, 0, 255), (0, 0, 0), (255, 80, 0)  # layout: colours, BGR
NOTHING = Edges(np.empty(0), np.empty(0))  # definition: no points
TILES = 8  # layout: pictures of a contact sheet, besides those that failed
FAILED = 4  # layout: of those
WIDTH = 320  # layout: pixels of a picture on it
EVERY = 6  # layout: columns between two points that are drawn
SHADE = 0.35  # layout: how strongly what counts as liquid is tinted


@dataclass(frozen=True, eq=False)
class Still:
    """A frame that is kept, and what was found in it.

    Attributes:
        frame: The picture.
        found: Points of the surface.
        surface: Through them.
        region: The tank's inside in this picture; where it is in all of them if None.
        marker: Where the marker is; None if there is none.
    """

    frame: Frame
    found: Edges
    surface: Surface
    region: Region | None = None
    marker: Region | None = None


def overlaid(still: Still, track: Track) -> Picture:
    """A picture (H, W, 3), BGR, with the region (red), what counts as liquid (tinted), points of
    the surface (yellow) and the nearest line (magenta), and the marker (blue).
    """
    import cv2

    from pikanid.tracking.edges import cleaned

    frame, found, surface = still.frame, still.found, still.surface
    assert frame.picture is not None
    shown = np.ascontiguousarray(frame.picture).copy()
    r = still.region or track.region
    if r.within(shown.shape[:2]):
        inside = r.cut(shown)
        half = cleaned(r.cut(frame.picture), track.colours)
        mask = cv2.resize(half, (r.width, r.height), interpolation=cv2.INTER_NEAREST).astype(bool)
        inside[mask] = ((1 - SHADE) * inside[mask] + SHADE * np.array([0, 200, 0])).astype(np.uint8)
    for box, colour in ((r, BOX), (still.marker, MARKER)):
        if box is not None:
            cv2.rectangle(shown, (box.left - 1, box.top - 1),
                          (box.left + box.width, box.top + box.height), colour, 1)
    if len(found.x):
        fit = np.polynomial.Polynomial.fit(found.x, found.y, 1)
        ends = [(int(x), round(float(fit(x)))) for x in (r.left, r.left + r.width)]
        cv2.line(shown, ends[0], ends[1], LINE, 2, cv2.LINE_AA)
    for x, y in zip(found.x[::EVERY], found.y[::EVERY], strict=True):
        cv2.circle(shown, (round(x), round(y)), 2, POINT, -1, cv2.LINE_AA)
    said = f"{frame.number}: {frame.time:.3f} s  " + (
        surface.reason or f"{np.degrees(surface.theta):+.2f} deg")
    cv2.rectangle(shown, (0, 0), (shown.shape[1], 20), (255, 255, 255), -1)
    cv2.putText(shown, said, (6, 15), cv2.FONT_HERSHEY_SIMPLEX, 0.45, TEXT, 1, cv2.LINE_AA)
    return shown


class Overlay:
    """A video of the pictures with what was found in them; it has its name when it is whole.

    Args:
        path: Ends in .mp4 or .avi.
        rate: Pictures per second.

    Raises:
        BadRecording: If OpenCV cannot write there.
    """

    def __init__(self, path: str | os.PathLike[str], rate: float):
        self.path = Path(path)
        self.staged = self.path.with_name(f".{secrets.token_hex(4)}{self.path.suffix}")
        self.rate = rate
        self._film: Any = None

    def add(self, picture: Picture) -> None:
        """One more picture (H, W, 3), BGR."""
        import cv2

        if self._film is None:
            code = "mp4v" if self.path.suffix.lower() == ".mp4" else "MJPG"
            self._film = cv2.VideoWriter(str(self.staged), cv2.VideoWriter.fourcc(*code),
                                         self.rate, picture.shape[1::-1])
            if not self._film.isOpened():
                raise errors.BadRecording(errors.cannot_write(str(self.path), "no video there"))
        self._film.write(picture)

    def close(self, done: bool) -> None:
        """Give it its name, or throw it away."""
        if self._film is not None:
            self._film.release()
        try:
            if done and self._film is not None:
                finished(self.staged, self.path)
        finally:
            with suppress(OSError):
                self.staged.unlink()


def stills(film: Film, track: Track, numbers: Collection[int] | None = None) -> Iterator[Still]:
    """Pictures that can be read, and what the whole track says of them, one at a time in memory.

    Args:
        film: The video, which is read once more: which pictures show no surface is known at its
            end only.
        track: What was found in it.
        numbers: Of the pictures that are wanted; all if None.
    """
    tracker = Tracker(track.region, track.colours, track.settings, track.geometry, track.marker)
    with closing(film.frames()) as frames:
        for frame, seen in zip(frames, track.seen, strict=False):
            if frame.picture is None or (numbers is not None and frame.number not in numbers):
                continue
            region, found = tracker.at(seen.shift), NOTHING
            if not seen.surface.reason:
                found, _ = tracker.find(frame.picture, seen.shift)
            yield Still(frame, found, seen.surface, region, _box(track, seen))


def contact_sheet(film: Film, track: Track) -> Figure:
    """Small pictures, evenly over a clip, and the first that failed."""
    good, bad = ([s.number for s in track.seen if bool(s.surface.reason) is failed]
                 for failed in (False, True))
    last = len(good) - 1
    pick = {good[round(last * k / (TILES - 1))] for k in range(TILES)} if good else set()
    shown = [_tile(still, track) for still in stills(film, track, pick | {*bad[:FAILED]})]
    columns = min(4, max(len(shown), 1))  # layout: of four pictures
    rows = max(-(-len(shown) // columns), 1)
    shape = shown[0].shape if shown else (3, 4)
    figure = new_figure(3 * columns, 3 * rows * shape[0] / shape[1])
    for k, tile in enumerate(shown):
        axes = figure.add_subplot(rows, columns, k + 1)
        axes.imshow(tile[..., ::-1])
        axes.set_axis_off()
    return figure


def overlay(path: str | os.PathLike[str], film: Film, track: Track) -> None:
    """A video of the pictures with what was found in them.

    Raises:
        BadRecording: If OpenCV cannot write there.
    """
    shown, done = Overlay(path, film.rate), False
    try:
        for still in stills(film, track):
            shown.add(overlaid(still, track))
        done = True
    finally:
        shown.close(done)


def _box(track: Track, seen: Seen) -> Region | None:
    if track.marker is None or seen.shift is None:
        return None
    return track.marker.area.moved(*seen.shift)


def _tile(still: Still, track: Track) -> Picture:
    import cv2

    drawn = overlaid(still, track)
    height = round(WIDTH * drawn.shape[0] / drawn.shape[1])
    if drawn.shape[1] <= 2 * WIDTH:
        return drawn
    return np.asarray(cv2.resize(drawn, (2 * WIDTH, 2 * height),
                                 interpolation=cv2.INTER_AREA), np.uint8)


def plot(track: Track) -> Figure:
    """Angle and level over time with their 95 % bands, and where pictures failed."""
    figure = new_figure(9.0, 5.0)
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
    degrees = 180 / np.pi
    _banded(upper, track.time, degrees * track.theta, degrees * track.sigma[:, 0])
    level = np.array([s.surface.level for s in track.seen])
    _banded(lower, track.time, level, track.sigma[:, 1])
    bad = [s.time for s in track.seen if s.surface.reason]
    for axes in (upper, lower):
        tidy(axes)
        if bad:
            axes.plot(bad, np.full(len(bad), 0.02), "|", color=COLOURS[1], label="no angle",
                      transform=axes.get_xaxis_transform())
    upper.set_ylabel("theta [deg]")
    lower.set_ylabel(f"level [{'px' if track.geometry is None else 'm'}]")
    lower.set_xlabel("t [s]")
    upper.legend(fontsize="small", frameon=False)
    return figure


def detection(track: Track, stills: Sequence[Still], narrow: bool = False) -> Figure:
    """As Fig. 2 of the paper: a frame with the region, the angle over time, and two frames with
    points of the surface (yellow) and the line (magenta); `narrow`: for a phone.
    """
    figure = new_figure(*(NARROW, 8.0) if narrow else (11.0, 5.2))
    spaces = figure.add_gridspec(*(3, 2) if narrow else (2, 4))
    every = slice(None)
    places = ((0, every), (1, every), (2, 0), (2, 1)) if narrow else (
        (every, slice(0, 2)), (0, slice(2, 4)), (1, 2), (1, 3))
    whole, angle, *parts = (figure.add_subplot(spaces[at]) for at in places)
    r = track.region
    box = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]]) * (r.width, r.height) + (
        r.left - 0.5, r.top - 0.5)
    whole.plot(*box.T, color="red", linewidth=1.5)
    degrees = 180 / np.pi
    _banded(angle, track.time, degrees * track.theta, degrees * track.sigma[:, 0])
    angle.set(xlabel="t [s]", ylabel="theta [deg]")
    tidy(angle)
    for axes, still in zip([whole, *parts], [*stills[:1], *stills], strict=False):
        assert still.frame.picture is not None
        axes.imshow(still.frame.picture[..., ::-1])
        axes.set_axis_off()
    for axes, still, name in zip(parts, stills, "cd", strict=False):
        fit = np.polynomial.Polynomial.fit(still.found.x, still.found.y, 1)
        ends = np.array([r.left, r.left + r.width], float)
        axes.plot(ends, fit(ends), color="magenta", linewidth=2.4)
        axes.plot(still.found.x[::EVERY], still.found.y[::EVERY], ".", color="yellow", markersize=3)
        axes.set(xlim=(r.left - 10, r.left + r.width + 10),
                 ylim=(r.top + r.height, r.top))
        axes.set_title(f"({name}) {still.frame.time:.2f} s, "
                       f"{degrees * still.surface.theta:+.2f}°", fontsize="small")
        angle.axvline(still.frame.time, color=COLOURS[1], linewidth=0.8)
    whole.set_title("(a) frame and region", fontsize="small")
    angle.set_title("(b) angle and its 95 % band", fontsize="small")
    return figure


def _banded(axes: Axes, t: NDArray, values: Sequence[float] | NDArray, sigma: NDArray) -> None:
    axes.fill_between(t, values - WIDE * sigma, values + WIDE * sigma, color=BAND,
                      label="95 % band")
    axes.plot(t, values, color=COLOURS[0], linewidth=1, label="measured")
