"""One trial: one strategy on one noisy recording."""

from __future__ import annotations

import pickle
import time
from collections.abc import Iterator
from dataclasses import dataclass, fields
from functools import lru_cache
from typing import Any

from pikanid import errors
from pikanid.estimate import Estimate
from pikanid.strategies import STRATEGIES, strategy_class
from pikanid.validation.benchmark.scenario import Scenario

PROTOCOLS = ("default", "paper")
# Beside the strategies by their names: the same with other options, in the default protocol only.
VARIANTS: dict[str, tuple[str, dict[str, Any]]] = {
    "pikan-deep": ("pikan", {"width": (1, 5, 1)}),
    "nls-single": ("nls", {"starts": 1})}  # definition: of the benchmark


@dataclass(frozen=True, order=True)
class Trial:
    """Which fit."""

    scenario: str
    strategy: str
    protocol: str
    seed: int


@dataclass(frozen=True)
class Outcome:
    """What came of a trial.

    Attributes:
        trial: Which.
        values: Parameter -> estimate and standard error (NaN where it is not known); empty where
            the strategy refused or failed.
        reason: Why there is no estimate; empty where there is one.
        verdict: Of χ²: whether the model, simulated at the estimates, explains the recording.
        converged: Whether the optimiser says so.
        warnings: How many the estimate carries.
        seconds, cpu: Of the fit, by the clock and of the processor [s].
    """

    trial: Trial
    values: dict[str, tuple[float, float]]
    reason: str = ""
    verdict: str = ""
    converged: bool = False
    warnings: int = 0
    seconds: float = 0.0
    cpu: float = 0.0


def protocols_of(strategy: str) -> tuple[str, ...]:
    """The protocols that a strategy has.

    >>> protocols_of("nls"), protocols_of("pikan-deep")
    (('default', 'paper'), ('default',))
    """
    if strategy in VARIANTS:
        return PROTOCOLS[:1]
    known = {f.name for f in fields(strategy_class(strategy))}
    return PROTOCOLS if "protocol" in known else PROTOCOLS[:1]


def slow(strategy: str) -> bool:
    """Whether a fit takes more than some seconds."""
    return strategy_class(VARIANTS.get(strategy, (strategy,))[0]).slow


def strategies(variants: bool = True) -> tuple[str, ...]:
    """Names that a benchmark knows."""
    return (*STRATEGIES, *(VARIANTS if variants else ()))


def fit(scenario: Scenario, strategy: str, protocol: str, seed: int) -> Estimate:
    """The fit of a trial: noise and, if the strategy draws anything, the strategy of this seed.

    Raises:
        PikanidError: The strategy refuses.
    """
    name, options = VARIANTS.get(strategy, (strategy, {}))
    kind = strategy_class(name)
    known = {f.name for f in fields(kind)}
    own = {"protocol": protocol, "seed": seed}
    made = kind(**options, **{k: v for k, v in own.items() if k in known})
    return made.fit(scenario.fitted, scenario.recording(seed))


def run(scenario: Scenario, trial: Trial) -> Outcome:
    """A trial; whatever goes wrong in the fit becomes its reason."""
    begun, cpu = time.perf_counter(), time.process_time()
    try:
        found = fit(scenario, trial.strategy, trial.protocol, trial.seed)
    except errors.PikanidError as problem:
        return _failed(trial, str(problem), begun, cpu)
    except Exception as failure:  # a defect of one fit must not end a study of thousands
        return _failed(trial, f"{type(failure).__name__}: {failure}", begun, cpu)
    values = {p: (found.value(p), found.std(p)) for p in scenario.true}
    return Outcome(trial, values, "", found.adequacy.verdict, bool(found.converged),
                   len(found.warnings), time.perf_counter() - begun, time.process_time() - cpu)


def run_packed(packed: bytes, trials: tuple[Trial, ...]) -> tuple[Outcome, ...]:
    """Trials of one scenario that was packed with `pack`, as another process gets them."""
    scenario = _unpacked(packed)
    with _one_thread():
        return tuple(run(scenario, trial) for trial in trials)


def pack(scenario: Scenario) -> bytes:
    """A scenario to be sent to another process of ours."""
    return pickle.dumps(scenario)


@lru_cache(maxsize=64)
def _unpacked(packed: bytes) -> Scenario:
    # What the trials of a scenario share stays with the process that works on them.
    found: Scenario = pickle.loads(packed)
    return found


@lru_cache(maxsize=1)
def _controller() -> Any:
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()


def _one_thread() -> Any:
    """BLAS on one thread: workers side by side would fight for the cores."""
    return _controller().limit(limits=1)


def _failed(trial: Trial, reason: str, begun: float, cpu: float) -> Outcome:
    return Outcome(trial, {}, reason, seconds=time.perf_counter() - begun,
                   cpu=time.process_time() - cpu)


def plan(scenarios: list[str], names: list[str], protocols: tuple[str, ...], seeds: int
         ) -> Iterator[Trial]:
    """All trials, quick strategies first; seed after seed, so that an early end leaves all cells.
    """
    cells = [(name, protocol) for name in names for protocol in protocols_of(name)
             if protocol in protocols]
    for late in (False, True):
        for seed in range(seeds):
            for scenario in scenarios:
                yield from (Trial(scenario, name, protocol, seed) for name, protocol in cells
                            if slow(name) is late)
