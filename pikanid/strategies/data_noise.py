"""How noisy the data rows of Eq. (2) are, and what that makes of the estimate's errors."""

from __future__ import annotations

import math

import numpy as np

from pikanid.approximators import Array
from pikanid.objective.functional import Functional
from pikanid.optimise.covariance import theta_covariance
from pikanid.optimise.gauss_newton import BandedSystem, Linearisation, Outcome
from pikanid.optimise.smoothing import Smoothed


def noise_level(functional: Functional, smoothed: Smoothed | None) -> float:
    """Standard deviation of the data rows, for the scale of λ; a floor serves clean data."""
    families = [sites for part in functional.parts for sites in part.data]
    if functional.weighted and all([sites.deviation is not None for sites in families]):
        return 1.0
    rows = [(sites.weight.T * sites.target)[0] for sites in families if sites.target is not None]
    spread = float(np.std(np.concatenate(rows))) or 1.0
    return max(0.1 * spread if smoothed is None else smoothed.sigma, 1e-5 * spread)


def row_noise(functional: Functional, at: Linearisation, effective: float) -> list[Array | float]:
    """Standard deviation of every data family's rows; of an output without σ, from its residual."""
    left = functional.n_data / max(1.0, functional.n_data - effective)
    families = [sites for part in functional.parts for sites in part.data]
    costs = dict.fromkeys([sites.output for sites in families], 0.0)
    counts = dict.fromkeys(costs, 0)
    flat = [cost for own in at.data_costs for cost in own]
    for sites, cost in zip(families, flat, strict=True):
        costs[sites.output] += cost
        counts[sites.output] += sites.t.size
    return [math.sqrt(left * costs[sites.output] / counts[sites.output])
            if sites.deviation is None else sites.deviation for sites in families]


def standard_errors(system: BandedSystem, outcome: Outcome) -> Array:
    """Standard errors of θ (b,), from the sandwich."""
    noise = row_noise(system.functional, outcome.at, outcome.at.point.theta.size)
    covariance, _ = theta_covariance(system, outcome.at, outcome.step, noise)
    return np.sqrt(covariance.diagonal())
