"""Repeated seeds: does each strategy reach the Cramér-Rao bound, and do its intervals cover?

Usage: python benchmarks/report_statistics.py FOLDER [SEEDS] [STRATEGY=SEEDS ...]

Writes FOLDER/statistics.md and FOLDER/figures/statistics.png.  With n seeds the ratio (RMSE/CRB)²
of an efficient estimator follows χ²_n/n; the table gives its 99.9 % interval.  A breakdown is an
error beyond six times the bound.  RMSE/NLS compares with NLS on the same seeds.

Every fit is kept in build/statistics, so that parts can be run one at a time (STRATEGY=0 leaves one
out) and an interrupted run goes on; remove that folder when the code has changed.
"""

from __future__ import annotations

import io
import json
import os
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from provenance import provenance
from scipy.stats import chi2

from pikanid import errors
from pikanid.pieces.sheet import Sheet
from pikanid.strategies import IPDA, NLS, PIKAN
from pikanid.uncertainty import cramer_rao
from pikanid.validation.study import slosh

STRATEGIES: dict[str, Any] = {
    "nls": NLS(), "ipda": IPDA(), "pikan": PIKAN(), "pikan-deep": PIKAN(width=(1, 5, 1))}
SEEDS = {"nls": 400, "ipda": 400, "pikan": 100, "pikan-deep": 100}
DENSE_ONLY = ("pikan-deep",)
LEVEL = 0.999
QUANTILE = 1.959963984540054
STORE = Path("build") / "statistics"
PARAMETERS = tuple(slosh.TRUE)
TRUE = np.array([slosh.TRUE[p] for p in PARAMETERS])
Fit = dict[str, Any]


def fitted(scenario: slosh.Scenario, name: str, seeds: int) -> list[Fit]:
    """Fits of seeds 0, 1, ... from Table II's p0; those of an earlier run are read."""
    STORE.mkdir(parents=True, exist_ok=True)
    path = STORE / f"{name}-{scenario.sampling}-{scenario.noise:g}.jsonl"
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    known = {fit["seed"]: fit for fit in map(json.loads, lines)}
    for seed in range(seeds):
        if seed in known:
            continue
        known[seed] = {"seed": seed, **one_fit(scenario, name, seed)}
        with path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(known[seed]) + "\n")
    return [known[seed] for seed in range(seeds)]


def one_fit(scenario: slosh.Scenario, name: str, seed: int) -> Fit:
    """Estimate, standard errors, seconds and verdict of one fit; NaN where it failed."""
    model = slosh.model().with_values(slosh.START)
    try:
        e = STRATEGIES[name].fit(model, slosh.recording(scenario, seed))
    except errors.PikanidError:
        nothing = [np.nan] * len(PARAMETERS)
        return {"theta": nothing, "std": nothing, "seconds": np.nan, "ok": False, "warnings": 0}
    return {"theta": [e.value(p) for p in PARAMETERS], "std": [e.std(p) for p in PARAMETERS],
            "seconds": e.seconds, "ok": bool(e.ok), "warnings": len(e.warnings)}


def rmse(fits: Sequence[Fit]) -> np.ndarray:
    """Root mean square error of every parameter."""
    misses = np.array([fit["theta"] for fit in fits]) - TRUE
    return np.sqrt(np.nanmean(misses**2, axis=0))


def interval(seeds: int) -> tuple[float, float]:
    """Where RMSE/CRB of an efficient estimator lies with the probability `LEVEL`."""
    low, high = np.sqrt(chi2.ppf([(1 - LEVEL) / 2, (1 + LEVEL) / 2], seeds) / seeds)
    return float(low), float(high)


def row(scenario: slosh.Scenario, name: str, fits: list[Fit]) -> tuple[str, ...]:
    """One strategy in one scenario."""
    bound = cramer_rao(slosh.model(), slosh.recording(scenario, 0))
    low, high = interval(len(fits))
    cells = [scenario.label, name, str(len(fits)), f"{low:.3f} to {high:.3f}"]
    nls = rmse(fitted(scenario, "nls", len(fits)))
    for i, p in enumerate(PARAMETERS):
        error = np.array([fit["theta"][i] for fit in fits]) - TRUE[i]
        covered = np.mean(np.abs(error) <= QUANTILE * np.array([fit["std"][i] for fit in fits]))
        cells += [f"{rmse(fits)[i] / bound.std(p):.3f}", f"{rmse(fits)[i] / nls[i]:.3f}",
                  f"{np.nanmean(error) / bound.std(p):+.3f}", f"{100 * covered:.1f}",
                  f"{np.nanmax(np.abs(error)) / bound.std(p):.1f}"]
    limits = 6 * np.array([bound.std(p) for p in PARAMETERS])
    broken = sum(not np.all(np.abs(np.array(fit["theta"]) - TRUE) <= limits) for fit in fits)
    return (*cells, str(broken), f"{1e3 * np.nanmedian([fit['seconds'] for fit in fits]):.3g}")


