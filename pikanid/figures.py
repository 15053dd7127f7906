"""The look that all figures share, and figures as the content of files.

Every function returns a `matplotlib.figure.Figure` of its own and leaves pyplot, its list of open
figures and matplotlib's settings alone.
"""

from __future__ import annotations

import base64
import io
import os
import re
import textwrap
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from pikanid import errors
from pikanid.storage.outputs import atomically

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, FigureBase

# Okabe & Ito, Color Universal Design (2008): told apart by colour-blind readers, too.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
MEASURED = "#555555"
BAND = "#BBBBBB"
POWERS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
ENDINGS = (".png", ".svg", ".pdf")
# Curves that lie upon each other stay visible: later ones are thinner, and their gaps differ.
WIDTHS = (2.2, 1.7, 1.3, 1.0, 0.8, 0.7)  # layout: line widths, in points
DASHES = ("-", (0, (5, 3)), (0, (2, 2)), (0, (6, 2, 1, 2)), (0, (1, 3)),
          (0, (8, 4)))  # layout: dashes and gaps, in line widths
WIDE = 1.96  # definition: standard deviations of a 95 % band
NARROW = 3.8  # layout: width of a figure for a phone, in inches
BREAK = 40  # layout: characters of a line of its titles
DPI = 130  # layout: pixels an inch


def labelled(name: str, unit: str) -> str:
    """An axis label; `$` and the like in a name mean themselves.

    >>> labelled("theta", "rad"), labelled("x", "")
    ('theta [rad]', 'x [-]')
    """
    return f"{name} [{unit_text(unit) or '-'}]".replace("$", r"\$")


def unit_text(unit: str) -> str:
    """A unit as it is printed; nothing where there is none.

    >>> unit_text("N*s/m"), unit_text("1/(s*(rad)^2)"), unit_text("m/s**2")
    ('N·s/m', '1/(s·rad²)', 'm/s²')
    """
    if unit == "1":
        return ""
    plain = re.sub(r"\((\w+)\)", r"\1", unit).replace("**", "^").replace("*", "·")
    return re.sub(r"\^(-?\d+)", lambda found: found[1].translate(POWERS), plain)


def fewer(figure: FigureBase, columns: int, narrow: int = 2) -> int:
    """Columns of a legend: those given, fewer on a phone."""
    return min(columns, narrow) if is_narrow(figure) else columns


def is_narrow(figure: FigureBase) -> bool:
    """Whether a figure, or that which it is a part of, is one for a phone.

    >>> is_narrow(new_figure(NARROW, 3.0)), is_narrow(new_figure(9.0, 3.0))
    (True, False)
    """
    return bool(figure.get_figure(root=True).get_figwidth() <= NARROW)


def broken(title: str, figure: FigureBase) -> str:
    """A title, on a phone in several lines; `$` means itself."""
    lines = textwrap.wrap(title, BREAK) if is_narrow(figure) else [title]
    return "\n".join(lines).replace("$", r"\$")


def tidy(axes: Axes) -> None:
    """The look that all figures share."""
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(True, linewidth=0.4, alpha=0.5)
    axes.tick_params(labelsize="small")
    axes.margins(x=0.01)


def stroke(k: int, scale: float = 1.0) -> dict[str, Any]:
    """Colour, width and dashes of the k-th curve that shows the same quantity.

    >>> stroke(0)["color"]
    '#0072B2'
    """
    k %= len(COLOURS)
    return {"color": COLOURS[k], "linewidth": scale * WIDTHS[k], "linestyle": DASHES[k]}


def new_figure(width: float, height: float, layout: Literal["constrained"] | None = "constrained",
               dpi: float | None = None) -> Figure:
    """An empty figure [inch] that pyplot knows nothing of and that a notebook shows.

    >>> new_figure(4.0, 3.0)._repr_png_()[1:4]
    b'PNG'
    """
    return _shown()(figsize=(width, height), layout=layout, dpi=dpi)


def image(figure: Figure, ending: str = ".png", dpi: float = DPI,
          transparent: bool = False) -> bytes:
    """A figure as the content of an image file, without the date."""
    buffer = io.BytesIO()
    dates = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}, ".png": {}}[ending]
    figure.savefig(buffer, format=ending[1:], dpi=dpi, metadata=dates, transparent=transparent)
    return buffer.getvalue()


def embedded(figure: Figure, shows: str, dpi: float) -> str:
    """A figure as a piece of HTML that needs no other file."""
    data = base64.b64encode(image(figure, dpi=dpi)).decode()
    return f'<img alt="{shows}" src="data:image/png;base64,{data}">'


def save_figure(figure: Figure, path: str | os.PathLike[str]) -> None:
    """Write a figure to a .png, .svg or .pdf file, atomically.

    Raises:
        BadSetting: The name ends otherwise.
        BadRecording: The place cannot be written to.
    """
    atomically(path, image_for(figure, path))


def image_for(figure: Figure, path: str | os.PathLike[str]) -> bytes:
    """What `save_figure` writes to `path`.

    Raises:
        BadSetting: The name ends neither in .png nor in .svg nor in .pdf.
    """
    ending = Path(path).suffix.lower()
    if ending not in ENDINGS:
        raise errors.BadSetting(errors.output_ending("The figure", str(path), ENDINGS))
    return image(figure, ending)


@cache
def _shown() -> type[Figure]:
    """Figure with the method by which notebooks show an object; made when matplotlib is needed."""
    from matplotlib.figure import Figure as Plain

    class Figure(Plain):
        def _repr_png_(self) -> bytes:
            return image(self)

    return Figure
