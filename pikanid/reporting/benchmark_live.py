"""A benchmark while it runs: how far, how fast, and the errors so far."""

from __future__ import annotations

import sys
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from pikanid.pieces.sheet import sentence
from pikanid.reporting.console import console
from pikanid.validation.benchmark.trial import Outcome

if TYPE_CHECKING:
    from rich.progress import Progress
    from rich.table import Table

OFTEN = 4.0  # layout: redraws a second
SHOWN = 500  # limit: of the latest errors that a median is taken of


@dataclass
class Sofar:
    """Errors and failures of every strategy and protocol, in the order of their first trial.

    Args:
        true: Scenario -> true values.
    """

    true: Mapping[str, Mapping[str, float]]
    errors: dict[tuple[str, str], dict[str, list[float]]] = field(default_factory=dict)
    failed: dict[tuple[str, str], int] = field(default_factory=lambda: defaultdict(int))
    done: dict[tuple[str, str], int] = field(default_factory=lambda: defaultdict(int))

    def add(self, outcomes: Sequence[Outcome]) -> None:
        """Take outcomes in."""
        for o in outcomes:
            key = (o.trial.strategy, o.trial.protocol)
            self.done[key] += 1
            self.failed[key] += bool(o.reason)
            own = self.errors.setdefault(key, {})
            for p, (value, _) in o.values.items():
                true = self.true[o.trial.scenario][p]
                own.setdefault(p, []).append(abs(value - true) / (abs(true) or 1.0))
                del own[p][:-SHOWN]

    def table(self) -> Table:
        """Medians of relative errors."""
        from pikanid.reporting.tables import row, table

        names = list(dict.fromkeys(p for own in self.errors.values() for p in own))
        made = table("strategy", "protocol", "done", "failed", *(f"|error| {p} [%]" for p in names),
                     numbers=("done", "failed", *(f"|error| {p} [%]" for p in names)))
        for key, own in self.errors.items():
            cells = [f"{100 * np.median(own[p]):.3g}" if own.get(p) else "-" for p in names]
            row(made, *key, str(self.done[key]), str(self.failed[key]), *cells)
        return made


@contextmanager
def watching(sofar: Sofar, quiet: bool
             ) -> Iterator[tuple[Callable[[int, int], None], Callable[[Sequence[Outcome]], None]]]:
    """Functions that take how much is done of how much, and outcomes; drawn on a terminal only."""
    screen = console(sys.stderr)
    if quiet or not screen.is_terminal:
        yield lambda done, total: None, sofar.add
        return
    from rich.console import Group
    from rich.live import Live

    progress = _progress()
    task = progress.add_task("benchmark", total=None, where="")
    with Live(progress, console=screen, transient=True, refresh_per_second=OFTEN) as live:

        def begin(done: int, total: int) -> None:
            # What an earlier run did says nothing about the rate of this one.
            progress.reset(task, total=total - done, description=(
                f"benchmark ({done} trials kept)" if done else "benchmark"))

        def tell(outcomes: Sequence[Outcome]) -> None:
            sofar.add(outcomes)
            last = outcomes[-1].trial
            where = sentence(f"{last.scenario}, {last.strategy}, {last.protocol}")
            progress.update(task, advance=len(outcomes), where=where)
            live.update(Group(sofar.table(), progress))

        yield begin, tell


def _progress() -> Progress:
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        SpinnerColumn,
        Task,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )
    from rich.text import Text

    class Rate(TextColumn):
        def render(self, task: Task) -> Text:
            return Text(f"{task.speed:.3g}/s" if task.speed else "")

    return Progress(SpinnerColumn(), TextColumn("{task.description}"), BarColumn(),
                    MofNCompleteColumn(), Rate(""), TextColumn("left"), TimeRemainingColumn(),
                    TextColumn("gone"), TimeElapsedColumn(), TextColumn("{task.fields[where]}"))
