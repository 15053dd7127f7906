"""`pikanid track`: a video in, a recording with an uncertainty for every frame out."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from pikanid import errors
from pikanid.commands.interrupts import interrupted_by_kill
from pikanid.commands.options import Json, Quiet, assignments, quantity
from pikanid.commands.outputs import STDOUT, check_outputs, written
from pikanid.figures import ENDINGS
from pikanid.recording.formats import written_endings

if TYPE_CHECKING:
    from pikanid.tracking.geometry import Geometry
    from pikanid.tracking.region import Region
    from pikanid.tracking.tracked import Track

FILMS = (".mp4", ".avi")
UNEVEN = 0.05  # numerical: by which sides of a square pixel may differ
SMOOTH = ("Text files do not say that 'u_x' runs smoothly between its samples: write .parquet, or "
          "give the model hold = \"cubic\".")
EXAMPLES = """Examples:

  pikanid track run.mp4 --out run.csv

  pikanid track run.mp4 --out run.csv --motion shuttle.csv --column u_x=acc --delay 12ms

  pikanid track run.mp4 --out run.parquet --marker 180,20,40,40 --pixel 0.22mm

  pikanid track images/ --rate 240 --out run.csv --roi 170,120,300,330 --plot theta.png

  pikanid track run.mp4 --out run.csv --corners "168,60 471,66 470,452 170,448"
  --tank 66mm,90mm --contact-sheet sheet.png --overlay overlay.mp4

