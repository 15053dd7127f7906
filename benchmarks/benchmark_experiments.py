"""Experiments besides the study's own cells: basins, λ, grids, samples and noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import pi
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pikanid import errors
from pikanid.strategies import IPDA, NLS
from pikanid.uncertainty import cramer_rao
from pikanid.validation.benchmark import files
from pikanid.validation.benchmark.noise import Noise
from pikanid.validation.benchmark.scenario import Scenario
from pikanid.validation.benchmark.trial import fit

Array = NDArray[np.float64]
LENGTHS = np.geomspace(0.012, 0.25, 23)  # starts l0 [m] of the basin map
DAMPINGS = np.geomspace(0.01, 3.0, 13)  # starts d0 [N s/m]
NEAR = 6.0  # Cramér-Rao standard deviations within which a fit has found the truth
STRIDES, SIGMAS = (20, 10, 5, 2, 1), (0.01, 0.1, 0.3, 1.0, 3.0)  # [-], [deg]
LAMBDAS = 10.0 ** np.arange(-6.0, 5.0)
INTERVALS = (25, 50, 100, 200)
STARTS_AUTO = 4  # every so manieth start is tried with multi-start, too


@dataclass(frozen=True, eq=False)
class Basin:
    """Where NLS from one start ends, start by start (d0, l0)."""

    scenario: str
    length: Array
    damping: Array
    right: NDArray[np.bool_]
    misfit: NDArray[np.bool_]
    auto_right: NDArray[np.bool_]  # of every STARTS_AUTO-th start, with NLS's own multi-start
    auto_misfit: NDArray[np.bool_]

    @property
    def unseen(self) -> int:
        """Wrong ends that χ² takes for explanations."""
        return int((~self.right & ~self.misfit).sum())


def basin(name: str) -> Basin:
    """The map for seed 0 of a scenario."""
    scenario = files.chosen([name])[0]
    recording, bound, true = scenario.recording(0), scenario.bound, scenario.true
    assert bound is not None

    def end(l0: float, d0: float, strategy: NLS) -> tuple[float, float, bool, bool]:
        try:
            e = strategy.fit(scenario.fitted.with_values(l_theta=l0, d_theta=d0), recording)
        except errors.PikanidError:
            return np.nan, np.nan, False, True
        right = all(abs(e.value(p) - true[p]) <= NEAR * bound[p] for p in true)
        return e.value("l_theta"), e.value("d_theta"), right, e.adequacy.verdict == "misfit"

    single = np.array([[end(a, b, NLS(starts=1)) for a in LENGTHS] for b in DAMPINGS])
    auto = np.array([end(a, b, NLS()) for k, (b, a) in enumerate(
        (b, a) for b in DAMPINGS for a in LENGTHS) if k % STARTS_AUTO == 0])
    return Basin(name, single[..., 0], single[..., 1], single[..., 2] == 1, single[..., 3] == 1,
                 auto[:, 2] == 1, auto[:, 3] == 1)


def sampled(stride: int, sigma: float) -> Scenario:
    """The profile of Table II with other sampling and noise [deg]."""
    usual = files.chosen(["dense_low"])[0]
    return replace(usual, name=f"s{stride}_{sigma:g}", stride=stride,
                   noise={"theta": Noise(sigma * pi / 180)})


def against_sampling(strategies: Sequence[tuple[str, str]], seeds: int
                     ) -> dict[tuple[str, str], dict[str, Array]]:
    """RMSE over the true value (stride, σ) by (strategy, protocol) and parameter."""
    found: dict[tuple[str, str], dict[str, Array]] = {}
    for name, protocol in strategies:
        shape = (len(STRIDES), len(SIGMAS))
        found[name, protocol] = {p: np.full(shape, np.nan) for p in ("l_theta", "d_theta")}
        for i, stride in enumerate(STRIDES):
            for j, sigma in enumerate(SIGMAS):
                scenario = sampled(stride, sigma)
                for p, rms in errors_of(scenario, name, protocol, seeds).items():
                    found[name, protocol][p][i, j] = rms
    return found


def bounds() -> dict[str, Array]:
    """The Cramér-Rao standard deviation over the true value (stride, σ) by parameter."""
    every = [[sampled(stride, sigma) for sigma in SIGMAS] for stride in STRIDES]
    return {p: np.array([[(s.bound or {})[p] / s.true[p] for s in row] for row in every])
            for p in ("l_theta", "d_theta")}


def errors_of(scenario: Scenario, name: str, protocol: str, seeds: int) -> dict[str, float]:
    """RMSE over the true value by parameter; a fit that failed is left out."""
    misses = []
    for seed in range(seeds):
        try:
            e = fit(scenario, name, protocol, seed)
        except errors.PikanidError:
            continue
        misses.append([e.value(p) / v - 1.0 for p, v in scenario.true.items()])
    rms = np.sqrt(np.mean(np.square(misses), axis=0)) if misses else [np.nan] * len(scenario.true)
    return dict(zip(scenario.true, map(float, rms), strict=True))


@dataclass(frozen=True, eq=False)
class Sweep:
    """Relative errors (λ, seed, parameter) of iPDA at fixed λ, and (seed, parameter) of NLS."""

    scenario: str
    relaxed: Array
    hard: Array

    def rmse(self, parameter: int) -> tuple[Array, float]:
        """Root mean square error over the seeds at every λ, and of NLS."""
        return (np.sqrt(np.nanmean(self.relaxed[..., parameter] ** 2, axis=1)),
                float(np.sqrt(np.nanmean(self.hard[:, parameter] ** 2))))


def sweep(name: str, seeds: int) -> Sweep:
    """iPDA at every λ of LAMBDAS against NLS (one start) on the same recordings."""
    scenario = files.chosen([name])[0]
    true = np.array(list(scenario.true.values()))

    def error(strategy: Any, seed: int) -> Array:
        try:
            e = strategy.fit(scenario.fitted, scenario.recording(seed))
        except errors.PikanidError:
            return np.full(true.size, np.nan)
        return np.array([e.value(p) for p in scenario.true]) / true - 1.0

    relaxed = np.array([[error(IPDA(lam=float(lam)), k) for k in range(seeds)] for lam in LAMBDAS])
    return Sweep(name, relaxed, np.array([error(NLS(starts=1), k) for k in range(seeds)]))


@dataclass(frozen=True)
class Share:
    """How many unknowns a fit has beside the parameters, and what that does to them.

    `stated` and `rmse` are of d, over the Cramér-Rao standard deviation of d alone.
    """

    intervals: int
    lam: float
    auxiliary: int
    effective: float
    stated: float
    rmse: float


def partitioning(seeds: int) -> list[Share]:
    """iPDA on grids of more and more coefficients, at weak, middle and strong physics."""
    scenario = files.chosen(["dense_low"])[0]
    assert scenario.bound is not None
    bound, true = scenario.bound["d_theta"], scenario.true["d_theta"]
    found = []
    for intervals in INTERVALS:
        for lam in (1e-2, 1.0, 1e2, 1e4):
            strategy = IPDA(lam=lam, intervals=intervals)
            fits = [strategy.fit(scenario.fitted, scenario.recording(k)) for k in range(seeds)]
            off = np.array([e.value("d_theta") for e in fits]) - true
            used = dict(fits[0].settings)
            found.append(Share(
                int(used["intervals"]), lam,
                sum(np.size(c) for own in fits[0].approximator.coefficients for c in own),
                float(used["effective_parameters"]),
                float(np.median([e.std("d_theta") for e in fits])) / bound,
                float(np.sqrt(np.mean(off**2))) / bound))
    return found


def identifiability() -> dict[str, float]:
    """Of Eq. (1) at the truth, σ = 0.1°: condition of the Fisher information of relative changes,
    correlation, and relative standard deviations.
    """
    scenario = files.chosen(["dense_low"])[0]
    bound = cramer_rao(scenario.truth, scenario.recording(0))
    size = np.array([scenario.true[p] for p in bound.names])
    scaled = bound.fisher * np.outer(size, size)
    return {"condition": float(np.linalg.cond(scaled)), "correlation": float(
        bound.correlation[0, 1]), **{p: bound.std(p) / scenario.true[p] for p in bound.names}}
