"""The figures of the benchmark."""

from __future__ import annotations

from collections.abc import Mapping
from math import pi
from typing import TYPE_CHECKING, Any

import numpy as np
from benchmark_data import FIVE, NAMES, SCENARIOS, UNITS, Key
from benchmark_experiments import DAMPINGS, LAMBDAS, LENGTHS, SIGMAS, STRIDES, Basin, Share, Sweep
from benchmark_tables import published
from diagnosis_real import MODELS

import pikanid as pk
from pikanid.figures import BAND, COLOURS, MEASURED, new_figure, tidy
from pikanid.recording import datasets
from pikanid.simulation import simulate
from pikanid.validation.benchmark import files
from pikanid.validation.benchmark.cells import Group

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

TICKS = (0.012, 0.025, 0.045, 0.1, 0.25)
MARKS = {"paper": "o", "default": "^"}
# what lies beyond is drawn at the edge
SHOWN = {"l_theta": (0.025, 0.12), "d_theta": (0.01, 3.0)}


def colour(strategy: str) -> str:
    """The same for a strategy in every figure."""
    return COLOURS[FIVE.index(strategy) % len(COLOURS)]


def estimates(found: Mapping[Key, Group]) -> Figure:
    """Every estimate of d, scenario by scenario, with what the paper prints."""
    figure = new_figure(11.0, 7.4)
    rng = np.random.default_rng(0)
    every = figure.subplots(2, 1, sharex=True)
    for axes, parameter in zip(every, NAMES, strict=True):
        for i, scenario in enumerate(SCENARIOS):
            for k, strategy in enumerate(FIVE):
                for side, protocol in ((-0.035, "paper"), (0.035, "default")):
                    g = found.get((scenario, strategy, protocol))
                    if g is None:
                        continue
                    # what left the axes stands at their edge
                    y = np.clip(g.cells[parameter].estimates, *SHOWN[parameter])
                    x = i + 0.16 * (k - 2) + side + rng.uniform(-0.015, 0.015, y.size)
                    axes.plot(x, y, MARKS[protocol], color=colour(strategy), markersize=3,
                              alpha=0.35, markeredgewidth=0,
                              markerfacecolor=colour(strategy), rasterized=True)
                axes.plot(i + 0.16 * (k - 2), published(scenario, strategy, parameter), "x",
                          color="black", markersize=6)
        axes.axhline(g.cells[parameter].true if g else np.nan, color=MEASURED, linewidth=0.8)
        axes.set_yscale("log")
        axes.set_ylabel(f"{NAMES[parameter]} [{UNITS[parameter]}]")
        tidy(axes)
        for i in range(1, len(SCENARIOS)):
            axes.axvline(i - 0.5, color=BAND, linewidth=0.6)
        axes.set_xlim(-0.5, len(SCENARIOS) - 0.5)
        axes.set_ylim(0.95 * SHOWN[parameter][0], 1.05 * SHOWN[parameter][1])
    every[0].set_yticks([0.03, 0.045, 0.06, 0.1], ["0.03", "0.045", "0.06", "0.1"])
    every[0].minorticks_off()
    labels = [found[key].label for s in SCENARIOS for key in [next(k for k in found if k[0] == s)]]
    every[1].set_xticks(range(len(SCENARIOS)), labels)
    _key(every[0], {s: {"color": colour(s), "marker": "s", "linestyle": ""} for s in FIVE} | {
        "protocol of the paper": {"color": MEASURED, "marker": "o", "linestyle": ""},
        "default": {"color": MEASURED, "marker": "^", "linestyle": ""},
        "printed in the paper": {"color": "black", "marker": "x", "linestyle": ""}})
    return figure


def trajectories(found: Mapping[Key, Group], scenario_name: str) -> Figure:
    """As Fig. 5: the model at the estimates of seed 0, both protocols."""
    scenario = files.chosen([scenario_name])[0]
    figure = new_figure(11.0, 6.4)
    truth, samples = simulate(scenario.truth, scenario.drive)["theta"], scenario.recording(0)[
        "theta"]
    for axes, protocol in zip(figure.subplots(2, 1, sharex=True), ("paper", "default"),
                              strict=True):
        axes.plot(samples.time, samples.values * 180 / pi, ".", color=MEASURED, markersize=4,
                  label="samples")
        axes.plot(truth.time, truth.values * 180 / pi, color="black", linewidth=3, label="truth")
        for strategy in FIVE:
            g = found.get((scenario_name, strategy, protocol))
            if g is None or not np.all(np.isfinite([c.estimates[0] for c in g.cells.values()])):
                continue
            model = scenario.fitted.with_values(
                {p: float(c.estimates[0]) for p, c in g.cells.items()})
            y = simulate(model, scenario.drive)["theta"]
            axes.plot(y.time, y.values * 180 / pi, color=colour(strategy), linewidth=1.2,
                      linestyle="--" if FIVE.index(strategy) % 2 else "-", label=strategy)
        axes.set_ylabel("surface angle θ [deg]")
        axes.set_title(f"{scenario.label}, protocol: {protocol}", loc="left", fontsize="small")
        _legend(axes)
        tidy(axes)
    axes.set_xlabel("time [s]")
    return figure


