"""Are laws named rightly, nothing named nothing, and whole networks read as what they learned?

Usage: python benchmarks/report_symbolic.py FOLDER [SEEDS] [PYKAN_SEEDS] [stored]

Writes FOLDER/symbolic.md and its figures.  Every case is kept in build/symbolic, so that a run that
was cut off goes on where it stopped; "stored" writes the report of what is there.  Genetic
programming runs beside where pyoperon and gplearn are installed.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from functools import partial
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from provenance import provenance
from symbolic_edges import NOISES, NULLS, TRUTHS, run_edge, run_null, run_pykan
from symbolic_feynman import (
    FORMULAS,
    SECONDS,
    run_feynman,
    run_feynman_gplearn,
    run_feynman_operon,
    run_feynman_pykan,
)
from symbolic_friction import NAMES, run_friction
from symbolic_networks import INPUTS, NETWORKS, NOISE, data, run_network, run_pykan_network, train
from symbolic_store import collected as collected_or_stored

from pikanid.figures import new_figure, save_figure, tidy
from pikanid.pieces.sheet import Sheet
from pikanid.storage.outputs import atomically
from pikanid.symbolic import extract

SEEDS, PYKAN_SEEDS = 20, 2
FEYNMAN_SEEDS = 1
STORED = "stored" in sys.argv
collected = partial(collected_or_stored, stored=STORED)


class Page:
    """A report that grows paragraph by paragraph."""

    def __init__(self, title: str, folder: Path) -> None:
        self.parts, self.folder = [f"# {title}"], folder

    def heading(self, text: str) -> None:
        self.parts.append(f"## {text}")

    def text(self, text: str) -> None:
        self.parts.append(text)

    def table(self, headers: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> None:
        self.parts.append(Sheet(headers, tuple(rows)).to_markdown())

    def markdown(self) -> str:
        return "\n\n".join(self.parts) + "\n"


def middle(values: Sequence[float], form: str = ".1f") -> str:
    """The median, "-" of nothing."""
    return format(float(np.median(values)), form) if len(values) else "-"


def count(results: Sequence[dict[str, Any]], key: str) -> str:
    """How many of how many."""
    return f"{sum(bool(r[key]) for r in results)}/{len(results)}"


def edges(page: Page, seeds: int, pykan_seeds: int) -> None:
    """(a) single edges."""
    page.heading("Single edges")
    rows, ours, theirs = [], [], []
    for truth in TRUTHS:
        for noise in NOISES:
            mine = collected("edges", run_edge, [(truth.label, noise, s) for s in range(seeds)])
            other = collected("pykan_edges", run_pykan,
                              [(truth.label, noise, s) for s in range(pykan_seeds)])
            if noise <= 0.05:
                ours += mine
                theirs += other
            wrong = sorted({r["name"] for r in mine if not r["exact"]})
            rows.append((truth.label, f"{100 * noise:g} %", count(mine, "exact"),
                         count(mine, "same"), ", ".join(wrong), count(other, "auto_exact"),
                         ", ".join(sorted({r["auto"] for r in other})),
                         count(other, "suggest_exact"),
                         ", ".join(sorted({r["suggest"] for r in other}))))
    seconds = [r["seconds"] for r in collected(
        "edges", run_edge, [(t.label, n, s) for t in TRUTHS for n in NOISES for s in range(seeds)])]
    slow = [r["auto_seconds"] for r in theirs]
    page.text(
        f"1000 points on [-1, 1], noise as a share of the law's standard deviation, its size not "
        f"told. At 5 % of noise or less the exact form was named in {count(ours, 'exact')} cases "
        f"({count(ours, 'same')} counting forms whose curve agrees with the law's within the "
        f"noise); pykan's `auto_symbolic` in {count(theirs, 'auto_exact')} and `suggest_symbolic`, "
        f"ranked by r² alone, in {count(theirs, 'suggest_exact')}, on the same points with "
        f"{pykan_seeds} seeds only: it names a spline of 20 intervals at 200 places, its time "
        f"growing with their number, and its library has no x·|x|, no dead zone and no free power. "
        f"CPU time an edge: median {np.median(seconds):.2f} s, largest {max(seconds):.2f} s here; "
        f"{np.median(slow):.1f} s for `auto_symbolic`.")
    page.table(("law", "noise", "exact", "exact or within noise", "else named", "auto_symbolic",
                 "it says", "suggest_symbolic", "it says"), rows)


def nulls(page: Page) -> None:
    """(c) edges of noise."""
    results = collected("nulls", run_null, [(s,) for s in range(NULLS)])
    named = sorted({r["name"] for r in results if not r["exact"]})
    page.heading("Edges of nothing but noise")
    page.text(f"{count(results, 'exact')} edges of 1000 points of white noise were named "
               f"\"nothing\"{', the others ' + ', '.join(named) if named else ''}.")


def networks(page: Page, seeds: int, pykan_seeds: int) -> None:
    """(b) whole networks."""
    rows = []
    for network in NETWORKS:
        mine = collected("networks", run_network, [(network.label, s) for s in range(seeds)])
        other = collected("pykan_networks", run_pykan_network,
                          [(network.label, s) for s in range(pykan_seeds)])
        false = sum(r["ok"] and not r["exact"] for r in mine)
        rows.append((network.label, str(list(network.width)), count(mine, "exact"), str(false),
                     middle([r["error"] for r in mine], ".2%"),
                     middle([r["seconds"] for r in mine]),
                     "; ".join(str(r["names"]) for r in other),
                     middle([r["error"] for r in other], ".2%"),
                     middle([r["seconds"] for r in other], ".0f")))
    page.heading("Whole networks")
    page.text(f"KANs trained on 1000 points with {100 * NOISE:g} % of noise, the best of three "
               "starts, then read; pykan's `auto_symbolic` and its own refit on the same models "
               f"with {pykan_seeds} seeds. \"Wrong but ok\" counts readings of another form that "
               "called themselves right. Errors are against the clean law, as shares of its "
               "spread.")
    page.table(("law", "width", "exact form", "wrong but ok", "error, median", "CPU s to read",
                 "pykan's names, layer by layer", "its error", "its CPU s"), rows)
    page.text(f"{NETWORKS[1].label} as it was read from the network of seed 0, every edge with "
              "its 95 % band:")
    page.text("![network of two layers](figures/symbolic_network.png)")
    if STORED and (page.folder / "figures" / "symbolic_network.png").exists():
        return
    shown, x, _, y = data(NETWORKS[1].label, 0)
    reading = extract(train(shown.width, x, y).kan, x, y, inputs=INPUTS)
    save_figure(reading.plot(), page.folder / "figures" / "symbolic_network.png")


def drawn(shown: Sequence[tuple[str, dict[str, Any]]]) -> Figure:
    """The edges that were named, with their bands and the truths behind the same gauge."""
    figure = new_figure(4.4 * len(shown), 3.4)
    for k, (label, picture) in enumerate(shown):
        axes = figure.add_subplot(1, len(shown), k + 1)
        a, value, std = (np.array(picture[n]) for n in ("argument", "values", "std"))
        axes.fill_between(a, value - 1.96 * std, value + 1.96 * std, color="#BBBBBB",
                          linewidth=0, label="95 % band")
        axes.plot(a, value, color="#0072B2", label="edge")
        axes.plot(a, picture["truth"], "--", color="#D55E00", label="truth, gauge-fixed")
        axes.set_xlabel("θ' [rad/s]")
        axes.set_title(label, fontsize=10)
        if k == 0:
            axes.set_ylabel("δ [rad/s²]")
            axes.legend(fontsize=8)
        tidy(axes)
    return figure


def friction(page: Page, seeds: int) -> None:
    """Laws inside an ODE."""
    rows, shown = [], []
    for label in NAMES:
        found = collected("friction", run_friction, [(label, s) for s in range(seeds)])
        shown += [(label, r["picture"]) for r in found if r["picture"]]
        z = [(r["estimate"] - r["coefficient"]) / r["std"] for r in found
             if r["ode_exact"] and r["std"]]
        false = [sum(r[ok] and not r[exact] for r in found)
                 for ok, exact in (("ok", "ode_exact"), ("edge_ok", "edge_exact"))]
        others = sorted({"; ".join(r["ode"]) or "nothing" for r in found if not r["ode_exact"]})
        rows.append((label, NAMES[label], count(found, "found"), count(found, "ode_exact"),
                     ", ".join(others), str(false[0]), count(found, "edge_exact"), str(false[1]),
                     f"{np.sqrt(np.mean(np.square(z))):.2f}" if z else "",
                     middle([r["seconds"] for r in found]),
                     middle([r["reading_seconds"] for r in found])))
    page.heading("Laws missing in an ODE")
    page.text("A slosh model that lacks a law of 100 Cramér-Rao bounds of its coefficient, 20 s at "
              "σ = 0.1°, even seeds driven by planar-motor moves with rests between, odd seeds by "
              "a multisine. `kan_discrepancy` over θ and θ' learns through the simulation; "
              "`extract` with the recording puts every likely law into the equation, refits all "
              "parameters and compares them by BIC; without it the edge alone is named. The edge "
              "of θ counts too: it must be nothing. \"Wrong but ok\" counts other answers that "
              "called themselves right. Where friction brings the pendulum to rest the edge alone "
              "says that it cannot judge.")
    page.table(("law", "right name", "found", "named", "else named", "wrong but ok",
                "named by the edge alone", "wrong but ok",
                "rms of (estimate - truth)/standard error", "CPU s to train", "CPU s to read"),
               rows)
    save_figure(drawn(shown), page.folder / "figures" / "symbolic_edges.png")
    page.text("![edges of friction and drag, seed 0](figures/symbolic_edges.png)")


GENETIC = (("pyoperon", "operon_feynman", run_feynman_operon),
           ("gplearn", "gplearn_feynman", run_feynman_gplearn))


def feynman(page: Page, seeds: int) -> None:
    """Twelve formulas."""
    rows, mine, theirs = [], [], []
    beside = [g for g in GENETIC if find_spec(g[0])]
    genetic: dict[str, list[dict[str, Any]]] = {name: [] for name, _, _ in beside}
    for formula in FORMULAS:
        own = collected("feynman", run_feynman, [(formula.number, s) for s in range(seeds)])
        other = collected("pykan_feynman", run_feynman_pykan, [(formula.number, 0)])
        mine += own
        theirs += other
        marks = []
        for name, part, function in beside:
            found = collected(part, function, [(formula.number, 0)])
            genetic[name] += found
            marks.append(count(found, "recovered"))
        false = sum(r["ok"] and not r["recovered"] for r in own)
        rows.append((formula.number, formula.text, count(own, "recovered"), str(false),
                     f"`{own[0]['formula']}`" if own else "-", count(other, "recovered"), *marks))
    page.heading("Twelve formulas of the Feynman lectures")
    told = "; ".join(f"{name} {version(name)} {count(genetic[name], 'recovered')}"
                     for name in genetic)
    page.text(
        f"Formulas and ranges of Udrescu & Tegmark, AI Feynman, Science Advances 6, eaay2631, "
        f"2020, table 4; 1000 points, 1 % of noise, {seeds} seed{'s' * (seeds > 1)} a formula, one "
        f"for the others. The network is [n, one product of n sums, 1], or a single edge. "
        f"Recovered means: within 1 % of the spread on a box half as wide again, where no point "
        f"was. Here {count(mine, 'recovered')}, median "
        f"{middle([r['seconds'] for r in mine], '.0f')} CPU s to read; pykan's `auto_symbolic` "
        f"with its refit, on the same networks, "
        f"{count(theirs, 'recovered')}. "
        + (f"Genetic programming on the points themselves, without a network: {told}; pyoperon "
           f"with {SECONDS} s of one thread a formula, gplearn with 40 generations of 1000. "
           if told else "Neither pyoperon nor gplearn was installed beside it. ")
        + "PySR is not beside them: it needs a Julia toolchain.")
    page.table(("number", "formula", "recovered", "wrong but ok", "read with seed 0", "pykan",
                *genetic), rows)


def main(folder: Path, seeds: int, pykan_seeds: int) -> None:
    """Compute what is not there yet, and write the report."""
    (folder / "figures").mkdir(parents=True, exist_ok=True)
    page = Page("Reading networks", folder)
    page.text(f"With {provenance()}. Times are CPU times of one thread.")
    if STORED:
        page.text("Written of the cases that are stored so far: of every count the second number "
                  "says how many these are.")
    edges(page, seeds, pykan_seeds)
    nulls(page)
    networks(page, seeds, pykan_seeds)
    friction(page, seeds)
    feynman(page, FEYNMAN_SEEDS)
    atomically(folder / "symbolic.md", page.markdown().encode())


if __name__ == "__main__":
    numbers = [int(a) for a in sys.argv[2:4] if a != "stored"]
    main(Path(sys.argv[1]), *[*numbers, *(SEEDS, PYKAN_SEEDS)[len(numbers):]])
