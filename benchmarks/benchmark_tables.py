"""Tables III and IV beside what the study finds."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from benchmark_data import FIVE, NAMES, SCENARIOS, Key

from pikanid.pieces.sheet import Sheet
from pikanid.reporting.benchmark_sheets import digits, percent, with_interval
from pikanid.reporting.study_sheets import PAPER
from pikanid.validation.benchmark.cells import Group
from pikanid.validation.benchmark.trial import PROTOCOLS

# What Tables III and IV print in their rows of times [s]; of PDA "< 1e-3".
TIMES = {
    "dense_clean": {"nls": 1.76, "pda": 1e-3, "ipda": 0.56, "pinn": 76, "pikan": 1521},
    "dense_low": {"nls": 1.12, "pda": 1e-3, "ipda": 0.54, "pinn": 55, "pikan": 1400},
    "dense_high": {"nls": 1.09, "pda": 1e-3, "ipda": 0.50, "pinn": 40, "pikan": 1619},
    "sparse_clean": {"nls": 0.86, "pda": 1e-3, "ipda": 0.06, "pinn": 20, "pikan": 1651},
    "sparse_low": {"nls": 1.36, "pda": 1e-3, "ipda": 0.06, "pinn": 20, "pikan": 1672},
    "sparse_high": {"nls": 0.80, "pda": 1e-3, "ipda": 0.07, "pinn": 23, "pikan": 1272}}
NUMBERS = ("paper", "seed 0", "median", "spread", "bias [%]", "RMSE [%]", "RMSE/CRB",
           "covers [%]")
LAST = ("broke down [%]", "misfits [%]", "CPU [ms]", "paper's [ms]")


def published(scenario: str, strategy: str, parameter: str) -> float:
    """What the paper prints; NaN where it prints nothing."""
    row = PAPER[scenario].get(strategy)
    return np.nan if row is None else row[list(NAMES).index(parameter)]


def table(found: Mapping[Key, Group], parameter: str, sampling: str) -> Sheet:
    """One parameter, dense (Table III) or sparse (Table IV)."""
    rows = []
    for scenario in (s for s in SCENARIOS if s.startswith(sampling)):
        for strategy in FIVE:
            for protocol in reversed(PROTOCOLS):
                g = found.get((scenario, strategy, protocol))
                if g is not None:
                    rows.append(_row(g, parameter, protocol == "paper"))
    headers = ("noise", "strategy", "protocol", "seeds", *NUMBERS, *LAST)
    return Sheet(headers, tuple(rows), headers[3:])


def _row(g: Group, parameter: str, paper: bool) -> tuple[str, ...]:
    cell, size = g.cells[parameter], abs(g.cells[parameter].true)
    noisy = bool(np.isfinite(cell.bound))
    places = 4 if parameter == "l_theta" else 3
    shown = published(g.scenario, g.strategy, parameter)
    return (
        g.label.split(", ")[1], g.strategy, g.protocol, str(g.seeds),
        f"{shown:.{places}f}" if paper else "", digits(float(cell.estimates[0]), 4),
        digits(cell.median, 4), digits(cell.spread, 2), with_interval(cell.bias, 100 / size),
        with_interval(cell.rmse, 100 / size), with_interval(cell.ratio) if noisy else "-",
        percent(cell.coverage) if noisy else "-", percent(g.breakdowns),
        f"{100 * g.misfits:.0f}" if np.isfinite(g.misfits) else "-", digits(1e3 * g.cpu),
        digits(1e3 * TIMES[g.scenario][g.strategy]) if paper else "")
