"""Figures of a diagnosis: where in time, the missing force, the proof on held-out data."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pikanid.figures import labelled, new_figure
from pikanid.mismatch.report.findings import DiagnosisData, Proof

if TYPE_CHECKING:
    import matplotlib.figure

    from pikanid.mismatch.beyond.force_shape import ForceShape
    from pikanid.mismatch.beyond.latent_force import ForceOverTime
    from pikanid.mismatch.beyond.patch import Patch

BEFORE, AFTER, MOVED = "#c2410c", "#1d4ed8", "#15803d"
DATA, LOUD = "#9ca3af", "#fde68a"
STRETCHES = 6  # layout: of a held-out recording, of which one is shown


def plot_diagnosis(dx: DiagnosisData) -> matplotlib.figure.Figure:
    """Residual of the nominal and of the extended model over time, and the force that would explain
    it, the seconds of the mismatch shaded; below, with a held-out recording, its prediction before
    and after and what each leaves; at the bottom the missing force over states and inputs, with its
    95 % band.
    """
    force = dx.force_over_time
    first = 1 if force is None else 2
    rows = first if dx.held_out is None else first + 2
    shape = dx.shape if dx.shape is not None and (dx.shape.edges or dx.patch) else None
    figure = new_figure(9.0, 2.6 * (rows + (shape is not None)))
    upper: matplotlib.figure.FigureBase = figure
    if shape is not None:
        upper, lower = figure.subfigures(
            2, 1, squeeze=False, height_ratios=[rows, 1.2])[:, 0]
        _shape(lower, shape, dx.patch)
    axes = np.atleast_1d(upper.subplots(rows, 1))
    _train(axes[0], dx)
    if force is not None:
        _force(axes[1], force, 1 - dx.settings.band)
        axes[1].sharex(axes[0])
    why = "band excludes zero" if force is not None and force.resolved else "louder than noise"
    for axis in axes[:first]:
        for k, (start, stop) in enumerate(dx.where.time):
            axis.axvspan(start, stop, color=LOUD, alpha=0.6, lw=0, zorder=0,
                         label=why if k == 0 else None)
    if dx.held_out is not None:
        proof, below = dx.held_out, axes[first:]
        name = labelled(next(iter(proof.outputs)), proof.unit)
        unit = f" {proof.unit}".rstrip()
        below[0].plot(proof.t, proof.measured, ".", color=DATA, ms=3, label="measured",
                      zorder=3)
        below[0].plot(proof.t, proof.before, color=BEFORE, lw=1, label="nominal model")
        below[0].set(ylabel=name, xlim=_furthest(proof), title="Held-out recording: prediction, "
                     "where the nominal model is furthest off")
        below[1].plot(proof.t, proof.measured - proof.before, color=BEFORE, lw=0.8,
                     label=f"nominal: {proof.rmse_before:.3g}{unit}")
        if dx.hypotheses:
            below[0].plot(proof.t, proof.after, color=AFTER, lw=1, label="extended model")
            below[1].plot(proof.t, proof.measured - proof.after, color=AFTER, lw=0.8,
                         label=f"extended: {proof.rmse_after:.3g}{unit}")
        if dx.hypotheses and proof.sensitive(dx.settings):
            below[0].plot(proof.t, proof.moved, color=MOVED, lw=1, label="within its errors")
            below[1].plot(proof.t, proof.measured - proof.moved, color=MOVED, lw=0.8,
                          label=f"within its errors: {proof.rmse_moved:.3g}{unit}")
        below[1].axhspan(-2 * proof.noise, 2 * proof.noise, color=DATA, alpha=0.3, lw=0,
                        label="±2σ of the noise")
        below[1].set(ylabel=name, title="Held-out recording: what is left, and its RMSE")
    for axis in axes:
        axis.margins(x=0.01)
        if axis.get_autoscaley_on():
            axis.margins(y=0.3)  # room for the legend
        axis.legend(loc="upper right", fontsize=8, ncols=4)
        axis.grid(alpha=0.2)
    axes[-1].set_xlabel("t [s]")
    return figure


def _furthest(proof: Proof) -> tuple[float, float]:
    """The stretch [s] in which the nominal model leaves most, of those of equal length."""
    edges = np.linspace(proof.t.min(), proof.t.max(), STRETCHES + 1)
    which = np.clip(np.searchsorted(edges, proof.t, side="right") - 1, 0, STRETCHES - 1)
    worst = int(np.argmax(np.bincount(which, (proof.measured - proof.before) ** 2, STRETCHES)))
    return float(edges[worst]), float(edges[worst + 1])


def _train(axis: matplotlib.axes.Axes, dx: DiagnosisData) -> None:
    fit = dx.before.fits[0]
    axis.plot(fit.t, fit.residual, color=BEFORE, lw=0.8, label="nominal model")
    if dx.hypotheses:
        after = dx.after.fits[0]
        axis.plot(after.t, after.residual, color=AFTER, lw=0.8, label="extended model")
    axis.set(ylabel=labelled(fit.output, fit.unit), title="What the model leaves of the recording")


def _force(axis: matplotlib.axes.Axes, force: ForceOverTime, level: float) -> None:
    for width, alpha, name in ((force.critical, 0.12, f"{100 * level:g} % band, at once"),
                               (1.96, 0.25, "pointwise")):
        axis.fill_between(force.t, force.values - width * force.std,
                          force.values + width * force.std, color=AFTER, alpha=alpha, lw=0,
                          label=name)
    axis.plot(force.t, force.values, color=AFTER, lw=1.0,
              label=f"mean over {force.resolution:.2g} s")
    axis.axhline(0.0, color=DATA, lw=0.8)
    # a spike, as where a recording begins beside its model, must not flatten all the rest
    reach = np.quantile(np.abs(force.values) + force.critical * force.std, 0.98)
    axis.set_ylim(-1.1 * reach, 1.7 * reach)
    axis.set(ylabel=labelled("force", force.unit),
             title="Force that would explain it, without what the free parameters can do")


def _shape(figure: matplotlib.figure.FigureBase, shape: ForceShape, patch: Patch | None) -> None:
    figure.suptitle("Missing force, without what the free parameters can do (to first order)",
                    fontsize="medium")
    count = len(shape.edges)
    axes = np.atleast_1d(figure.subplots(1, count + (patch is not None)))
    for axis, edge in zip(axes[:count], shape.edges, strict=True):
        axis.fill_between(edge.grid, edge.values - 1.96 * edge.std, edge.values + 1.96 * edge.std,
                          color=AFTER, alpha=0.2, lw=0)
        axis.plot(edge.grid, edge.values, color=AFTER, lw=1.2)
        axis.axhline(0.0, color=DATA, lw=0.8)
        axis.set_xlabel(f"{edge.argument}\n({100 * edge.alone:.0f} % explained)")
        axis.grid(alpha=0.2)
    if patch is not None:
        axis = axes[-1]
        axis.fill_between(patch.grid, patch.values - 1.96 * patch.std,
                          patch.values + 1.96 * patch.std, color=BEFORE, alpha=0.2, lw=0)
        axis.plot(patch.grid, patch.values, color=BEFORE, lw=1.2)
        axis.axhline(0.0, color=DATA, lw=0.8)
        axis.set_title("KAN patch, refitted", fontsize="medium")
        axis.set_xlabel(f"{patch.argument}\n(nothing beyond)")
        axis.grid(alpha=0.2)
    axes[0].set_ylabel(labelled("force", shape.unit))
