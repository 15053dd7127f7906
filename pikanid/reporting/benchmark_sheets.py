"""The tables of a benchmark."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pikanid.pieces.sheet import Sheet
from pikanid.validation.benchmark.cells import Group
from pikanid.validation.benchmark.summary import Cell, Interval


def summary(groups: Sequence[Group], parameter: str) -> Sheet:
    """One parameter in all cells: what a strategy finds, how far off, and what it says of itself.
    """
    numbers = ("seeds", "median", "spread", "bias [%]", "RMSE [%]", "RMSE/CRB", "coverage [%]",
               "broke down [%]", "CPU [ms]")
    rows = []
    for g in groups:
        cell = g.cells.get(parameter)
        if cell is None:
            continue
        rows.append((g.label, g.strategy, g.protocol, str(g.seeds), *_figures(cell),
                     percent(g.breakdowns), digits(1e3 * g.cpu)))
    return Sheet(("scenario", "strategy", "protocol", *numbers), tuple(rows), numbers)


def _figures(cell: Cell) -> tuple[str, ...]:
    size = abs(cell.true) or 1.0
    noisy = bool(np.isfinite(cell.bound))
    return (digits(cell.median, 4), digits(cell.spread, 2), with_interval(cell.bias, 100 / size),
            with_interval(cell.rmse, 100 / size), with_interval(cell.ratio) if noisy else "-",
            percent(cell.coverage) if noisy else "-")


def with_interval(i: Interval, factor: float = 1.0) -> str:
    """A figure and its 95 % interval.

    >>> with_interval(Interval(1.234, 1.1, 1.4))
    '1.23 (1.1 to 1.4)'
    """
    if not np.isfinite(i.value):
        return "-"
    value, low, high = (digits(factor * v) for v in (i.value, i.low, i.high))
    return value if low == high else f"{value} ({low} to {high})"


def percent(i: Interval) -> str:
    """A share in per cent with its interval.

    >>> percent(Interval(0.95, 0.9, 0.98))
    '95 (90 to 98)'
    """
    if not np.isfinite(i.value):
        return "-"
    return f"{100 * i.value:.0f} ({100 * i.low:.0f} to {100 * i.high:.0f})"


def digits(value: float, count: int = 3) -> str:
    """So many significant digits, or all before the point; no exponent unless it is tiny.

    >>> digits(0.0450123, 4), digits(1234.5), digits(float("nan"))
    ('0.04501', '1234', '-')
    """
    if not np.isfinite(value):
        return "-"
    return f"{value:.0f}" if abs(value) >= 10.0**count else f"{value:.{count}g}"


def reasons(groups: Sequence[Group]) -> list[str]:
    """Why trials gave no estimate, each sentence once."""
    found = [f"{g.strategy}, {g.protocol}: {why}" for g in groups for why in g.reasons]
    return list(dict.fromkeys(found))
