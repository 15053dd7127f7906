"""Repeated seeds: does each strategy reach the Cramér-Rao bound, and do its intervals cover?

Usage: python benchmarks/report_statistics.py FOLDER [SEEDS] [STRATEGY=SEEDS ...]

Writes FOLDER/statistics.md.  With n seeds the ratio (RMSE/CRB)² of an efficient estimator follows
χ²_n/n; the table gives its 99.9 % interval.  A breakdown is an error beyond six times the bound.
"""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path

import numpy as np
from scipy.stats import chi2

import pikanid
from pikanid.reporting.sheet import Sheet
from pikanid.strategies import STRATEGIES
from pikanid.study import slosh
from pikanid.uncertainty import cramer_rao

SEEDS = {"nls": 400, "ipda": 400, "pikan": 100}
LEVEL = 0.999
QUANTILE = 1.959963984540054


def row(scenario: slosh.Scenario, name: str, seeds: int) -> list[str]:
    """One strategy in one scenario, started at Table II's p0."""
    estimates = [e for seed in range(seeds)
                 if (e := slosh.fit(scenario, name, seed).estimate) is not None]
    bound = cramer_rao(slosh.model(), slosh.recording(scenario, 0))
    low, high = np.sqrt(chi2.ppf([(1 - LEVEL) / 2, (1 + LEVEL) / 2], seeds) / seeds)
    cells = [scenario.label, name, str(seeds), f"{low:.3f} to {high:.3f}"]
    for p, true in slosh.TRUE.items():
        error = np.array([e.value(p) - true for e in estimates])
        covered = np.mean(np.abs(error) <= QUANTILE * np.array([e.std(p) for e in estimates]))
        worst = np.max(np.abs(error)) / bound.std(p)
        cells += [f"{np.sqrt(np.mean(error**2)) / bound.std(p):.3f}",
                  f"{np.mean(error) / bound.std(p):+.3f}", f"{100 * covered:.1f}", f"{worst:.1f}"]
    broken = sum(any(abs(e.value(p) - t) > 6 * bound.std(p) for p, t in slosh.TRUE.items())
                 for e in estimates)
    return [*cells, str(broken + seeds - len(estimates)),
            f"{1e3 * np.median([e.seconds for e in estimates]):.3g}"]


def main(folder: str, *wanted: str) -> None:
    """Run everything and write the report, atomically."""
    seeds = dict(SEEDS)
    for item in wanted:
        name, _, count = item.rpartition("=")
        seeds |= {name: int(count)} if name else dict.fromkeys(seeds, int(count))
    known = [n for n in seeds if n in STRATEGIES]
    headers = ["scenario", "strategy", "seeds", "99.9 % interval"]
    for p in ("l", "d"):
        headers += [f"RMSE/CRB {p}", f"bias/CRB {p}", f"cover {p} [%]", f"worst/CRB {p}"]
    headers += ["breakdowns", "ms a fit"]
    noisy = [s for s in slosh.SCENARIOS if s.noise]
    rows = [tuple(row(s, n, seeds[n])) for s in noisy for n in known if seeds[n]]
    text = (
        "# Repeated seeds\n\nWritten by `benchmarks/report_statistics.py` with pikanid "
        f"{pikanid.__version__}, NumPy {np.__version__}. Slosh pendulum, two pulses; truth "
        f"{slosh.TRUE}, start {slosh.START}; noise seeds 0, 1, ... . \"cover\" is the share of "
        "95 % intervals that hold the truth, \"worst\" the largest error.\n\n"
        + Sheet(tuple(headers), tuple(rows), tuple(headers[2:])).to_markdown() + "\n")
    target = Path(folder) / "statistics.md"
    handle, temporary = tempfile.mkstemp(dir=target.parent, suffix=".part")
    with os.fdopen(handle, "w") as file:
        file.write(text)
    os.replace(temporary, target)


if __name__ == "__main__":
    main(*sys.argv[1:])
