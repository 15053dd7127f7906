"""Which strategy should one use?  Said by the figures of the study alone."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from benchmark_data import FIVE, Key, first

from pikanid.pieces.sheet import Sheet
from pikanid.reporting.benchmark_sheets import digits, percent
from pikanid.validation.benchmark.cells import Group
from pikanid.validation.benchmark.files import GROUPS

EQUAL = 1.1  # ratio of errors up to which two strategies do equally well


def table(found: Mapping[Key, Group]) -> Sheet:
    """For every scenario the best strategies of the default protocol, on equal seeds.

    PINNs are left out: they have been run too seldom.
    """
    rows = []
    for scenario in (*GROUPS["paper"], *GROUPS["beyond"]):
        own = [found[scenario, s, "default"] for s in FIVE
               if (scenario, s, "default") in found and s != "pinn"]
        if not own or scenario.endswith("clean"):
            continue
        seeds = min(g.seeds for g in own)
        own = [first(g, seeds) for g in own]
        errors = {g.strategy: _error(g) for g in own}
        best = min(errors.values())
        good = [g for g in own if errors[g.strategy] <= EQUAL * best]
        quick = min(good, key=lambda g: g.cpu)
        rows.append((
            own[0].label, str(seeds), ", ".join(g.strategy for g in good),
            digits(100 * best), quick.strategy, digits(1e3 * quick.cpu), ", ".join(
                f"{g.strategy} {percent(g.breakdowns)}" for g in own if g.breakdowns.value > 0)
            or "none", f"{100 * min(g.misfits for g in good):.0f}"))
    headers = ("scenario", "seeds", "least error (within 10 %)", "RMSE [%]", "quickest of them",
               "CPU [ms]", "broke down [%]", "χ² complains [%]")
    return Sheet(headers, tuple(rows), ("seeds", "RMSE [%]", "CPU [ms]", "χ² complains [%]"))


def _error(g: Group) -> float:
    """Root mean square of the relative errors of all parameters."""
    return float(np.sqrt(np.mean([
        (c.rmse.value / c.true) ** 2 for c in g.cells.values()])))
