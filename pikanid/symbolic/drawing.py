"""A network drawn: every edge with its function, band and name, as thick as it is significant."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from pikanid.figures import image_for, new_figure
from pikanid.storage.outputs import together
from pikanid.symbolic.composed import Groups, Place
from pikanid.symbolic.named import NamedEdge
from pikanid.symbolic.significance import Contribution

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


class Drawable(Protocol):
    """What is drawn of a network that was read: see `pikanid.symbolic.reading.Reading`."""

    @property
    def ok(self) -> bool:
        """Whether the formula says all that the network says."""

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names or formulas of the inputs."""

    @property
    def edges(self) -> Mapping[Place, NamedEdge]:
        """Every edge that was read."""

    @property
    def groups(self) -> Groups:
        """Layer by layer, the subnodes that every node multiplies."""

    @property
    def contributions(self) -> tuple[Contribution, ...]:
        """Of edges and nodes, those removed included."""

    @property
    def forms(self) -> Mapping[Place, str]:
        """The form chosen for every edge."""

    def latex(self, digits: int = 4) -> str:
        """The formula with numbers."""


LINE, FAINT, BAND, NODE = "#0072B2", "#999999", "#A6CBE3", "#222222"
COLUMN, ROW, PLOT = 3.6, 1.75, (1.75, 1.05)  # layout: in inches
THIN, THICK = 0.7, 5.0  # layout: line widths
NORMAL_95 = 1.959963984540054  # definition: quantile of the normal distribution


def draw(reading: Drawable, *paths: str | Path) -> Figure:
    """Nodes from left to right, each edge a small diagram between two of them.

    The band is pointwise 95 %; the dashed line is the named form; lines are as wide as the edge's
    share of its layer's contribution.  Files are written in the format of their endings (.png,
    .svg, .pdf).
    """
    layers = 1 + max(layer for layer, _, _ in reading.edges)
    by_layer = [sorted(p for p in reading.edges if p[0] == k) for k in range(layers)]
    height = max(2, *(len(places) for places in by_layer)) * ROW + 0.7
    width = layers * COLUMN + 1.6
    figure = new_figure(width, height, None)
    back = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    back.set_xlim(0.0, width)
    back.set_ylim(0.0, height)
    back.axis("off")
    nodes = _nodes(reading, layers, height - 0.5)
    for places in by_layer:
        for order, place in enumerate(places):
            y = (height - 0.5) * (1.0 - (order + 0.5) / len(places))
            _edge(figure, back, reading, place, y, nodes)
    for (layer, _), (x, y, text) in nodes.items():
        mark = "s" if layer == 0 else "o"
        back.plot([x], [y], mark, color=NODE, markersize=9 if layer else 7, zorder=5)
        back.annotate(text, (x, y), (0, 11), textcoords="offset points", ha="center", fontsize=10,
                      bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.8}, zorder=6)
    back.set_title("")
    back.text(0.5 * width, height - 0.28, _title(reading), ha="center", va="center", fontsize=10)
    together({path: image_for(figure, path) for path in paths})
    return figure


def _title(reading: Drawable) -> str:
    text = reading.latex(3)
    return f"${text}$" if reading.ok and len(text) < 160 and "\\operatorname" not in text else ""


def _nodes(reading: Drawable, layers: int, height: float
           ) -> dict[tuple[int, int], tuple[float, float, str]]:
    """Place and label of every node (layer, number), subnodes of a product drawn as one."""
    found = {}
    for layer in range(layers + 1):
        if layer == 0:
            labels = list(reading.inputs)
        elif layer == layers:
            labels = ["output"]
        else:
            labels = ["×" if len(g) > 1 else "Σ" for g in reading.groups[layer - 1]]
        for k, text in enumerate(labels):
            found[layer, k] = (0.8 + layer * COLUMN, height * (1.0 - (k + 0.5) / len(labels)),
                               text)
    return found


def _edge(figure: Figure, back: Axes, reading: Drawable, place: Place, y: float,
          nodes: dict[tuple[int, int], tuple[float, float, str]]) -> None:
    layer, source, target = place
    edge = reading.edges[place]
    group = next(j for j, g in enumerate(reading.groups[layer]) if target in g)
    start, stop = nodes[layer, source], nodes[layer + 1, group]
    sizes = {(c.layer, c.source, c.target): c for c in reading.contributions}
    peers = [c.size for k, c in sizes.items() if k[0] == layer and k[2] is not None]
    own = sizes.get(place)
    share = own.size / max(peers) if own and max(peers, default=0.0) > 0 else 1.0
    live = reading.forms.get(place, "nothing") != "nothing"
    middle = 0.5 * (start[0] + stop[0])
    left, right = middle - 0.5 * PLOT[0], middle + 0.5 * PLOT[0]
    style: dict[str, Any] = {
        "color": LINE if live else FAINT, "linewidth": THIN + (THICK - THIN) * share,
        "alpha": 0.55, "solid_capstyle": "round", "zorder": 1}
    back.plot([start[0], left], [start[1], y], **style)
    back.plot([right, stop[0]], [y, stop[1]], **style)
    w, h = figure.get_size_inches()
    axes = figure.add_axes((left / w, (y - 0.5 * PLOT[1]) / h, PLOT[0] / w, PLOT[1] / h), zorder=3)
    title = reading.forms.get(place, "nothing")
    _curve(axes, edge, title)
    weight = "" if own is None else f"  {own.size:.2g} ± {own.std:.1g}"
    axes.set_title(title + weight, fontsize=8, pad=2)


def _curve(axes: Axes, edge: NamedEdge, form: str) -> None:
    """The edge less its mean: only its shape is its own."""
    curve = edge.curve
    y = curve.y - np.mean(curve.y)
    std = edge.std
    if std is not None:
        axes.fill_between(curve.x, y - NORMAL_95 * std, y + NORMAL_95 * std, color=BAND,
                          linewidth=0.0)
    if len(curve.x) > 200 and std is None:
        axes.plot(curve.x, y, ".", color=FAINT, markersize=1)
    else:
        axes.plot(curve.x, y, color=FAINT if form == "nothing" else LINE, linewidth=1.6)
    named = next(c.fit.values for c in edge.candidates if c.form.name == form)
    axes.plot(curve.x, named - np.mean(named), "--", color="black", linewidth=0.9)
    axes.tick_params(labelsize=6, length=2, pad=1)
    axes.locator_params(nbins=4)
    axes.patch.set_alpha(0.92)