def water() -> Figure:
    """As Fig. 4: the first mode, fitted to one run of filmed water and shown on it and another."""
    model = pk.Model.from_dict(MODELS["slosh"])
    runs = ("LE_2D_0m_5s_900deg", "LE_2D_0m_5.3s_900deg")
    figure = new_figure(11.0, 3.4 * len(runs))
    train = datasets.slosh_lar_forced(runs[0])
    fitted = pk.NLS().fit(model, train).fitted_model
    for axes, name in zip(figure.subplots(len(runs), 1), runs, strict=True):
        run = datasets.slosh_lar_forced(name)
        h, y = run["h"], simulate(fitted, run, t=run["h"].time)["h"]
        axes.plot(h.time, h.values, ".", color=MEASURED, markersize=4, label="filmed")
        axes.plot(y.time, y.values, color=COLOURS[0], linewidth=1.6, label="first mode, NLS")
        axes.set_title(f"{name}, {'fitted' if name == runs[0] else 'held out'}", loc="left",
                       fontsize="small")
        axes.set_ylabel("height [mm]")
        _legend(axes)
        tidy(axes)
    axes.set_xlabel("time [s]")
    return figure


def pareto(found: Mapping[Key, Group]) -> Figure:
    """Error of d against processor time."""
    figure = new_figure(11.0, 4.6)
    for axes, scenario in zip(figure.subplots(1, 2, sharey=True), ("dense_low", "sparse_high"),
                              strict=True):
        for strategy in FIVE:
            for protocol in MARKS:
                g = found.get((scenario, strategy, protocol))
                if g is None:
                    continue
                cell = g.cells["d_theta"]
                rmse = cell.rmse
                axes.errorbar(
                    1e3 * g.cpu, rmse.value / cell.true,
                    yerr=[[max(rmse.value - rmse.low, 0.0) / cell.true],
                          [max(rmse.high - rmse.value, 0.0) / cell.true]],
                    fmt=MARKS[protocol], color=colour(strategy), markersize=7,
                    markerfacecolor="white" if protocol == "paper" else colour(strategy))
        axes.axhline(cell.bound / cell.true, color="black", linewidth=0.8)
        axes.text(0.97, cell.bound / cell.true * 1.08, "Cramér-Rao", fontsize="small",
                  ha="right", transform=axes.get_yaxis_transform())
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_title(g.label if g else scenario, loc="left", fontsize="small")
        axes.set_xlabel("processor time of a fit [ms]")
        tidy(axes)
    figure.axes[0].set_ylabel("RMSE of d / true value [-]")
    _key(figure.axes[1], {s: {"color": colour(s), "marker": "s", "linestyle": ""} for s in FIVE} | {
        "default": {"color": MEASURED, "marker": "^", "linestyle": ""},
        "protocol of the paper": {"color": MEASURED, "marker": "o", "linestyle": "",
                                  "markerfacecolor": "white"}})
    return figure


