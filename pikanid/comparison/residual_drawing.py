"""The figure of a residual analysis: one panel a question, each with what noise allows."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from pikanid.comparison.correlations import Correlation
from pikanid.comparison.dependence import Dependence
from pikanid.comparison.spectrum import Spectrum
from pikanid.comparison.whitened import White
from pikanid.figures import (
    BAND,
    COLOURS,
    MEASURED,
    NARROW,
    broken,
    labelled,
    new_figure,
    tidy,
    unit_text,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ACROSS = 3  # layout: panels side by side
MANY = 3000  # layout: points that are drawn at most


def plot_residual(title: str, white: White, auto: Correlation, cross: Mapping[str, Correlation],
                  spectrum: Spectrum | None, dependences: Sequence[Dependence], alpha: float,
                  unit: str = "", narrow: bool = False) -> Figure:
    """Autocorrelation, cross-correlation with every input, spectrum, coherence, normal quantiles,
    and the residual against every state and input; grey is where 1 - α of the values of a right
    model lie.

    Args:
        title: Of the figure.
        white: The whitened residual.
        auto, cross, spectrum, dependences: See `pikanid.comparison.residual_analysis`.
        alpha: Probability outside of each band.
        unit: Of the output.
        narrow: For a phone: the panels in one column.
    """
    panels: list[Callable[[Axes], None]] = [
        partial(_correlation, found=auto, label="autocorrelation", alpha=alpha)]
    panels += [partial(_correlation, found=c, label=f"correlation with {name}", alpha=alpha)
               for name, c in cross.items()]
    panels.append(partial(_quantiles, white=white, alpha=alpha))
    if spectrum is not None:
        panels.append(partial(_power, found=spectrum, unit=unit))
        if spectrum.coherence:
            panels.append(partial(_coherence, found=spectrum))
    panels += [partial(_dependence, found=d, white=white, alpha=alpha) for d in dependences]
    across = 1 if narrow else ACROSS
    rows = -(-len(panels) // across)
    figure = new_figure(NARROW if narrow else 12.0, 0.6 + (2.0 if narrow else 2.7) * rows)
    grey = f"grey: {100 * (1 - alpha):g} % of a right model's"
    figure.suptitle(broken(f"{title} ({grey})", figure), fontsize="medium")
    axes = figure.subplots(rows, across, squeeze=False).ravel()
    for draw, own in zip(panels, axes, strict=False):
        draw(own)
        tidy(own)
    for own in axes[len(panels):]:
        own.remove()
    return figure


def _wide(alpha: float) -> float:
    from scipy.stats import norm

    return float(norm.ppf(1 - alpha / 2))


def _correlation(axes: Axes, found: Correlation, label: str, alpha: float) -> None:
    half = _wide(alpha) * found.std
    axes.fill_between(found.lags, found.mean - half, found.mean + half, color=BAND, alpha=0.6,
                      linewidth=0, step="mid")
    outside = np.abs(found.values - found.mean) > half
    axes.vlines(found.lags, 0, found.values, color=COLOURS[0], linewidth=1.0)
    for there, colour in ((~outside, COLOURS[0]), (outside, COLOURS[1])):
        axes.plot(found.lags[there], found.values[there], ".", color=colour, markersize=5)
    axes.axhline(0.0, color="black", linewidth=0.6)
    axes.set_xlabel("lag [samples]")
    axes.set_ylabel(label.replace("$", r"\$"))


def _quantiles(axes: Axes, white: White, alpha: float) -> None:
    from scipy.stats import beta, norm

    n = len(white.r)
    order = np.arange(1, n + 1)
    expected = np.asarray(norm.ppf((order - 0.375) / (n + 0.25)))  # Blom's positions
    low, high = (np.asarray(norm.ppf(beta.ppf(q, order, n + 1 - order)))
                 for q in (alpha / 2, 1 - alpha / 2))
    few = np.unique(np.concatenate([np.arange(min(n, 50)), np.arange(max(n - 50, 0), n),
                                    np.linspace(0, n - 1, min(n, MANY)).astype(int)]))
    axes.fill_between(expected[few], low[few], high[few], color=BAND, alpha=0.6, linewidth=0)
    axes.plot(expected[few], np.sort(white.r / white.scale)[few], ".", color=COLOURS[0],
              markersize=3)
    axes.plot(expected[[0, -1]], expected[[0, -1]], color="black", linewidth=0.6)
    axes.set_xlabel("normal quantile")
    axes.set_ylabel("residual [s.d.]")


def _power(axes: Axes, found: Spectrum, unit: str) -> None:
    axes.fill_between(found.frequency, found.low * found.noise, found.high * found.noise,
                      color=BAND, alpha=0.6, linewidth=0)
    axes.plot(found.frequency, found.power, color=COLOURS[0], linewidth=1.2)
    axes.set_yscale("log")
    axes.set_xlabel("frequency [Hz]")
    axes.set_ylabel(labelled("power density", f"{unit_text(unit)}²/Hz" if unit else "1/Hz"))


def _coherence(axes: Axes, found: Spectrum) -> None:
    axes.axhspan(0, found.limit, color=BAND, alpha=0.6, linewidth=0)
    for k, (name, gamma) in enumerate(found.coherence.items()):
        axes.plot(found.frequency, gamma, color=COLOURS[k % len(COLOURS)], linewidth=1.2,
                  label=name.replace("$", r"\$"))
    axes.set_ylim(0, 1)
    axes.set_xlabel("frequency [Hz]")
    axes.set_ylabel("coherence γ²")
    if len(found.coherence) > 1:
        axes.legend(loc="upper right", fontsize="small", frameon=False)
    else:
        axes.set_ylabel(f"coherence γ² with {next(iter(found.coherence))}".replace("$", r"\$"))


def _dependence(axes: Axes, found: Dependence, white: White, alpha: float) -> None:
    few = np.unique(np.linspace(0, len(white.r) - 1, min(len(white.r), MANY)).astype(int))
    axes.plot(found.values[few], white.r[few] / white.scale, ".", color=MEASURED, markersize=2,
              alpha=0.35, rasterized=len(few) > 500)
    half = _wide(alpha) * found.std
    axes.fill_between(found.centres, -half, half, color=BAND, alpha=0.9, linewidth=0, zorder=2.5)
    axes.plot(found.centres, found.means, color=COLOURS[1], marker="o", markersize=3, linewidth=1.2,
              zorder=3)
    axes.locator_params(axis="x", nbins=5)
    axes.set_xlabel(labelled(found.name, found.unit))
    axes.set_ylabel("residual [s.d.]")