Frames without an angle are empty cells; --json says why, and where the tank was. An interrupted
run goes on where it stopped when it is repeated."""


def track(
    video: Annotated[str, typer.Argument(
        metavar="VIDEO", show_default=False, help="video, or folder of numbered images")],
    out: Annotated[str, typer.Option(
        "--out", "-o", metavar="FILE", show_default=False,
        help=f"recording to write ({', '.join(written_endings())})")],
    rate: Annotated[float | None, typer.Option(
        metavar="HZ", show_default=False,
        help="the camera's frames per second, where the file plays slower or does not say")] = None,
    roi: Annotated[str | None, typer.Option(
        metavar="LEFT,TOP,WIDTH,HEIGHT", show_default=False,
        help="the tank's inside [px]; proposed if not given")] = None,
    colour: Annotated[str | None, typer.Option(
        metavar="SPACE:RANGES", show_default=False,
        help="of the liquid, as hsv:95..130,80..255,40..255; learned if not given")] = None,
    corners: Annotated[str | None, typer.Option(
        metavar="X,Y X,Y X,Y X,Y", show_default=False,
        help="of the tank's inside in the picture, from upper left clockwise [px]")] = None,
    tank: Annotated[str | None, typer.Option(
        metavar="WIDTH,HEIGHT", show_default=False,
        help="between these corners, or of --roi, as 66mm,90mm")] = None,
    lens: Annotated[float, typer.Option(
        metavar="K", help="radial distortion, with --corners")] = 0.0,
    flip: Annotated[bool, typer.Option(
        "--flip", help="the picture's left is the model's positive direction")] = False,
    motion: Annotated[str | None, typer.Option(
        metavar="FILE", show_default=False, help="recording of what moved the tank")] = None,
    column: Annotated[list[str], typer.Option(
        "--column", metavar="NAME=COLUMN", show_default=False,
        help="column of --motion that holds an acceleration")] = [],  # noqa: B006
    position: Annotated[list[str], typer.Option(
        "--position", metavar="NAME=COLUMN", show_default=False,
        help="column of --motion that holds a position, of which NAME is the acceleration"
    )] = [],  # noqa: B006
    marker: Annotated[str | None, typer.Option(
        metavar="LEFT,TOP,WIDTH,HEIGHT", show_default=False,
        help="a patch with texture in the first picture, which is followed instead of --motion [px]"
    )] = None,
    marker_on: Annotated[Literal["tank", "background"], typer.Option(
        "--marker-on", help="what it is on: the tank, before a camera that stands, or the "
        "background of one that moves with the tank")] = "tank",
    pixel: Annotated[str | None, typer.Option(
        metavar="LENGTH", show_default=False,
        help="of a pixel at the marker, as 0.22mm; by --tank if not given")] = None,
    delay: Annotated[str, typer.Option(
        metavar="TIME", help="when the motion's clock begins on the camera's, as 12ms")] = "0s",
    plot: Annotated[str | None, typer.Option(
        metavar="FILE", show_default=False, help="figure of the angle over time")] = None,
    contact_sheet: Annotated[str | None, typer.Option(
        "--contact-sheet", metavar="FILE", show_default=False,
        help="figure of some frames with what was found in them")] = None,
    overlay: Annotated[str | None, typer.Option(
        metavar="FILE", show_default=False, help="video of what was found in every frame")] = None,
    json_: Json = None,
    quiet: Quiet = False,
) -> int:
    """Measure a liquid's surface in every frame of a video."""
    check_outputs({"--out": (out, written_endings()), "--plot": (plot, ENDINGS),
                   "--contact-sheet": (contact_sheet, ENDINGS), "--overlay": (overlay, FILMS),
                   "--json": (json_, [".json"])}, [video, *([motion] if motion else [])])
    from pikanid.figures import image_for
    from pikanid.recording.writing import content
    from pikanid.tracking import drawing
    from pikanid.tracking.colours import ColourRange
    from pikanid.tracking.frames import open_film
    from pikanid.tracking.motion import with_motion
    from pikanid.tracking.region import Region
    from pikanid.tracking.video import track as run

    late = quantity(delay, "s", "--delay")
    accelerations = assignments("--column", column, "u_x=acc")
    positions = assignments("--position", position, "u_x=x")
    if motion is None and (accelerations or positions or late):
        raise errors.BadSetting(errors.no_motion())
    if marker is not None and motion is not None:
        raise errors.BadSetting(errors.marker_or_motion())
    region = None if roi is None else Region(*_numbers("--roi", roi, 4))
    follow = None if marker is None else (Region(*_numbers("--marker", marker, 4)), marker_on)
    within = None if colour is None else ColourRange.parse(colour)
    film = open_film(video, rate)
    geometry = _geometry(corners, tank, lens, film.size, marker is not None)
    length = _pixel(pixel, tank, region, geometry is not None, marker is not None)
    journal = Path(out).with_name(f".{Path(out).name}.frames")
    begun = time.perf_counter()
    with interrupted_by_kill(), _counting(film.promised, quiet) as step:
        found = run(video, rate, region, within, geometry, flip, journal=journal, step=step,
                    follow=follow, pixel=length)
    seconds = time.perf_counter() - begun
    recording = found.recording()
    if motion is not None:
        recording = with_motion(recording, motion, accelerations, positions, late)
    notes = recording.notes
    if marker is not None and not out.endswith((".parquet", ".pq")):
        notes += (SMOOTH,)
    files = {out: content(recording.channels, out)}
    if plot is not None:
        files[plot] = image_for(drawing.plot(found), plot)
    if contact_sheet is not None:
        files[contact_sheet] = image_for(drawing.contact_sheet(film, found), contact_sheet)
    if overlay is not None:
        drawing.overlay(overlay, film, found)
    written(files, json_, {"schema_version": 1, "video": found.name, **found.summary()})
    if not quiet and json_ != STDOUT:
        _show(found, notes, [*files, *([overlay] if overlay else [])], seconds)
    return 0


def _geometry(corners: str | None, tank: str | None, lens: float, size: tuple[int, int],
              others: bool) -> Geometry | None:
    from pikanid.tracking.geometry import from_corners

    if corners is None:
        if lens or (tank is not None and not others):
            raise errors.BadSetting(errors.corners_and_tank())
        return None
    if tank is None:
        raise errors.BadSetting(errors.corners_and_tank())
    points = [_numbers("--corners", pair, 2, float) for pair in corners.split()]
    if len(points) != 4:
        raise errors.BadSetting(errors.corners_and_tank())
    return from_corners(points, *_lengths(tank), size, lens)


