"""Figures of fits: measured against fitted, and what is left over.

Every function returns a `matplotlib.figure.Figure` of its own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from pikanid.figures import (
    BAND,
    COLOURS,
    MEASURED,
    NARROW,
    WIDE,
    fewer,
    labelled,
    new_figure,
    stroke,
    tidy,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Beyond this many samples markers merge into a band: draw a thin line instead.
MANY = 2000  # layout: samples of an output


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

    @property
    def spread(self) -> np.ndarray | None:
        """Standard deviation of `fitted` (N,) by the parameters' covariance, or None."""


def plot_fits(fits: Sequence[FitLike], title: str = "", narrow: bool = False) -> Figure:
    """Measured against fitted (left) and the residual (right), a row for every output.

    The grey band of the residual is ±2σ where the noise σ is known.  In the coloured band around
    the fit 95 % of the samples are expected: by the parameters' covariance, to first order, and
    the noise.

    >>> from types import SimpleNamespace
    >>> t = np.linspace(0, 1, 50)
    >>> fit = SimpleNamespace(recording="run", output="theta", unit="rad", t=t,
    ...                       measured=np.sin(t), fitted=np.sin(t), sigma=None, spread=None)
    >>> [axes.get_ylabel() for axes in plot_fits([fit]).axes]
    ['theta [rad]', 'residual [rad]']
    """
    return plot_strategies({"fitted": fits}, title, narrow)


def plot_strategies(fits: Mapping[str, Sequence[FitLike]], title: str = "", narrow: bool = False
                    ) -> Figure:
    """As `plot_fits`, with one colour for every strategy; all of them fitted the same samples.

    Args:
        fits: Name in the legend -> fits, in the same order for every name.
        title: Of the whole figure.
        narrow: For a phone: the residual below.
    """
    rows = list(zip(*fits.values(), strict=True))
    figure = new_figure(NARROW if narrow else 11.0,
                        0.7 + (4.4 if narrow else 2.7) * max(len(rows), 1))
    if title:
        figure.suptitle(title, fontsize="medium")
    if not rows:
        return figure
    shape = (2 * len(rows), 1) if narrow else (len(rows), 2)
    grid = figure.subplots(*shape, squeeze=False).reshape(len(rows), 2)
    several = len({fit.recording for fit, *_ in rows}) > 1
    for row, (left, right) in zip(rows, grid, strict=True):
        right.sharex(left)
        _curves(left, dict(zip(fits, row, strict=True)))
        _residuals(right, dict(zip(fits, row, strict=True)))
        if several:
            right.set_title(row[0].recording.replace("$", r"\$"), fontsize="small", loc="left")
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
        if len(fits) == 1:
            _band(axes, fit, order)
        axes.plot(fit.t[order], fit.fitted[order], label=name, **stroke(k, 0.7))
    axes.set_ylabel(labelled(first.output, first.unit))
    # Above the axes: inside, a legend would cover an oscillation somewhere.
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), fontsize="small",
                ncols=fewer(axes.figure, len(fits) + 2, 3), frameon=False, borderaxespad=0.1,
                handlelength=1.4)
    tidy(axes)


def _band(axes: Axes, fit: FitLike, order: np.ndarray) -> None:
    """Where 95 % of the samples are expected, by the parameters' covariance and the noise; where
    that is not known, the fit of other recordings like this one.
    """
    if fit.spread is None:
        return
    noise = 0.0 if fit.sigma is None else fit.sigma
    wide = (WIDE * np.hypot(fit.spread, noise))[order]
    axes.fill_between(fit.t[order], fit.fitted[order] - wide, fit.fitted[order] + wide, alpha=0.25,
                      color=COLOURS[0], linewidth=0,
                      label="95 % band" if fit.sigma is not None else "95 % of the parameters")


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
