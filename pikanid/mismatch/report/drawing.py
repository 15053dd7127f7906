"""Figures of a diagnosis: the proof on held-out data, where in time, the missing force."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from pikanid.estimate.rounding import with_unit
from pikanid.figures import (
    NARROW,
    WIDE,
    broken,
    fewer,
    labelled,
    new_figure,
    tidy,
)
from pikanid.mismatch.report.findings import Curves, DiagnosisData, OutputError
from pikanid.pieces.time_unit import time_unit

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, FigureBase

    from pikanid.mismatch.beyond.force_shape import Edge
    from pikanid.mismatch.beyond.latent_force import ForceOverTime
    from pikanid.mismatch.beyond.patch import Patch

    Piece = tuple[float, Callable[[FigureBase], None]]

BEFORE, AFTER, MOVED = "#c2410c", "#1d4ed8", "#15803d"
DATA, LOUD = "#9ca3af", "#d97706"
STRETCHES = 6  # layout: of a held-out recording, of which one is shown
ROW = 2.4  # layout: height of one row of axes, in inches
WIDTH = 9.0  # layout: of a figure, in inches
LONG = 20  # layout: characters of an entry that stands alone in a phone's legend
LINE = 14  # layout: height of a line of a legend, in points
STRIP = 0.04  # layout: height of the strip that marks a mismatch, of its axes


def plot_diagnosis(dx: DiagnosisData, narrow: bool = False) -> Figure:
    """All of it in one figure: the held-out recording before and after, where in time something is
    missing, and the missing force over states and inputs; `narrow`: for a phone.
    """
    return _drawn([*_proof(dx), *_where(dx), *_shape(dx, narrow)], narrow)


def plot_proof(dx: DiagnosisData, narrow: bool = False) -> Figure | None:
    """Every output of the held-out recording: its prediction before and after, enlarged where the
    nominal model is furthest off, and what each leaves; None without such a recording.
    """
    pieces = _proof(dx)
    return _drawn(pieces, narrow) if pieces else None


def plot_where(dx: DiagnosisData, narrow: bool = False) -> Figure:
    """What the models leave of the recording over time, and the force that would explain it."""
    return _drawn(_where(dx), narrow)


def plot_shape(dx: DiagnosisData, narrow: bool = False) -> Figure | None:
    """The missing force over every state and input with its 95 % band, and the law that was found,
    seen in the same way; None where there is none.
    """
    pieces = _shape(dx, narrow)
    return _drawn(pieces, narrow) if pieces else None


def _drawn(pieces: list[Piece], narrow: bool = False) -> Figure:
    heights = [height for height, _ in pieces]
    figure = new_figure(NARROW if narrow else WIDTH, ROW * sum(heights))
    parts = figure.subfigures(len(pieces), 1, squeeze=False, height_ratios=heights)[:, 0]
    for part, (_, draw) in zip(parts, pieces, strict=True):
        draw(part)
    return figure


def _proof(dx: DiagnosisData) -> list[Piece]:
    if dx.held_out is None:
        return []
    moved = bool(dx.hypotheses) and dx.held_out.sensitive(dx.settings)
    return [(2.3, partial(_output, name, curves, dx.held_out.outputs[name],
                          bool(dx.hypotheses), moved))
            for name, curves in dx.held_out.curves.items()]


def _output(name: str, curves: Curves, error: OutputError, extended: bool, moved: bool,
            figure: FigureBase) -> None:
    """One output of the held-out recording: enlarged, and below what is left of all of it."""
    near, left = figure.subplots(2, 1)
    unit = with_unit("", error.unit)
    size, second = time_unit(float(curves.t.max()))
    curves = replace(curves, t=curves.t / size)
    shown = [("nominal model", curves.before, BEFORE, error.before)]
    if extended:
        shown.append(("extended model", curves.after, AFTER, error.after))
    if moved and curves.moved is not None:
        shown.append(("within its errors", curves.moved, MOVED, error.moved))
    near.plot(curves.t, curves.measured, ".", color=DATA, ms=3, label="measured", zorder=3)
    span = _furthest(curves)
    inside = (curves.t >= span[0]) & (curves.t <= span[1])
    for label, y, colour, rmse in shown:
        near.plot(curves.t, y, color=colour, lw=1.2, label=label)
        left.plot(curves.t, curves.measured - y, color=colour, lw=0.8,
                  label=f"{label}: {rmse:.3g}{unit}")
    _reach(near, np.concatenate([curves.measured[inside], *(y[inside] for _, y, *_ in shown)]))
    near.set_xlim(span)
    left.axhspan(-2 * error.noise, 2 * error.noise, color=DATA, alpha=0.4, lw=0,
                 label="±2σ of the noise")
    left.axvspan(*span, ymax=STRIP, color=DATA, lw=0)
    _finished(near, f"Held-out {name}, predicted, where the nominal model is furthest off",
              labelled(name, error.unit))
    _finished(left, f"Held-out {name}: what is left, and its RMSE; marked: enlarged above",
              labelled("left", error.unit))
    left.set_xlabel(labelled("t", second))


def _furthest(curves: Curves) -> tuple[float, float]:
    """The stretch of time in which the nominal model leaves most, of those of equal length."""
    edges = np.linspace(curves.t.min(), curves.t.max(), STRETCHES + 1)
    which = np.clip(np.searchsorted(edges, curves.t, side="right") - 1, 0, STRETCHES - 1)
    worst = int(np.argmax(np.bincount(which, (curves.measured - curves.before) ** 2, STRETCHES)))
    return float(edges[worst]), float(edges[worst + 1])


def _reach(axes: Axes, values: np.ndarray) -> None:
    """Limits by what can be seen, with some room."""
    seen = values[np.isfinite(values)]
    low, high = (float(seen.min()), float(seen.max())) if len(seen) else (-1.0, 1.0)
    room = 0.08 * (high - low) or 1.0
    axes.set_ylim(low - room, high + room)


def _finished(axes: Axes, title: str, ylabel: str) -> None:
    """Title and legend above the axes: within, they would cover something."""
    axes.set_ylabel(ylabel)
    labels = axes.get_legend_handles_labels()[1]
    columns = fewer(axes.figure, 5, 1 if max(map(len, labels), default=0) > LONG else 2)
    lines = -(-len(labels) // columns)
    axes.set_title(broken(title, axes.figure), loc="left", fontsize="medium", pad=6 + LINE * lines)
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), fontsize="small", ncols=columns,
                frameon=False, borderaxespad=0.1, handlelength=1.4, columnspacing=1.2)
    tidy(axes)


def _where(dx: DiagnosisData) -> list[Piece]:
    force = dx.force_over_time

    def draw(figure: FigureBase) -> None:
        axes = figure.subplots(1 if force is None else 2, 1, sharex=True, squeeze=False)[:, 0]
        why = "band excludes zero" if force is not None and force.resolved else "louder than noise"
        fit = dx.before.fits[0]
        size, second = time_unit(float(fit.t.max()))
        axes[0].plot(fit.t / size, fit.residual, color=BEFORE, lw=0.8, label="nominal model")
        if dx.hypotheses:
            after = dx.after.fits[0]
            axes[0].plot(after.t / size, after.residual, color=AFTER, lw=0.8,
                         label="extended model")
        if force is not None:
            _force(axes[1], force, 1 - dx.settings.band, size, second)
        for axis in axes:
            for k, (start, stop) in enumerate(dx.where.time):
                axis.axvspan(start / size, stop / size, ymax=STRIP, color=LOUD, lw=0,
                             label=why if k == 0 else None)
        _finished(axes[0], f"What is left of {fit.output} in {fit.recording}",
                  labelled("left", fit.unit))
        if force is not None:
            _finished(axes[1], "Force that would explain it, without what the free parameters can "
                      "do", labelled("force", force.unit))
        axes[-1].set_xlabel(labelled("t", second))

    return [(1.15 if force is None else 2.3, draw)]


def _force(axis: Axes, force: ForceOverTime, level: float, size: float, second: str) -> None:
    t = force.t / size
    for width, alpha, name in ((force.critical, 0.12, f"{100 * level:g} % band, at once"),
                               (WIDE, 0.25, "pointwise")):
        axis.fill_between(t, force.values - width * force.std,
                          force.values + width * force.std, color=AFTER, alpha=alpha, lw=0,
                          label=name)
    axis.plot(t, force.values, color=AFTER, lw=1.0,
              label=f"mean over {force.resolution / size:.2g} {second}")
    axis.axhline(0.0, color=DATA, lw=0.8)
    # a spike, as where a recording begins beside its model, must not flatten all the rest
    reach = np.quantile(np.abs(force.values) + force.critical * force.std, 0.98)
    axis.set_ylim(-1.2 * reach, 1.2 * reach)


def _shape(dx: DiagnosisData, narrow: bool = False) -> list[Piece]:
    shape, patch = dx.shape, dx.patch
    if shape is None or not (shape.edges or patch):
        return []
    found, count = shape, len(shape.edges) + (patch is not None)

    def draw(figure: FigureBase) -> None:
        axes = figure.subplots(*((count, 1) if narrow else (1, count)), squeeze=False).ravel()
        model, wider = dx.before.model, max(found.left, 1.0) ** 0.5
        units = {**{s.name: s.unit for s in model.states}, **{i.name: i.unit for i in model.inputs}}
        for axis, edge in zip(axes[:len(found.edges)], found.edges, strict=True):
            _edge(axis, edge, units.get(edge.argument, ""), wider)
        if patch is not None:
            _patch(axes[-1], patch)
        for axis in axes if narrow else axes[:1]:
            axis.set_ylabel(labelled("force", found.unit))
        handles = {label: handle for axis in axes for handle, label in zip(
            *axis.get_legend_handles_labels(), strict=True)}
        figure.legend(handles.values(), handles.keys(), loc="outside upper left",
                      ncols=fewer(figure, 4, 1), fontsize="small", frameon=False,
                      handlelength=1.4, title=broken("Missing force, without what the free "
                      "parameters can do (to first order)", figure),
                      title_fontsize="medium", alignment="left")

    return [(0.3 + 1.15 * count if narrow else 1.5, draw)]


def _edge(axis: Axes, edge: Edge, unit: str, wider: float) -> None:
    half = WIDE * wider * edge.std
    axis.fill_between(edge.grid, edge.values - half, edge.values + half, color=AFTER, alpha=0.2,
                      lw=0, label="95 % band")
    axis.plot(edge.grid, edge.values, color=AFTER, lw=1.4, label="read off the recordings")
    seen = [edge.values]
    if edge.law is not None:
        axis.plot(edge.grid, edge.law, color=BEFORE, lw=1.4, ls=(0, (4, 2)),
                  label="the law that is given, seen in the same way")
        seen.append(edge.law)
    axis.axhline(0.0, color=DATA, lw=0.8)
    low, high = np.min(seen), np.max(seen)
    room = 0.5 * float(high - low) or 1.0
    axis.set_ylim(max(float(np.min(edge.values - half)), low - room) - 0.1 * room,
                  min(float(np.max(edge.values + half)), high + room) + 0.1 * room)
    axis.set_xlabel(f"{labelled(edge.argument, unit)}\n({100 * edge.alone:.0f} % explained alone)")
    tidy(axis)


def _patch(axis: Axes, patch: Patch) -> None:
    axis.fill_between(patch.grid, patch.values - WIDE * patch.std,
                      patch.values + WIDE * patch.std, color=MOVED, alpha=0.2, lw=0)
    axis.plot(patch.grid, patch.values, color=MOVED, lw=1.4, label="KAN patch, refitted")
    axis.axhline(0.0, color=DATA, lw=0.8)
    axis.set_xlabel(f"{patch.argument}\n(nothing beyond)")
    tidy(axis)