def _pixel(pixel: str | None, tank: str | None, region: Region | None, straightened: bool,
           followed: bool) -> float | None:
    """Length of a pixel [m] at the marker, where these words tell it."""
    if pixel is not None:
        if not followed:
            raise errors.BadSetting(errors.pixel_without_marker())
        return quantity(pixel, "m", "--pixel")
    if not followed or straightened or tank is None or region is None:
        return None
    width, height = _lengths(tank)
    across, down = width / region.width, height / region.height
    if not (across > 0 and abs(down / across - 1) <= UNEVEN):
        raise errors.BadSetting(errors.uneven_pixels(across, down))
    return across


def _lengths(tank: str) -> tuple[float, float]:
    lengths = [quantity(text, "m", "--tank") for text in tank.split(",")]
    if len(lengths) != 2:
        raise errors.BadSetting(errors.corners_and_tank())
    return lengths[0], lengths[1]


def _numbers(option: str, text: str, count: int, kind: type = int) -> list[Any]:
    try:
        found = [kind(part) for part in text.split(",")]
    except ValueError:
        found = []
    if len(found) != count:
        raise errors.BadSetting(errors.not_so_many_numbers(option, text, count))
    return found


@contextmanager
def _counting(total: int, quiet: bool) -> Iterator[Callable[[int], None]]:
    """A bar on standard error with frames per second; nothing where nobody watches."""
    from pikanid.reporting.console import console

    screen = console(sys.stderr)
    if quiet or not screen.is_terminal:
        yield lambda number: None
        return
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    begun, before = time.perf_counter(), [0, 0.0]
    columns = (TextColumn("frames"), BarColumn(), TextColumn("{task.completed}/{task.total}"),
               TextColumn("{task.fields[speed]:.0f}/s"), TimeRemainingColumn())
    with Progress(*columns, console=screen, transient=True) as progress:
        task = progress.add_task("frames", total=total or None, speed=0.0)

        def step(number: int) -> None:
            spent = time.perf_counter() - begun
            first = before[0] or number - 1  # what a stopped run had found is no speed
            before[0] = first
            if spent - before[1] > 0.1:
                before[1] = spent
                progress.update(task, completed=number, speed=(number - first) / spent)

        yield step


def _show(found: Track, notes: tuple[str, ...], files: list[str], seconds: float) -> None:
    import numpy as np

    from pikanid.reporting.console import console

    screen = console()
    about = found.summary()
    r = found.region
    degrees = 180 / np.pi
    lines = [f"{found.name}: {about['frames']} frames at {found.rate:g} per second, "
             f"{about['angles']} with an angle; {about['frames'] / seconds:.0f} frames/s",
             f"region: {r.left},{r.top},{r.width},{r.height}",
             f"theta: {degrees * np.nanmin(found.theta):.3g} to "
             f"{degrees * np.nanmax(found.theta):.3g} deg, standard error "
             f"{degrees * about['sigma_median']:.2g} deg (median), "
             f"{degrees * about['sigma_largest']:.2g} deg (largest)",
             *_followed(found),
             *(f"note: {note}" for note in notes), *(f"written: {path}" for path in files)]
    for line in lines:
        screen.print(line, markup=False, soft_wrap=True)


def _followed(found: Track) -> list[str]:
    import numpy as np

    if found.marker is None:
        return []
    where, sigma = (a[:, 0] for a in found.motion)
    return [f"x: {1e3 * np.nanmin(where):.4g} to {1e3 * np.nanmax(where):.4g} mm, standard error "
            f"{1e3 * np.nanmedian(sigma):.2g} mm (median), by the marker on the {found.marker.on}"]
