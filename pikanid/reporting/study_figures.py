"""The figures of the study."""

from __future__ import annotations

from collections.abc import Mapping
from math import pi
from typing import TYPE_CHECKING, Any

import numpy as np

from pikanid.figures import BAND, MEASURED, NARROW, fewer, new_figure, stroke, tidy
from pikanid.mismatch.report.drawing import plot_diagnosis
from pikanid.recording import excitation
from pikanid.simulation import simulate
from pikanid.tracking.drawing import detection
from pikanid.validation.study import slosh
from pikanid.validation.study.pendulum import Swing
from pikanid.validation.study.run import Study

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHOWN = 1.0  # layout: noise [deg] of the trajectories drawn
ENLARGED = 3.0  # layout: seconds of the swing drawn at full width


def figures(study: Study, narrow: bool = False) -> Mapping[str, Figure]:
    """Name of the file without its ending -> figure; `narrow`: for a phone."""
    made = {"slosh-trajectories": trajectories(study, narrow)}
    if study.spreads:
        made["slosh-errors"] = spread(study, narrow)
    if any(r.predicted is not None for r in study.pendulum_fits):
        made["pendulum"] = swing(study, study.swing, narrow)
    if study.filmed is not None:
        made["video"] = detection(study.filmed.track, study.filmed.stills, narrow)
    made["pendulum-diagnosis"] = plot_diagnosis(study.diagnosis, narrow)
    return made


def style(study: Study, strategy: str, scale: float = 1.0) -> dict[str, Any]:
    """Colour, width and dashes of a strategy, the same in every figure."""
    return stroke(list(dict.fromkeys(r.strategy for r in study.slosh_fits)).index(strategy), scale)


def trajectories(study: Study, narrow: bool = False) -> Figure:
    """As Fig. 5 of the paper: the truth, noisy samples, and the model at every estimate."""
    figure = new_figure(NARROW if narrow else 11.0, 6.4)
    figure.suptitle(f"Model at the estimates, σ = {SHOWN:g}°, seed 0", fontsize="medium")
    drive = excitation.two_pulse()
    truth = simulate(slosh.model(), drive)["theta"]
    for axes, sampling in zip(figure.subplots(2, 1, sharex=True), ("dense", "sparse"), strict=True):
        shown = [r for r in study.slosh_fits
                 if r.scenario.name == f"{sampling}_high"]
        samples = slosh.recording(shown[0].scenario, seed=0)["theta"]
        axes.plot(samples.time, samples.values * 180 / pi, ".", color=BAND, markersize=4,
                  label=f"{len(samples)} samples")
        axes.plot(truth.time, truth.values * 180 / pi, color="black", linewidth=3.2, label="truth")
        for result in shown:
            if result.estimate is not None:
                y = simulate(result.estimate.fitted_model, drive)["theta"]
                axes.plot(y.time, y.values * 180 / pi, **style(study, result.strategy),
                          label=result.strategy)
        axes.set_ylabel("surface angle θ [deg]")
        axes.set_title(sampling, loc="left", fontsize="small")
        _legend(axes)
        tidy(axes)
    axes.set_xlabel("time [s]")
    return figure


def spread(study: Study, narrow: bool = False) -> Figure:
    """Root mean square error over repeated seeds against the Cramér-Rao bound."""
    figure = new_figure(NARROW if narrow else 11.0, 6.4 if narrow else 4.0)
    figure.suptitle(f"Root mean square error over {study.seeds} seeds", fontsize="medium")
    labels = list(dict.fromkeys(s.scenario.label for s in study.spreads))
    names = list(dict.fromkeys(s.strategy for s in study.spreads))
    width = 0.8 / len(names)
    titles = {"l_theta": "length l", "d_theta": "damping d"}
    for axes, parameter in zip(
            figure.subplots(*((2, 1) if narrow else (1, 2)), sharey=True), slosh.TRUE,
            strict=True):
        for k, name in enumerate(names):
            own = [s for s in study.spreads if s.strategy == name]
            at = [labels.index(s.scenario.label) + (k - (len(names) - 1) / 2) * width for s in own]
            ratio = [s.cells[parameter].ratio.value for s in own]
            axes.plot(at, ratio, "o", color=style(study, name)["color"], label=name)
        axes.axhline(1.0, color="black", linewidth=0.8)
        axes.set_yscale("log")
        axes.set_xticks(range(len(labels)), labels, rotation=40 if narrow else 0)
        axes.set_title(titles[parameter], loc="left", fontsize="small")
        tidy(axes)
        axes.set_xlim(-0.5, len(labels) - 0.5)
        _legend(axes)
        axes.set_xlabel("scenario: sampling, noise")
    figure.axes[0].set_ylabel("RMSE / Cramér-Rao bound [-]")
    return figure


def swing(study: Study, recording: Swing, narrow: bool = False) -> Figure:
    """The real recording: residuals over both parts, and the end of the held-out part enlarged."""
    figure = new_figure(NARROW if narrow else 11.0, 6.4)
    figure.suptitle("Viscous pendulum on the real recording", fontsize="medium")
    upper, lower = figure.subplots(2, 1)
    held = recording.held_out["theta"]
    usable = [r for r in study.pendulum_fits if r.estimate is not None and r.predicted is not None]
    lower.plot(held.time, held.values, color=MEASURED, linewidth=2.4, label="measured")
    top = 0.0
    for result in usable:
        assert result.estimate is not None and result.predicted is not None
        fitted = result.estimate.fits[0]
        residual = np.concatenate([fitted.residual, held.values - result.predicted])
        upper.plot(np.concatenate([fitted.t, held.time]), residual, label=result.strategy,
                   **style(study, result.strategy, 0.6))
        lower.plot(held.time, result.predicted, label=result.strategy,
                   **style(study, result.strategy))
        top = max(top, np.abs(result.predicted[held.time > held.time[-1] - ENLARGED]).max())
    upper.axvspan(held.time[0], held.time[-1], color=BAND, alpha=0.35, linewidth=0,
                  label="held out")
    upper.set_ylabel("measured − model [rad]")
    lower.set_ylabel("angle θ [rad]")
    for axes, text in ((upper, "whole recording"), (lower, "end of the held-out part")):
        axes.set_title(text, loc="left", fontsize="small")
        axes.set_xlabel("time [s]")
        _legend(axes)
        tidy(axes)
    lower.set_xlim(held.time[-1] - ENLARGED, held.time[-1])
    seen = np.abs(held.values[held.time > held.time[-1] - ENLARGED]).max()
    # A run that goes astray must not squeeze the others.
    limit = 1.1 * min(max(top, seen), 2 * seen)
    lower.set_ylim(-limit, limit)
    return figure


def _legend(axes: Axes) -> None:
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), fontsize="small",
                ncols=fewer(axes.figure, 8, 3), frameon=False, borderaxespad=0.1)
