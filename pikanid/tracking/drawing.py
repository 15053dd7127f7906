"""What was found, drawn into the pictures: a video, a contact sheet, and the angle over time."""

from __future__ import annotations

import os
import secrets
from collections.abc import Sequence
from contextlib import suppress
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
from pikanid.tracking.frames import Frame
from pikanid.tracking.surface import Surface
from pikanid.tracking.tracked import Track
from pikanid.tracking.video import Tracker

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

POINT, LINE = (0, 255, 255), (255, 0, 255)  # layout: colours, BGR
BOX, TEXT = (0, 0, 255), (0, 0, 0)  # layout: colours, BGR
TILES = 8  # layout: pictures of a contact sheet, besides those that failed
FAILED = 4  # layout: of those
WIDTH = 320  # layout: pixels of a picture on it
EVERY = 6  # layout: columns between two points that are drawn
SHADE = 0.35  # layout: how strongly what counts as liquid is tinted


@dataclass(frozen=True, eq=False)
class Still:
    """A frame that is kept, and what was found in it."""

    frame: Frame
    found: Edges
    surface: Surface


def overlaid(picture: Picture, tracker: Tracker, found: Edges, surface: Surface,
             label: str = "") -> Picture:
    """A picture (H, W, 3), BGR, with the region (red), what counts as liquid (tinted), points of
    the surface (yellow) and the nearest line (magenta).
    """
    import cv2

    from pikanid.tracking.edges import cleaned

    shown = np.ascontiguousarray(picture).copy()
    r = tracker.region
    inside = shown[r.top:r.top + r.height, r.left:r.left + r.width]
    half = cleaned(r.cut(picture), tracker.colours)
    mask = cv2.resize(half, (r.width, r.height), interpolation=cv2.INTER_NEAREST).astype(bool)
    inside[mask] = ((1 - SHADE) * inside[mask] + SHADE * np.array([0, 200, 0])).astype(np.uint8)
    cv2.rectangle(shown, (r.left - 1, r.top - 1), (r.left + r.width, r.top + r.height), BOX, 1)
    if np.isfinite(surface.theta):
        fit = np.polynomial.Polynomial.fit(found.x, found.y, 1)
        ends = [(int(x), round(float(fit(x)))) for x in (r.left, r.left + r.width)]
        cv2.line(shown, ends[0], ends[1], LINE, 2, cv2.LINE_AA)
    for x, y in zip(found.x[::EVERY], found.y[::EVERY], strict=True):
        cv2.circle(shown, (round(x), round(y)), 2, POINT, -1, cv2.LINE_AA)
    said = label + (f"  {np.degrees(surface.theta):+.2f} deg" if not surface.reason else
                    f"  {surface.reason}")
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


class Contacts:
    """Small pictures, evenly over a clip, and the first that failed; few are kept at any time."""

    def __init__(self, tracker: Tracker):
        self.tracker = tracker
        self.every = 1
        self.tiles: list[tuple[int, Picture]] = []
        self.failed: list[tuple[int, Picture]] = []

    def add(self, frame: Frame, found: Edges, surface: Surface) -> None:
        """Look at one more."""
        if frame.picture is None:
            return
        if surface.reason and len(self.failed) < FAILED:
            self.failed.append((frame.number, self._tile(frame, found, surface)))
        elif frame.number % self.every == 0 and not surface.reason:
            self.tiles.append((frame.number, self._tile(frame, found, surface)))
            if len(self.tiles) >= 2 * TILES:
                self.every *= 2
                self.tiles = [t for t in self.tiles if t[0] % self.every == 0]

    def sheet(self) -> Figure:
        """The pictures as a figure."""
        import cv2

        last = len(self.tiles) - 1
        pick = sorted({round(last * k / (TILES - 1)) for k in range(TILES)}) if self.tiles else []
        shown = sorted([*(self.tiles[k] for k in pick), *self.failed], key=lambda tile: tile[0])
        columns = min(4, max(len(shown), 1))  # layout: of four pictures
        rows = max(-(-len(shown) // columns), 1)
        shape = shown[0][1].shape if shown else (3, 4)
        figure = new_figure(3 * columns, 3 * rows * shape[0] / shape[1])
        for k, (_, tile) in enumerate(shown):
            axes = figure.add_subplot(rows, columns, k + 1)
            axes.imshow(cv2.cvtColor(tile, cv2.COLOR_BGR2RGB))
            axes.set_axis_off()
        return figure

    def _tile(self, frame: Frame, found: Edges, surface: Surface) -> Picture:
        import cv2

        assert frame.picture is not None
        label = f"{frame.number}: {frame.time:.3f} s"
        drawn = overlaid(frame.picture, self.tracker, found, surface, label)
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