def against_sampling(rmse: Mapping[tuple[str, str], Mapping[str, Any]],
                     bound: Mapping[str, Any]) -> Figure:
    """RMSE against σ at N = 501 and against N at σ = 1°."""
    figure = new_figure(11.0, 7.0)
    grid = figure.subplots(2, 2, sharey="row")
    n = [500 // s + 1 for s in STRIDES]
    for row, parameter in zip(grid, NAMES, strict=True):
        for axes, x, pick, label in ((row[0], SIGMAS, (-1, slice(None)), "σ [deg], N = 501"),
                                     (row[1], n, (slice(None), SIGMAS.index(1.0)), "N, σ = 1°")):
            for (strategy, protocol), own in rmse.items():
                axes.plot(x, own[parameter][pick], "--" if protocol == "paper" else "-",
                          marker=MARKS[protocol], markersize=5, color=colour(strategy),
                          label=f"{strategy}, {protocol}")
            axes.plot(x, bound[parameter][pick], color="black", linewidth=3, alpha=0.3,
                      label="Cramér-Rao")
            axes.set_xscale("log")
            axes.set_yscale("log")
            axes.set_xticks(x, [f"{v:g}" for v in x])
            axes.minorticks_off()
            axes.set_xlabel(label)
            tidy(axes)
        row[0].set_ylabel(f"RMSE of {NAMES[parameter]} / true value [-]")
    _legend(grid[0, 1])
    return figure


def basins(maps: Mapping[str, tuple[Basin, Any]], true: Mapping[str, float]) -> Figure:
    """Ends of fits by their start: SciPy's optimiser with exact derivatives, and NLS."""
    from matplotlib.colors import ListedColormap

    figure = new_figure(11.0, 7.0)
    kinds = ListedColormap(["#009E73", "#E69F00", "#D55E00"])
    grid = figure.subplots(len(maps), 2, sharex=True, sharey=True)
    for row, (basin, trf) in zip(grid, maps.values(), strict=True):
        off = np.abs(trf[..., 0] / true["l_theta"] - 1.0) > 0.05
        off |= np.abs(trf[..., 1] / true["d_theta"] - 1.0) > 1.3
        ours = np.where(basin.right, 0, np.where(basin.misfit, 1, 2))
        for axes, code, text in ((row[0], np.where(off, 1, 0), "TRF, exact derivatives"),
                                 (row[1], ours, "NLS of the kit, one start")):
            axes.pcolormesh(LENGTHS, DAMPINGS, code, cmap=kinds, vmin=0, vmax=2, shading="nearest")
            axes.plot(true["l_theta"], true["d_theta"], "*", color="white", markersize=12,
                      markeredgecolor="black")
            axes.plot(0.06, 0.05, "P", color="white", markersize=8, markeredgecolor="black")
            axes.set_xscale("log")
            axes.set_yscale("log")
            axes.set_xticks(TICKS, [f"{t:g}" for t in TICKS])
            axes.minorticks_off()
            axes.set_title(f"{files.chosen([basin.scenario])[0].label}: {text}", loc="left",
                           fontsize="small")
        row[0].set_ylabel("start d₀ [N s/m]")
    for axes in grid[-1]:
        axes.set_xlabel("start l₀ [m]")
    _key(grid[0, 1], {
        "truth found": {"color": "#009E73", "marker": "s", "linestyle": ""},
        "elsewhere (right: and χ² says so)": {"color": "#E69F00", "marker": "s", "linestyle": ""},
        "elsewhere, χ² accepts": {"color": "#D55E00", "marker": "s", "linestyle": ""}})
    return figure


def relaxation(sweeps: Mapping[str, Sweep]) -> Figure:
    """RMSE of iPDA over that of NLS against λ, scenario by scenario."""
    figure = new_figure(11.0, 4.4)
    for k, (axes, parameter) in enumerate(zip(figure.subplots(1, 2, sharey=True), NAMES,
                                              strict=True)):
        for n, (name, one) in enumerate(sweeps.items()):
            relaxed, hard = one.rmse(k)
            axes.plot(LAMBDAS, relaxed / hard, "o-", color=COLOURS[n % len(COLOURS)], markersize=4,
                      label=files.chosen([name])[0].label)
        axes.axhline(1.0, color="black", linewidth=0.8)
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_xlabel("λ (dimensionless)")
        axes.set_title(f"parameter {NAMES[parameter]}", loc="left", fontsize="small")
        tidy(axes)
    figure.axes[0].set_ylabel("RMSE of iPDA at λ / RMSE of NLS [-]")
    figure.axes[0].legend(frameon=False, fontsize="small")
    return figure


def partitioning(shares: list[Share]) -> Figure:
    """Standard error of d against the number of intervals, at several λ."""
    figure = new_figure(7.0, 4.2)
    axes = figure.subplots()
    for k, lam in enumerate(dict.fromkeys(s.lam for s in shares)):
        own = [s for s in shares if s.lam == lam]
        axes.plot([s.auxiliary for s in own], [s.stated for s in own], "o-", color=COLOURS[k],
                  label=f"λ = {lam:g}: stated")
        axes.plot([s.auxiliary for s in own], [s.rmse for s in own], "x:", color=COLOURS[k],
                  label=f"λ = {lam:g}: actual RMSE")
    axes.axhline(1.0, color="black", linewidth=0.8)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("auxiliary unknowns (spline coefficients)")
    axes.set_ylabel("error of d / Cramér-Rao [-]")
    axes.legend(frameon=False, fontsize="x-small", ncols=2)
    tidy(axes)
    return figure


def _key(axes: Axes, entries: Mapping[str, Mapping[str, Any]]) -> None:
    from matplotlib.lines import Line2D

    axes.legend(handles=[Line2D([], [], label=n, **style) for n, style in entries.items()],
                loc="lower right", bbox_to_anchor=(1.0, 1.06), ncols=4, frameon=False,
                fontsize="small", borderaxespad=0.1)


def _legend(axes: Axes) -> None:
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=8, frameon=False,
                fontsize="small", borderaxespad=0.1)
