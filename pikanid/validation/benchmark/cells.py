"""The table of trials cut into cells."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from pikanid.validation.benchmark.summary import Cell, Interval, breakdowns

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, eq=False)
class Group:
    """All trials of a strategy in a protocol and a scenario.

    Attributes:
        cells: Parameter -> its estimates over the seeds.
        seeds: Trials made.
        failed: Those without an estimate, and the reasons in `reasons`.
        misfits: Share of estimates whose χ² says that they do not explain the recording.
        seconds, cpu: Median of a fit [s].
    """

    scenario: str
    label: str
    strategy: str
    protocol: str
    cells: dict[str, Cell]
    seeds: int
    failed: int
    reasons: tuple[str, ...]
    misfits: float
    seconds: float
    cpu: float

    @property
    def breakdowns(self) -> Interval:
        """Share of trials that broke down."""
        return breakdowns(list(self.cells.values()))


def groups(frame: pd.DataFrame) -> Iterator[Group]:
    """The groups of a table of trials (`export.table`), in its order."""
    known = frame[frame.parameter != ""].groupby(["scenario", "parameter"], sort=False)
    true = {key: (float(own.true.iloc[0]), float(own.bound.iloc[0])) for key, own in known}
    for key, own in frame.groupby(["scenario", "strategy", "protocol"], sort=False):
        trials = own.drop_duplicates("seed").sort_values("seed")
        seeds = trials.seed.to_numpy()
        cells: dict[str, Cell] = {}
        for (scenario, parameter), (value, bound) in true.items():
            if scenario != key[0]:
                continue
            rows = own[own.parameter == parameter].set_index("seed").reindex(seeds)
            cells[str(parameter)] = Cell(rows.estimate.to_numpy(float), rows["std"].to_numpy(float),
                                    value, bound)
        fitted = trials[trials.reason == ""]
        misfits = float(np.mean(fitted.verdict == "misfit")) if len(fitted) else np.nan
        yield Group(
            str(key[0]), str(trials.label.iloc[0]), str(key[1]), str(key[2]), cells, len(trials),
            len(trials) - len(fitted), tuple(dict.fromkeys(trials.reason[trials.reason != ""])),
            misfits, float(trials.seconds.median()), float(trials.cpu.median()))
