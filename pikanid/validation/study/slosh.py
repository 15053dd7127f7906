"""The simulation study: the slosh pendulum under Table II's two pulses, dense and sparse.

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
from pikanid.model import Model, systems
from pikanid.recording import Recording, excitation
from pikanid.simulation import simulate
from pikanid.strategies import strategy_class
from pikanid.uncertainty import cramer_rao

TRUE = {"l_theta": 0.045, "d_theta": 0.15}  # definition: of the paper
START = {"l_theta": 0.06, "d_theta": 0.05}  # definition: of the paper
SPARSE = 10  # definition: every so manieth sample


@dataclass(frozen=True)
class Scenario:
    """Sampling (every `stride`-th sample) and noise [deg] of one column of Tables III and IV."""

    sampling: str
    stride: int
    noise: float

    @property
    def sigma(self) -> float:
        """Standard deviation of the noise [rad]."""
        return self.noise * pi / 180

    @property
    def label(self) -> str:
        """Such as "sparse, 1°"."""
        return f"{self.sampling}, {f'{self.noise:g}°' if self.noise else 'clean'}"


SCENARIOS = tuple(
    Scenario(sampling, stride, noise)
    for sampling, stride in (("dense", 1), ("sparse", SPARSE))
    for noise in (0.0, 0.1, 1.0))  # definition: of the paper


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
    """Errors over repeated seeds, by parameter; `bound` is the Cramér-Rao standard deviation."""

    scenario: Scenario
    strategy: str
    seeds: int
    rmse: Mapping[str, float]
    bias: Mapping[str, float]
    bound: Mapping[str, float]


def model() -> Model:
    """Eq. (6) at the true values of the study."""
    return systems.sloshing().with_values(TRUE)


def recording(scenario: Scenario, seed: int) -> Recording:
    """Noisy samples of one scenario.

    >>> len(recording(SCENARIOS[4], seed=0)["theta"])
    51
    """
    full = simulate(model(), excitation.two_pulse(), sigma=scenario.sigma, seed=seed)
    return full.decimate(scenario.stride, channels=["theta"])


def fit(scenario: Scenario, name: str, seed: int) -> Result:
    """One strategy, started at Table II's p0, on one noisy recording."""
    try:
        found = strategy_class(name)().fit(model().with_values(START), recording(scenario, seed))
    except errors.PikanidError as problem:
        return Result(scenario, name, None, str(problem))
    return Result(scenario, name, found)


def repeated(scenario: Scenario, name: str, seeds: Sequence[int]) -> Spread:
    """The same fit over many noisy recordings."""
    results = [fit(scenario, name, seed) for seed in seeds]
    errors_of = {p: np.array([r.error(p) for r in results]) for p in TRUE}
    bound = cramer_rao(model(), recording(scenario, seeds[0]))
    return Spread(
        scenario, name, len(results),
        {p: float(np.sqrt(np.mean(e**2))) for p, e in errors_of.items()},
        {p: float(np.mean(e)) for p, e in errors_of.items()},
        {p: bound.std(p) for p in TRUE})
