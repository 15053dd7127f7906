"""How noisy the data rows of Eq. (2) are, and what that makes of the estimate's errors."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pikanid.approximators import Array
from pikanid.functional import Functional, Sites
from pikanid.optimise.covariance import theta_covariance
from pikanid.optimise.gauss_newton import BandedSystem, Linearisation, Outcome
from pikanid.optimise.smoothing import Smoothed


def noise_level(functional: Functional, smoothed: Smoothed | None) -> float:
    """Standard deviation of the data rows, for the scale of λ; a floor serves clean data."""
    pairs = list(_families(functional))
    if functional.weighted and all(sigma is not None for _, sigma in pairs):
        return 1.0
    rows = [(sites.weight * sites.target).ravel() for sites, _ in pairs if sites.target is not None]
    spread = float(np.std(np.concatenate(rows))) or 1.0
    return max(0.1 * spread if smoothed is None else smoothed.sigma, 1e-5 * spread)


def row_noise(functional: Functional, at: Linearisation, effective: float) -> list[Array | float]:
    """Standard deviation of every data family's rows; of an output without σ, from its residual."""
    left = functional.n_data / max(1.0, functional.n_data - effective)
    costs: dict[int, float] = {}
    counts: dict[int, int] = {}
    flat = [cost for costs_of in at.data_costs for cost in costs_of]
    families = list(_families(functional))
    for (sites, _), cost in zip(families, flat, strict=True):
        costs[sites.output] = costs.get(sites.output, 0.0) + cost
        counts[sites.output] = counts.get(sites.output, 0) + sites.t.size
    return [
        float(np.sqrt(left * costs[sites.output] / counts[sites.output])) if sigma is None
        else sites.weight[:, 0] * sigma
        for sites, sigma in families]


def _families(functional: Functional) -> Iterator[tuple[Sites, Array | None]]:
    for experiment, part in zip(functional.problem.experiments, functional.parts, strict=True):
        for samples, sites in zip(experiment.samples, part.data, strict=True):
            yield sites, samples.sigma


def standard_errors(system: BandedSystem, outcome: Outcome) -> Array:
    """Standard errors of θ (b,), from the sandwich."""
    noise = row_noise(system.functional, outcome.at, outcome.at.point.theta.size)
    covariance, _ = theta_covariance(system, outcome.at, outcome.step, noise)
    return np.sqrt(np.diag(covariance))
