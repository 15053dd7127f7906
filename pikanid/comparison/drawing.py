"""Figures of a comparison."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from pikanid.figures import (
    BAND,
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
    from matplotlib.figure import Figure

    from pikanid.comparison.predictions import Prediction

MANY = 2000  # layout: samples beyond which markers merge: then a thin line


def plot_validation(predictions: Mapping[str, Sequence[Prediction]], narrow: bool = False
                    ) -> Figure:
    """Measured against predicted (left) and the errors (right); the first model is the best.

    Around the prediction of the best model lies its 95 % band: what the parameters' covariance and
    the noise allow a measured sample.  The grey band of the errors is ±2σ of the noise.
    With `narrow`, for a phone, the errors lie below.
    """
    rows = list(zip(*predictions.values(), strict=True))
    figure = new_figure(NARROW if narrow else 11.0, 0.8 + (4.4 if narrow else 2.8) * len(rows))
    shape = (2 * len(rows), 1) if narrow else (len(rows), 2)
    grid = figure.subplots(*shape, squeeze=False).reshape(len(rows), 2)
    several = len({row[0].recording for row in rows}) > 1
    for (left, right), row in zip(grid, rows, strict=True):
        first = row[0]
        right.sharex(left)
        style = ({"marker": ".", "markersize": 4, "linestyle": "none"}
                 if len(first.t) <= MANY else {"linewidth": 1.6})
        left.plot(first.t, first.measured, color=MEASURED, label="measured", zorder=1, **style)
        if first.spread is not None:
            wide = WIDE * np.hypot(first.spread, first.sigma)
            left.fill_between(first.t, first.predicted - wide, first.predicted + wide, alpha=0.25,
                              color=stroke(0)["color"], linewidth=0, label="95 % band", zorder=2)
        right.fill_between(first.t, -2 * first.sigma, 2 * first.sigma, color=BAND, alpha=0.5,
                           linewidth=0, label="±2σ of the noise")
        for k, p in enumerate(row):
            left.plot(p.t, p.predicted, label=p.model, zorder=3, **stroke(k, 0.7))
            right.plot(p.t, p.residual, **stroke(k, 0.45))
        right.axhline(0.0, color="black", linewidth=0.6)
        span = np.ptp(first.measured) or 1.0
        low, high = left.get_ylim()  # a model gone astray must not flatten what was measured
        left.set_ylim(max(low, first.measured.min() - span), min(high, first.measured.max() + span))
        low, high = right.get_ylim()
        right.set_ylim(max(low, -1.5 * span), min(high, 1.5 * span))
        left.set_ylabel(labelled(first.output, first.unit))
        right.set_ylabel(labelled("error", first.unit))
        tidy(left)
        tidy(right)
        if several:
            right.set_title(first.recording, fontsize="small", loc="right")
    handles = [h for axes in grid[0] for h in axes.get_legend_handles_labels()[0]]
    figure.legend(handles=handles, loc="outside upper left",
                  ncols=fewer(figure, 6), frameon=False, fontsize="small",
                  handlelength=1.6, columnspacing=1.2)
    for axes in grid[-1]:
        axes.set_xlabel("time [s]")
    return figure
