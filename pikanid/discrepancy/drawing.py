"""Edges drawn, and the same as a piece of HTML."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import TYPE_CHECKING

import numpy as np

from pikanid.discrepancy.edge import Edge
from pikanid.figures import embedded, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LINE, FAINT, BAND = "#0072B2", "#777777", "#BBBBBB"


def draw(edges: Sequence[Edge], title: str) -> Figure:
    """One axes an edge: value, 95 % band, and below it how often each value was visited."""
    count = len(edges)
    figure = new_figure(4.0 * count, 3.6)
    for k, edge in enumerate(edges):
        axes = figure.add_subplot(1, count, k + 1)
        colour = LINE if edge.significant else FAINT
        low, high = edge.band
        axes.fill_between(edge.grid, low, high, color=BAND, alpha=0.6, linewidth=0)
        # a step is drawn as a gap, not as a steep line
        jump = np.zeros(len(edge.grid), bool)
        if edge.step is not None:
            jump[1:] = np.sign(edge.grid[1:]) != np.sign(edge.grid[:-1])
        axes.plot(edge.grid, np.where(jump, np.nan, edge.values), color=colour)
        axes.axhline(0.0, color="black", linewidth=0.6)
        seen = np.random.default_rng(0).permutation(edge.gauge.a)[:400]
        axes.plot(seen, np.zeros_like(seen), "|", color="black", alpha=0.15, markersize=8,
                  transform=axes.get_xaxis_transform())
        axes.set_xlabel(edge.argument)
        axes.set_ylabel(f"δ [{edge.unit}]" if k == 0 else "")
        verdict = "significant" if edge.significant else "nothing significant"
        axes.set_title(f"{verdict}, p = {edge.p_value:.2g}", fontsize=10)
    figure.suptitle(title)
    return figure


def page(edges: Sequence[Edge], title: str, sentence: str, figure: Figure) -> str:
    """Table, sentence and drawing as HTML."""
    rows = "".join(
        f"<tr><td>{escape(e.argument)}</td><td>{e.range[0]:.4g} ... {e.range[1]:.4g}</td>"
        f"<td>{np.max(np.abs(e.values)):.3g} {escape(e.unit)}</td><td>{e.p_value:.2g}</td>"
        f"<td>{'yes' if e.significant else 'no'}</td></tr>" for e in edges)
    return (f"<b>{escape(title)}</b><table><tr><th>edge</th><th>visited range</th>"
            f"<th>largest</th><th>p</th><th>significant</th></tr>{rows}</table>"
            f"<p>{escape(sentence)}</p>"
            f"{embedded(figure, 'edges with bands', 90)}")
