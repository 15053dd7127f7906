"""Are laws named rightly, nothing named nothing, and whole networks read as what they learned?

Usage: python benchmarks/report_symbolic.py FOLDER [SEEDS] [PYKAN_SEEDS]

Writes FOLDER/symbolic.md.  Every case is kept in build/symbolic, so that a run that was cut off
goes on where it stopped; a part whose cases are all there costs nothing.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from provenance import provenance
from symbolic_edges import NOISES, NULLS, TRUTHS, run_edge, run_null, run_pykan
from symbolic_feynman import FORMULAS, run_feynman, run_feynman_pykan
from symbolic_friction import NAMES, run_friction
from symbolic_networks import NETWORKS, NOISE, run_network, run_pykan_network
from symbolic_store import collected

from pikanid.reporting.sheet import Sheet
from pikanid.writing import atomically

SEEDS, PYKAN_SEEDS = 20, 2
FEYNMAN_SEEDS = 3


class Page:
    """A report that grows paragraph by paragraph."""

    def __init__(self, title: str) -> None:
        self.parts = [f"# {title}"]

    def heading(self, text: str) -> None:
        self.parts.append(f"## {text}")

    def text(self, text: str) -> None:
        self.parts.append(text)

    def table(self, headers: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> None:
        self.parts.append(Sheet(headers, tuple(rows)).to_markdown())

    def markdown(self) -> str:
        return "\n\n".join(self.parts) + "\n"


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
        rows.append((network.label, str(list(network.width)), count(mine, "exact"),
                     f"{100 * np.median([r['error'] for r in mine]):.2f} %",
                     f"{np.median([r['seconds'] for r in mine]):.1f}",
                     "; ".join(str(r["names"]) for r in other),
                     f"{100 * np.median([r['error'] for r in other]):.2f} %",
                     f"{np.median([r['seconds'] for r in other]):.0f}"))
    page.heading("Whole networks")
    page.text(f"KANs trained on 1000 points with {100 * NOISE:g} % of noise, the best of three "
               "starts, then read; pykan's `auto_symbolic` and its own refit on the same models. "
               "Errors are against the clean law, as shares of its spread.")
    page.table(("law", "width", "exact form", "error, median", "CPU s to read",
                 "pykan's names, layer by layer", "its error", "its CPU s"), rows)


def friction(page: Page, seeds: int) -> None:
    """Laws inside an ODE."""
    rows = []
    for label in NAMES:
        found = collected("friction", run_friction, [(label, s) for s in range(seeds)])
        z = [(r["estimate"] - r["coefficient"]) / r["std"] for r in found
             if r["ode_exact"] and r["std"]]
        rows.append((label, NAMES[label], count(found, "edge_exact"), count(found, "ode_exact"),
                     f"{np.sqrt(np.mean(np.square(z))):.2f}" if z else "",
                     f"{np.median([r['reading_seconds'] for r in found]):.1f}"))
    page.heading("Laws missing in an ODE")
    page.text("A slosh model that lacks a law of 100 Cramér-Rao bounds, 20 s at σ = 0.1°: "
               "`kan_discrepancy` over θ and θ', then `extract` by the edges alone, and with every "
               "likely law refitted inside the ODE. The edge of θ counts too: it must be nothing.")
    page.table(("law", "right name", "by the edge", "in the ODE",
                 "rms of (estimate - truth)/standard error", "CPU s to read"), rows)


def feynman(page: Page, seeds: int, pykan_seeds: int) -> None:
    """Twelve formulas."""
    rows, mine, theirs = [], [], []
    for formula in FORMULAS:
        own = collected("feynman", run_feynman, [(formula.number, s) for s in range(seeds)])
        other = collected("pykan_feynman", run_feynman_pykan,
                          [(formula.number, s) for s in range(pykan_seeds)])
        mine += own
        theirs += other
        rows.append((formula.number, formula.text, count(own, "recovered"),
                     f"`{own[0]['formula']}`", count(other, "recovered")))
    page.heading("Twelve formulas of the Feynman lectures")
    page.text(
        f"Formulas and ranges of Udrescu & Tegmark, Science Advances 6, eaay2631, 2020; 1000 "
        f"points, 1 % of noise. Recovered means: within 1 % of the spread on a box half as wide "
        f"again, where no point was. Here {count(mine, 'recovered')}, pykan's `auto_symbolic` with "
        f"its refit {count(theirs, 'recovered')}. Symbolic regression by PySR is not beside them: "
        f"it needs a Julia toolchain, which this package does not install.")
    page.table(("number", "formula", "recovered", "read with seed 0", "pykan"), rows)


def main(folder: Path, seeds: int, pykan_seeds: int) -> None:
    """Compute what is not there yet, and write the report."""
    page = Page("Reading networks")
    page.text(f"With {provenance()}. Times are CPU times of one thread.")
    edges(page, seeds, pykan_seeds)
    nulls(page)
    networks(page, seeds, pykan_seeds)
    friction(page, seeds)
    feynman(page, FEYNMAN_SEEDS, 1)
    atomically(folder / "symbolic.md", page.markdown().encode())


if __name__ == "__main__":
    numbers = [int(a) for a in sys.argv[2:4]]
    main(Path(sys.argv[1]), *[*numbers, *(SEEDS, PYKAN_SEEDS)[len(numbers):]])
