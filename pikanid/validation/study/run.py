"""The whole study, step by step."""

from __future__ import annotations

import multiprocessing
import os
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import product
from multiprocessing.pool import AsyncResult

from pikanid import errors
from pikanid.mismatch.report.diagnosis import Diagnosis
from pikanid.storage.workers import begin
from pikanid.strategies import STRATEGIES, strategy_class
from pikanid.validation.benchmark.scenario import Scenario
from pikanid.validation.study import clip, pendulum, slosh

SEED = 0  # definition: of the study's first recordings
# Only what is quick is repeated: the study is to stay a matter of minutes.
REPEATABLE = 1.0  # limit: seconds of a fit


@dataclass(frozen=True, eq=False)
class Study:
    """What was found."""

    slosh_fits: tuple[slosh.Result, ...]
    spreads: tuple[slosh.Spread, ...]
    pendulum_fits: tuple[pendulum.Result, ...]
    swing: pendulum.Swing
    diagnosis: Diagnosis
    filmed: clip.Filmed | None
    seeds: int
    seconds: float


def count_steps(strategies: Sequence[str] = tuple(STRATEGIES)) -> int:
    """How many steps `run` announces at most."""
    noisy = sum(1 for s in slosh.SCENARIOS if not s.clean)
    return 3 + len(strategies) * (len(slosh.SCENARIOS) + noisy + 1)


def run(seeds: int = 20, strategies: Sequence[str] = tuple(STRATEGIES),
        step: Callable[[str], None] = lambda text: None,
        swing: pendulum.Swing | None = None) -> Study:
    """Fit everything.

    Args:
        seeds: Noisy recordings in each repetition, 0, 1, ..., seeds - 1; 0 leaves it out.
        strategies: Short names.
        step: Called with the name of every step before it is done.
        swing: The real recording; the excerpt of the package unless given.
    """
    begun = time.perf_counter()
    step("compiling the model")
    # Timed fits are warm; without noise NLS tries starts that are stiff, which is code of its own.
    for scenario in (slosh.SCENARIOS[1], slosh.SCENARIOS[3]):
        slosh.fit(scenario, "nls", SEED)
    # A slow fit takes half a minute, and on the long real recording many: only Table III has them.
    quick, slow = ([n for n in strategies if strategy_class(n).slow is late]
                   for late in (False, True))
    with _meanwhile([(scenario, name) for name in slow for scenario in slosh.SCENARIOS
                     if scenario.stride == 1]) as pending:
        singles = []
        for scenario, name in product(slosh.SCENARIOS, quick):
            step(f"slosh, {scenario.label}, {name}")
            singles.append(slosh.fit(scenario, name, SEED))
        spreads = []
        for result in singles:
            if result.scenario.clean or seeds < 1:
                continue
            step(f"slosh, {result.scenario.label}, {result.strategy}, {seeds} seeds")
            if result.estimate is not None and result.estimate.seconds < REPEATABLE:
                spreads.append(slosh.repeated(result.scenario, result.strategy, range(seeds)))
        real, swing = [], pendulum.load() if swing is None else swing
        pendulum.warm_up(swing)
        for name in strategies:
            step(f"real pendulum, {name}")
            real.append(pendulum.Result(name, None, errors.left_out_as_slow())
                        if name in slow else pendulum.fit(swing, name))
        for scenario, name in product(slosh.SCENARIOS, slow):
            step(f"slosh, {scenario.label}, {name}")
            task = pending.get((scenario, name))
            singles.append(slosh.Result(scenario, name, None, errors.left_out_as_slow())
                           if task is None else task.get())
    step("a rendered video, tracked and identified")
    try:
        filmed = clip.film(SEED)
    except errors.BadSetting:  # without the extra `video`
        filmed = None
    # Last, when nothing is timed any more: a diagnosis takes what cores there are.
    step("real pendulum, missing physics")
    diagnosis = pendulum.missing_physics(swing)
    return Study(_in_order(singles, strategies), tuple(spreads), tuple(real), swing, diagnosis,
                 filmed, seeds, time.perf_counter() - begun)


def _in_order(results: Sequence[slosh.Result], strategies: Sequence[str]
              ) -> tuple[slosh.Result, ...]:
    """By scenario, then by strategy; another process has made copies of the scenarios."""
    order = {(s.name, n): k for k, (s, n) in enumerate(product(slosh.SCENARIOS, strategies))}
    return tuple(sorted(results, key=lambda r: order[r.scenario.name, r.strategy]))


@contextmanager
def _meanwhile(jobs: Sequence[tuple[Scenario, str]]
               ) -> Iterator[dict[tuple[Scenario, str], AsyncResult[slosh.Result]]]:
    """Fits that one other process makes in the meantime; an interruption ends it."""
    if not jobs:
        yield {}
        return
    # More threads of its BLAS, which reads that on import, would slow down the fits timed here.
    with multiprocessing.get_context("spawn").Pool(
            1, begin, (os.getpid(), {"OMP_NUM_THREADS": "1"})) as pool:
        yield {job: pool.apply_async(slosh.fit, (*job, SEED)) for job in jobs}
