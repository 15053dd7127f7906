"""The simulation study: the paper's scenarios of the benchmark, one seed and repeated ones.

Table III of the paper uses all N = 501 samples, Table IV every tenth (N = 51); each without noise
and with σ = 0.1° and 1°.  One seed shows what a user would see; repeated seeds show what to expect,
as the root mean square error over the seeds in units of the Cramér-Rao bound.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import pi

import numpy as np

from pikanid import errors
from pikanid.estimate import Estimate
from pikanid.model import Model
from pikanid.recording import Recording
from pikanid.validation.benchmark import files, trial
from pikanid.validation.benchmark.scenario import Scenario
from pikanid.validation.benchmark.summary import Cell

PROTOCOL = "default"  # definition: of the study
SCENARIOS = tuple(files.chosen(["paper"]))  # definition: of the paper
TRUE = SCENARIOS[0].true  # definition: of the paper
START = {p: SCENARIOS[0].fitted.values[p] for p in TRUE}  # definition: of the paper


@dataclass(frozen=True, eq=False)
class Result:
    """One fit: the estimate, or the sentence that says why there is none."""

    scenario: Scenario
    strategy: str
    estimate: Estimate | None
    reason: str = ""

    def error(self, name: str) -> float:
        """Estimated minus true value."""
        return np.nan if self.estimate is None else self.estimate.value(name) - TRUE[name]


@dataclass(frozen=True)
class Spread:
    """Estimates over repeated seeds, by parameter."""

    scenario: Scenario
    strategy: str
    cells: Mapping[str, Cell]


def model() -> Model:
    """Eq. (6) at the true values of the study."""
    return SCENARIOS[0].truth


def sampling(scenario: Scenario) -> str:
    """"dense" (Table III) or "sparse" (Table IV)."""
    return "dense" if scenario.stride == 1 else "sparse"


def noise(scenario: Scenario) -> float:
    """Standard deviation [deg], 0 without noise.

    >>> [round(noise(s), 12) for s in SCENARIOS[:3]]
    [0.0, 0.1, 1.0]
    """
    return scenario.noise["theta"].sigma * 180 / pi


def recording(scenario: Scenario, seed: int) -> Recording:
    """Noisy samples of one scenario.

    >>> len(recording(SCENARIOS[4], seed=0)["theta"])
    51
    """
    return scenario.recording(seed)


def fit(scenario: Scenario, name: str, seed: int) -> Result:
    """One strategy, started at Table II's p0, on one noisy recording."""
    try:
        found = trial.fit(scenario, name, PROTOCOL, seed)
    except errors.PikanidError as problem:
        return Result(scenario, name, None, str(problem))
    return Result(scenario, name, found)


def repeated(scenario: Scenario, name: str, seeds: Sequence[int]) -> Spread:
    """The same fit over many noisy recordings."""
    outcomes = [trial.run(scenario, trial.Trial(scenario.name, name, PROTOCOL, seed))
                for seed in seeds]
    nothing, bound = (np.nan, np.nan), scenario.bound or {}
    cells = {}
    for p, true in scenario.true.items():
        pairs = np.array([o.values.get(p, nothing) for o in outcomes])
        cells[p] = Cell(pairs[:, 0], pairs[:, 1], true, bound.get(p, np.nan))
    return Spread(scenario, name, cells)
