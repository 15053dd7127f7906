"""The figures of the bias experiment."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from bias_descent import Stop
from bias_grid import GRIDS, SHOWN_GRID, Series, physics_residual, switches

from pikanid.plots import COLOURS, MEASURED, new_figure, tidy
from pikanid.strategies.kan_paper import STAGES
from pikanid.study import slosh
from pikanid.uncertainty import cramer_rao

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STYLES = {"ipda": (COLOURS[0], "s"), "uniform": (COLOURS[1], "o"), "exact": (COLOURS[2], "^"),
          "released": (COLOURS[3], "D")}
SYMBOLS = {"l_theta": "length l", "d_theta": "damping d"}


def figures(found: list[Series], paths: Mapping[str, tuple[list[Stop], Stop]]
            ) -> dict[str, Figure]:
    """Name of the file, without its beginning and ending -> figure."""
    return {"grid": against_grid(found), "residual": residual(), "descent": descent(paths)}


def against_grid(found: list[Series]) -> Figure:
    """Relative error against G, clean data."""
    figure = new_figure(11.0, 4.8)
    bound = cramer_rao(slosh.model(), slosh.recording(slosh.SCENARIOS[1], 0))
    shown = [s for s in found if "1e-" not in s.name or "0.0001" in s.name]
    size = np.array(GRIDS)
    for k, (axes, (name, true)) in enumerate(
            zip(figure.subplots(1, 2), slosh.TRUE.items(), strict=True)):
        for n, s in enumerate(shown):
            colour, marker = STYLES[s.kind]
            second = any(other.kind == s.kind for other in shown[:n])
            good = ~s.locked & np.isfinite(s.error[:, k])
            axes.plot(size[good], np.maximum(100 * np.abs(s.error[good, k]), 1e-6), color=colour,
                      marker=marker, markersize=4, linewidth=1.3, label=s.name,
                      linestyle="--" if second else "-",
                      markerfacecolor="white" if second else colour)
        guide = np.array([80.0, 640.0])
        axes.plot(guide, 12.0 * 80 / guide, color="black", linewidth=0.8)
        axes.text(230, 12.0 * 80 / 200, "∝ h", fontsize="small")
        limit = 100 * bound.std(name) / true
        axes.axhline(limit, color=MEASURED, linewidth=0.8, linestyle=":")
        axes.text(size[0], limit * 1.15, "Cramér-Rao bound at σ = 0.1°", fontsize="x-small",
                  color=MEASURED)
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_ylim(1e-6, 2e3)
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


def descent(paths: Mapping[str, tuple[list[Stop], Stop]]) -> Figure:
    """l, d and the gradient along L-BFGS."""
    figure = new_figure(11.0, 4.2)
    panels = figure.subplots(1, 3)
    reads = (lambda s: s.theta[0], lambda s: s.theta[1], lambda s: s.gradient)
    labels = ("l [m]", "d [N s/m]", "gradient norm")
    for axes, read, label in zip(panels, reads, labels, strict=True):
        for n, (name, (stops, _)) in enumerate(paths.items()):
            steps, before = [], 0
            for k, stop in enumerate(stops):
                if k and stop.steps == 0:
                    before = steps[-1]
                steps.append(before + stop.steps)
            axes.plot(steps, [read(s) for s in stops], "o-", color=COLOURS[n], markersize=3.5,
                      linewidth=1.2, label=name)
            end = before + STAGES[-1][2]
            here = [read(s) for s in stops if s.lam == STAGES[-1][1]
                    and s.steps == STAGES[-1][2]]
            axes.plot([end] * len(here), here, "s", color=COLOURS[n], markersize=9,
                      markerfacecolor="none",
                      label=f"its stop after {STAGES[-1][2]} steps at λ = {STAGES[-1][1]:g}")
        axes.set_yscale("log")
        axes.set_xlabel("L-BFGS steps with physics")
        axes.set_ylabel(label)
        tidy(axes)
    for axes, true in zip(panels, slosh.TRUE.values(), strict=False):
        axes.axhline(true, color="black", linewidth=0.8, linestyle="--", label="truth")
    handles, names = panels[0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower center", ncols=3, fontsize="small",
                  frameon=False)
    return figure
