"""The study: what is to be done, less what is done, spread, and kept as it comes."""

from __future__ import annotations

import platform
import time
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from pikanid.validation.benchmark import spread
from pikanid.validation.benchmark.scenario import Scenario
from pikanid.validation.benchmark.store import Store
from pikanid.validation.benchmark.trial import Outcome, Trial, pack, plan, slow

# What decides the last digits of an estimate.
LIBRARIES = ("pikanid", "numpy", "scipy", "numba", "torch", "pykan")
TOGETHER = 10  # limit: quick trials of one scenario that make a task
Tell = Callable[[Sequence[Outcome]], None]


@dataclass(frozen=True)
class Order:
    """What a run is asked for.

    Attributes:
        scenarios: Of the study.
        strategies, protocols: By name; a strategy without a protocol is left out of it.
        seeds: 0, 1, ..., seeds - 1.
        workers: Processes on this machine.
        scheduler: Address of a Dask scheduler to use instead; empty for none.
    """

    scenarios: tuple[Scenario, ...]
    strategies: tuple[str, ...]
    protocols: tuple[str, ...]
    seeds: int
    workers: int = 1
    scheduler: str = ""

    @property
    def trials(self) -> list[Trial]:
        """All of them in their order."""
        return list(plan([s.name for s in self.scenarios], list(self.strategies), self.protocols,
                         self.seeds))


def versions() -> dict[str, str]:
    """Of Python and the libraries that compute."""
    found = {"python": platform.python_version()}
    for name in LIBRARIES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "none"
    return found


def run(order: Order, folder: Path, resume: bool = False,
        begin: Callable[[int, int], None] = lambda done, total: None,
        tell: Tell = lambda outcomes: None) -> None:
    """Run what is missing in the store of a folder.

    Args:
        order: What is wanted.
        folder: Of the store.
        resume: Whether a store that is there is continued.
        begin: Called with the trials that are there already and all that are wanted.
        tell: Called with outcomes when they are in the store.

    Raises:
        BadSetting: See `Store` and `spread`.
        BadRecording: The store cannot be written to.
    """
    with Store(folder, resume, versions()) as store:
        for s in order.scenarios:
            store.declare(s.name, s.digest, s.content(), s.true, s.bound)
        wanted = order.trials
        done = store.done()
        missing = [t for t in wanted if t not in done]
        store.ran({"begun": time.strftime("%Y-%m-%dT%H:%M:%S%z"), "seeds": order.seeds,
                   "scenarios": [s.name for s in order.scenarios],
                   "strategies": list(order.strategies), "protocols": list(order.protocols),
                   "workers": order.workers, "scheduler": bool(order.scheduler),
                   "machine": platform.machine()})
        begin(len(wanted) - len(missing), len(wanted))
        if not missing:
            return
        tasks = _tasks(missing, order.scenarios)
        # Work that is under way ends with the generator, also when an interrupt leaves this loop.
        with closing(spread.on_cluster(tasks, order.scheduler) if order.scheduler
                     else spread.here(tasks, order.workers)) as coming:
            for outcomes in coming:
                store.add(outcomes)
                tell(outcomes)


def _tasks(missing: Sequence[Trial], scenarios: Sequence[Scenario]) -> list[spread.Task]:
    """Quick trials of one cell some together, so that sending them costs little; slow ones alone.
    """
    packed = {s.name: pack(s) for s in scenarios}
    tasks: list[tuple[str, list[Trial]]] = []
    last: dict[tuple[str, str, str], list[Trial]] = {}
    for trial in missing:
        cell = (trial.scenario, trial.strategy, trial.protocol)
        most = 1 if slow(trial.strategy) else TOGETHER
        if len(last.get(cell, ())) in (0, most):
            last[cell] = []
            tasks.append((trial.scenario, last[cell]))
        last[cell].append(trial)
    return [(packed[name], tuple(trials)) for name, trials in tasks]
