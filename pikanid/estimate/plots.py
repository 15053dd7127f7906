"""Figures of fits: measured against fitted, and what is left over.

Every function returns a `matplotlib.figure.Figure` of its own and leaves pyplot, its list of open
figures and matplotlib's settings alone.
"""

from __future__ import annotations

import base64
import io
import os
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Protocol

import numpy as np

from pikanid import errors
from pikanid.storage.outputs import atomically

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Okabe & Ito, Color Universal Design (2008): told apart by colour-blind readers, too.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
MEASURED = "#555555"
BAND = "#BBBBBB"
ENDINGS = (".png", ".svg", ".pdf")
# Curves that lie upon each other stay visible: later ones are thinner, and their gaps differ.
WIDTHS = (2.2, 1.7, 1.3, 1.0, 0.8, 0.7)  # layout: line widths, in points
DASHES = ("-", (0, (5, 3)), (0, (2, 2)), (0, (6, 2, 1, 2)), (0, (1, 3)),
          (0, (8, 4)))  # layout: dashes and gaps, in line widths
# Beyond this many samples markers merge into a band: draw a thin line instead.
MANY = 2000  # layout: samples of an output
DPI = 130  # layout: pixels an inch


class FitLike(Protocol):
    """What is drawn of one output of one recording: see `pikanid.estimate.Fit`."""

    @property
    def recording(self) -> str:
        """Name of the recording."""

    @property
    def output(self) -> str:
        """Name of the output."""

    @property
    def unit(self) -> str:
        """Unit of the output."""

    @property
    def t(self) -> np.ndarray:
        """Times (N,) [s]."""

    @property
    def measured(self) -> np.ndarray:
        """Samples (N,)."""

    @property
    def fitted(self) -> np.ndarray:
        """What the model says (N,)."""

    @property
    def sigma(self) -> np.ndarray | None:
        """Standard deviation of the noise (N,), or None."""


def plot_fits(fits: Sequence[FitLike], title: str = "") -> Figure:
    """Measured against fitted (left) and the residual (right), a row for every output.

    The grey band of the residual is ±2σ where the noise σ is known.

    >>> from types import SimpleNamespace
    >>> t = np.linspace(0, 1, 50)
    >>> fit = SimpleNamespace(recording="run", output="theta", unit="rad", t=t,
    ...                       measured=np.sin(t), fitted=np.sin(t), sigma=None)
    >>> [axes.get_ylabel() for axes in plot_fits([fit]).axes]
    ['theta [rad]', 'residual [rad]']
    """
    return plot_strategies({"fitted": fits}, title)


def plot_strategies(fits: Mapping[str, Sequence[FitLike]], title: str = "") -> Figure:
    """As `plot_fits`, with one colour for every strategy; all of them fitted the same samples.

    Args:
        fits: Name in the legend -> fits, in the same order for every name.
        title: Of the whole figure.
    """
    rows = list(zip(*fits.values(), strict=True))
    figure = new_figure(11.0, 0.7 + 2.7 * max(len(rows), 1))
    if title:
        figure.suptitle(title, fontsize="medium")
    if not rows:
        return figure
    grid = figure.subplots(len(rows), 2, squeeze=False, sharex="row")
    several = len({fit.recording for fit, *_ in rows}) > 1
    for row, (left, right) in zip(rows, grid, strict=True):
        _curves(left, dict(zip(fits, row, strict=True)))
        _residuals(right, dict(zip(fits, row, strict=True)))
        if several:
            left.set_title(row[0].recording, fontsize="small", loc="left")
    for axes in grid[-1]:
        axes.set_xlabel("time [s]")
    return figure


def _curves(axes: Axes, fits: Mapping[str, FitLike]) -> None:
    first = next(iter(fits.values()))
    order = np.argsort(first.t, kind="stable")
    style: dict[str, Any] = (
        {"marker": ".", "markersize": 4, "linestyle": "none"}
        if len(first.t) <= MANY else {"linewidth": 1.6})
    axes.plot(first.t[order], first.measured[order], color=MEASURED, label="measured", **style)
    for k, (name, fit) in enumerate(fits.items()):
        order = np.argsort(fit.t, kind="stable")
        axes.plot(fit.t[order], fit.fitted[order], label=name, **stroke(k, 0.7))
    axes.set_ylabel(labelled(first.output, first.unit))
    # Above the axes: inside, a legend would cover an oscillation somewhere.
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=len(fits) + 1, frameon=False,
                fontsize="small", borderaxespad=0.1, handlelength=1.4)
    tidy(axes)


def _residuals(axes: Axes, fits: Mapping[str, FitLike]) -> None:
    first = next(iter(fits.values()))
    order = np.argsort(first.t, kind="stable")
    if first.sigma is not None:
        spread = 2 * first.sigma[order]
        axes.fill_between(first.t[order], -spread, spread, color=BAND, alpha=0.5, linewidth=0,
                          label="±2σ of the noise")
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), frameon=False, fontsize="small",
                    borderaxespad=0.1, handlelength=1.4)
    for k, fit in enumerate(fits.values()):
        order = np.argsort(fit.t, kind="stable")
        axes.plot(fit.t[order], (fit.measured - fit.fitted)[order], **stroke(k, 0.45))
    axes.axhline(0.0, color="black", linewidth=0.6)
    axes.set_ylabel(labelled("residual", first.unit))
    tidy(axes)


def labelled(name: str, unit: str) -> str:
    """An axis label; `$` and the like in a name mean themselves.

    >>> labelled("theta", "rad"), labelled("x", "")
    ('theta [rad]', 'x [-]')
    """
    return f"{name} [{unit or '-'}]".replace("$", r"\$")


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


def image(figure: Figure, ending: str = ".png", dpi: float = DPI) -> bytes:
    """A figure as the content of an image file, without the date."""
    buffer = io.BytesIO()
    dates = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}, ".png": {}}[ending]
    figure.savefig(buffer, format=ending[1:], dpi=dpi, metadata=dates)
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
