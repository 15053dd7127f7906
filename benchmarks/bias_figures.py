"""The figures of the bias experiment."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from bias_descent import Stop
from bias_grid import GRIDS, SHOWN_GRID, Series, physics_residual, switches

from pikanid.figures import COLOURS, MEASURED, new_figure, tidy
from pikanid.strategies.ipda import PAPER_LAMBDA
from pikanid.strategies.kan_paper import STAGES
from pikanid.uncertainty import cramer_rao
from pikanid.validation.study import slosh

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STYLES = {"ipda": (COLOURS[0], "s"), "uniform": (COLOURS[1], "o"), "exact": (COLOURS[2], "^"),
          "released": (COLOURS[3], "D")}
GUIDES = {"l_theta": 12.0, "d_theta": 400.0}  # error [%] at G = 80 of the line ∝ h
SYMBOLS = {"l_theta": "length l", "d_theta": "damping d"}


def figures(found: list[Series], paths: Mapping[str, tuple[list[Stop], Stop]],
            along: list[Stop]) -> dict[str, Figure]:
    """Name of the file, without its beginning and ending -> figure."""
    return {"grid": against_grid(found), "residual": residual(), "descent": descent(paths, along)}


def against_grid(found: list[Series]) -> Figure:
    """Relative error against G, clean data."""
    figure = new_figure(11.0, 4.8)
    bound = cramer_rao(slosh.model(), slosh.recording(slosh.SCENARIOS[1], 0))
    paper = f"λ = {PAPER_LAMBDA:g}"
    shown = [s for s in found if s.kind != "ipda" or s.name.endswith((paper, "Gauss points"))]
    size = np.array(GRIDS)
    for k, (axes, (name, true)) in enumerate(
            zip(figure.subplots(1, 2), slosh.TRUE.items(), strict=True)):
        for n, s in enumerate(shown):
            colour, marker = STYLES[s.kind]
            second = any(other.kind == s.kind for other in shown[:n])
            good = ~s.locked & np.isfinite(s.error[:, k])
            axes.plot(size, np.where(good, 100 * np.abs(s.error[:, k]), np.nan), color=colour,
                      marker=marker, markersize=4, linewidth=1.3, label=s.name,
                      linestyle="--" if second else "-",
                      markerfacecolor="white" if second else colour)
        guide, height = np.array([80.0, 640.0]), GUIDES[name]
        axes.plot(guide, height * 80 / guide, color="black", linewidth=0.8)
        axes.text(250, height * 80 / 160, "∝ h", fontsize="small")
        limit = 100 * bound.std(name) / true
        axes.axhline(limit, color=MEASURED, linewidth=0.8, linestyle=":")
        axes.text(9.5, limit * 1.4, "Cramér-Rao, σ = 0.1°", fontsize="x-small",
                  color=MEASURED)
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_ylim(1e-9, 5e3)
        axes.set_xticks(size, [str(g) for g in size])
        axes.minorticks_off()
        axes.set_xlabel("grid cells G")
        axes.set_ylabel(f"|relative error| of {SYMBOLS[name]} [%]")
        tidy(axes)
        axes.set_xlim(9, 720)
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, fontsize="small",
                  frameon=False)
    figure.suptitle("Clean data, locked fits left out", fontsize="medium")
    return figure


def residual() -> Figure:
    """Where in time the physics of a fit to clean data is violated."""
    figure = new_figure(11.0, 4.0)
    axes = figure.subplots()
    t = np.linspace(0.0, 2.5, 2500)
    for exact, text, k in ((False, "uniform knots alone", 1), (True, "exact switches", 2)):
        axes.plot(t, physics_residual(SHOWN_GRID, exact, t), color=COLOURS[k], label=text,
                  linewidth=1.3)
    for n, switch in enumerate(switches()):
        axes.axvline(switch, color=MEASURED, linewidth=0.8, linestyle=":",
                     label="the input switches" if n == 0 else None)
    axes.set_xlabel("time [s]")
    axes.set_ylabel("θ̈ − f(θ, θ̇, u) [rad/s²]")
    axes.set_title(f"Physics residual, cubic KAN, G = {SHOWN_GRID}, clean data", loc="left",
                   fontsize="small")
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, frameon=False,
                fontsize="small", borderaxespad=0.1)
    tidy(axes)
    return figure


def descent(paths: Mapping[str, tuple[list[Stop], Stop]], along: list[Stop]) -> Figure:
    """l, d and the gradient along L-BFGS, and the least loss for given l."""
    figure = new_figure(11.0, 6.6)
    panels = figure.subplots(2, 2).ravel()
    reads = (lambda s: s.theta[0], lambda s: s.theta[1], lambda s: s.gradient)
    labels = ("l [m]", "d [N s/m]", "gradient norm")
    for axes, read, label in zip(panels, reads, labels, strict=False):
        for n, (name, (stops, _)) in enumerate(paths.items()):
            steps = _counted(stops)
            axes.plot(steps, [read(s) for s in stops], "o-", color=COLOURS[n], markersize=3.5,
                      linewidth=1.2, label=name)
            ends = [(k, read(s)) for k, s in zip(steps, stops, strict=True)
                    if (s.lam, s.steps) == STAGES[-1][1:]]
            axes.plot(*zip(*ends, strict=True), "s", color=COLOURS[n], markersize=9,
                      markerfacecolor="none",
                      label=f"stop of the protocol, {STAGES[-1][2]} steps at λ = 1" if n else None)
        axes.set_xlabel("L-BFGS steps with physics")
        axes.set_ylabel(label)
        axes.margins(y=0.1)
    panels[3].plot([s.theta[0] for s in along], [s.cost for s in along], "o-", color=COLOURS[2],
                   markersize=3.5, linewidth=1.2, label="least loss for given l (λ = 1, G = 40)")
    panels[3].set_xscale("log")
    panels[3].set_xlabel("l [m]")
    panels[3].set_ylabel("loss")
    for axes in panels:
        axes.set_yscale("log")
        tidy(axes)
    for axes, true in zip(panels, slosh.TRUE.values(), strict=False):
        axes.axhline(true, color="black", linewidth=0.8, linestyle="--", label="truth")
    panels[3].axvline(slosh.TRUE["l_theta"], color="black", linewidth=0.8, linestyle="--")
    handles, texts = panels[0].get_legend_handles_labels()
    more, names = panels[3].get_legend_handles_labels()
    figure.legend([*handles, *more], [*texts, *names], loc="outside lower center", ncols=3,
                  fontsize="small", frameon=False)
    return figure


def _counted(stops: list[Stop]) -> list[int]:
    """Steps since the first stage with physics."""
    steps, before = [], 0
    for k, stop in enumerate(stops):
        if k and stop.steps == 0:
            before = steps[-1]
        steps.append(before + stop.steps)
    return steps