def clean(scenario: slosh.Scenario, name: str) -> tuple[str, ...]:
    """Relative errors without noise."""
    error = np.array(one_fit(scenario, name, 0)["theta"]) / TRUE - 1
    return (scenario.label, name, *(f"{e:+.1e}" for e in error))


def figure(found: dict[tuple[str, str], list[Fit]]) -> bytes:
    """RMSE/CRB of every strategy and scenario beside the interval of an efficient estimator."""
    from matplotlib.figure import Figure

    drawn = Figure(figsize=(9.0, 3.6), layout="constrained")
    scenarios = [s for s in slosh.SCENARIOS if s.noise]
    names = list(dict.fromkeys(name for _, name in found))
    for axes, (i, p) in zip(drawn.subplots(1, 2, sharey=True), enumerate(PARAMETERS), strict=True):
        for k, name in enumerate(names):
            for j, scenario in enumerate(scenarios):
                fits = found.get((scenario.label, name))
                if fits is None:
                    continue
                bound = cramer_rao(slosh.model(), slosh.recording(scenario, 0))
                place = j + 0.16 * (k - 0.5 * (len(names) - 1))
                low, high = interval(len(fits))
                axes.plot([place, place], [low, high], color="0.8", lw=5, solid_capstyle="butt")
                axes.plot(place, rmse(fits)[i] / bound.std(p), "o", color=f"C{k}",
                          label=name if j == 0 else None)
        axes.axhline(1.0, color="0.5", lw=0.8, zorder=0)
        axes.set_xticks(range(len(scenarios)), [s.label for s in scenarios])
        axes.set_title(p)
        axes.set_ylim(bottom=0.0)
    axes.legend(frameon=False, loc="lower right")
    drawn.axes[0].set_ylabel("RMSE / Cramér-Rao bound")
    picture = io.BytesIO()
    drawn.savefig(picture, format="png", dpi=110)
    return picture.getvalue()


def main(folder: str, *wanted: str) -> None:
    """Run what is missing and write the report, atomically."""
    seeds = dict(SEEDS)
    for item in wanted:
        name, _, count = item.rpartition("=")
        seeds |= {name: int(count)} if name else dict.fromkeys(seeds, int(count))
    names = [name for name in STRATEGIES if seeds[name]]
    found = {(s.label, name): fitted(s, name, seeds[name])
             for s in slosh.SCENARIOS for name in names
             if s.noise and not (name in DENSE_ONLY and s.stride > 1)}
    scenarios = {s.label: s for s in slosh.SCENARIOS}
    headers = ["scenario", "strategy", "seeds", "99.9 % interval"]
    for p in ("l", "d"):
        headers += [f"RMSE/CRB {p}", f"RMSE/NLS {p}", f"bias/CRB {p}", f"cover {p} [%]",
                    f"worst/CRB {p}"]
    headers += ["breakdowns", "ms a fit"]
    rows = tuple(row(scenarios[label], name, fits) for (label, name), fits in found.items())
    exact = tuple(clean(s, name) for s in slosh.SCENARIOS for name in names
                  if not s.noise and not (name in DENSE_ONLY and s.stride > 1))
    text = (
        f"# Repeated seeds\n\nWritten by `benchmarks/report_statistics.py` with {provenance()}. "
        f"Slosh pendulum, two pulses; truth {slosh.TRUE}, start {slosh.START}; noise seeds "
        "0, 1, ... . \"cover\" is the share of 95 % intervals that hold the truth, \"worst\" the "
        "largest error; RMSE/NLS is taken over the same seeds. `pikan-deep` is the network "
        "[1, 5, 1].\n\n" + Sheet(tuple(headers), rows, tuple(headers[2:])).to_markdown()
        + "\n\n![RMSE in units of the bound](figures/statistics.png)\n\n*Grey: where an efficient "
        "estimator lies with 99.9 % probability, given the number of seeds.*\n\n"
        "## Without noise\n\n"
        + Sheet(("scenario", "strategy", "relative error of l", "relative error of d"), exact,
                ("relative error of l", "relative error of d")).to_markdown() + "\n")
    (Path(folder) / "figures").mkdir(parents=True, exist_ok=True)
    write(Path(folder) / "figures" / "statistics.png", figure(found))
    write(Path(folder) / "statistics.md", text.encode())


def write(target: Path, content: bytes) -> None:
    """A whole file or none."""
    handle, temporary = tempfile.mkstemp(dir=target.parent, suffix=".part")
    with os.fdopen(handle, "wb") as file:
        file.write(content)
    os.replace(temporary, target)


if __name__ == "__main__":
    main(*sys.argv[1:])
