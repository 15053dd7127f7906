"""What is known about the edges: their bands and the tests of whether they are there at all.

Bands are Bayesian: the posterior covariance (A + Λ)⁻¹ of coefficients and parameters together,
whose pointwise intervals cover as often as they say when coverage is averaged along the curve
(Wahba, J. R. Stat. Soc. B 45, 1983, p. 133; Nychka, J. Am. Stat. Assoc. 83, 1988, p. 1134).  The
smoothness ρ is uncertain itself, most of all where an edge is faint: mean and covariance are taken
over all plausible ρ, weighed by their evidence.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve, eigh
from scipy.stats import chi2

from pikanid.discrepancy.fit import PenalisedFit
from pikanid.discrepancy.gauge import Gauge
from pikanid.discrepancy.settings import USUAL


@dataclass(frozen=True, eq=False)
class Posterior:
    """Mean (n,) and covariance (n, n) of θ; effective degrees of freedom of its entries (n,)."""

    mean: np.ndarray
    covariance: np.ndarray
    freedom: np.ndarray


def posterior(fit: PenalisedFit) -> Posterior:
    """The posterior of the linear problem at the fit; NaN variance for parameters at a bound."""
    A, inside, smooth = fit.information, fit.inside, fit.smoothness
    keep = np.ix_(inside, inside)
    gain = (fit.gain - A @ np.where(inside, 0.0, fit.theta))[inside]
    mean, second, freedom = np.zeros(len(gain)), np.zeros((len(gain),) * 2), np.zeros(len(A))
    for rho, weight in smooth.plausible(A, fit.gain, fit.rho):
        V = cho_solve(cho_factor((A + smooth.precision(rho))[keep]), np.eye(len(gain)))
        theta = V @ gain
        # around the fit itself, so that squares of large numbers do not cancel
        off = theta - fit.theta[inside]
        mean += weight * off
        second += weight * (V + np.outer(off, off))
        freedom[inside] += weight * np.diag(V @ A[keep])
    whole, full = np.array(fit.theta), np.full(A.shape, np.nan)
    whole[inside] += mean
    full[keep] = second - np.outer(mean, mean)
    return Posterior(whole, full, freedom)


def likelihood(fit: PenalisedFit, k: int) -> tuple[np.ndarray, np.ndarray]:
    """What the data alone say of edge k: S (K, K) and g (K,) in cᵀSc - 2gᵀc + const = χ²(c).

    Parameters and offset are at their best for every c, without a prior; the other edges keep their
    smoothness.  Gauge directions, which parameters follow, have no information in S.
    """
    at = fit.smoothness.priors[k].at
    inside = np.array(fit.inside)
    inside[at] = False
    others = np.flatnonzero(inside)
    H = fit.information + fit.smoothness.precision(fit.rho) - np.diag(fit.smoothness.weak)
    gain = fit.gain - fit.information @ np.where(fit.inside, 0.0, fit.theta)
    cross = fit.information[np.ix_(others, at)]
    right = np.column_stack([cross, gain[others]])
    solved = np.linalg.lstsq(H[np.ix_(others, others)], right, rcond=1e-13)[0]
    S = fit.information[np.ix_(at, at)] - cross.T @ solved[:, :-1]
    return 0.5 * (S + S.T), gain[at] - cross.T @ solved[:, -1]


def wald(fit: PenalisedFit, edges: Sequence[int], gauges: Sequence[Gauge],
         freedom: Sequence[float]) -> tuple[float, int]:
    """p-value and degrees of freedom of the Wald test that some edges are zero, gauge-fixed.

    Tested are the coordinates along the smoothest gauge-fixed functions (and the step) of each, as
    many as the fit used up (`freedom`), without a penalty on them; what the gauge takes out of them
    is free, other edges keep their smoothness.  Under the null the statistic is χ², or less.
    """
    precision = fit.smoothness.precision(fit.rho)
    tested: list[np.ndarray] = []
    removed: list[np.ndarray] = []
    taken = []
    for k in edges:
        prior, gauge = fit.smoothness.priors[k], gauges[k]
        at = np.ix_(prior.at, prior.at)
        precision[at] = np.eye(len(prior.at)) / (len(prior.at) * (prior.largest * prior.size) ** 2)
        count = int(np.clip(round(freedom[k]), *fit.smoothness.settings.freedom))
        for kept, functions in ((tested, _smoothest(gauge, count)), (removed, gauge.removed)):
            full = np.zeros((len(fit.theta), functions.shape[1]))
            full[prior.at] = functions
            kept.append(full)
        taken.append(prior.at)
    others = np.setdiff1d(np.flatnonzero(fit.inside), np.concatenate(taken))
    columns = np.hstack([*tested, *removed, np.eye(len(fit.theta))[:, others]])
    first = sum(t.shape[1] for t in tested)
    V = np.linalg.inv(columns.T @ (fit.information + precision) @ columns)
    held = np.where(fit.inside, 0.0, fit.theta)
    estimate = V @ (columns.T @ (fit.gain - fit.information @ held))
    statistic = float(estimate[:first] @ np.linalg.solve(V[:first, :first], estimate[:first]))
    return float(chi2.sf(statistic, first)), first


def _smoothest(gauge: Gauge, count: int) -> np.ndarray:
    """Coefficients (K, count) of the smoothest gauge-fixed functions of unit size over the data."""
    values = np.sqrt(gauge.weights)[:, None] * gauge.plan.basis(gauge.a)
    moments = values.T @ values
    bends = gauge.plan.bends()
    roughness = bends.T @ bends + 1e-9 * np.eye(gauge.plan.size)
    if gauge.plan.step:
        roughness[-1, -1] = 1e-9
    # directions that the data never visit, or that the gauge takes out, have no size
    u = np.linalg.svd(gauge.projection)[0]
    basis = u[:, : gauge.plan.size - gauge.removed.shape[1]]
    inner = basis.T @ moments @ basis + 1e-10 * np.trace(moments) * np.eye(basis.shape[1])
    _, vectors = eigh(basis.T @ roughness @ basis, inner, subset_by_index=[0, count - 1])
    return np.asarray(basis @ vectors)


def simultaneous_factor(curves: np.ndarray, covariance: np.ndarray, level: float = 0.95,
                        draws: int = USUAL.draws) -> float:
    """How many standard deviations hold the whole curve with probability `level`.

    `curves` (M, K) takes coefficients to values; the largest deviation over the M points is drawn
    from the posterior (Ruppert, Wand & Carroll, Semiparametric Regression, 2003, sec. 6.5).
    """
    values, vectors = np.linalg.eigh(0.5 * (covariance + covariance.T))
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    spread = curves @ root
    std = np.linalg.norm(spread, axis=1)
    drawn = np.random.default_rng(0).normal(size=(spread.shape[1], draws))
    seen = std > 1e-9 * std.max()
    worst = np.abs(spread[seen] @ drawn / std[seen, None]).max(axis=0)
    return float(np.quantile(worst, level))


def holm(p: Sequence[float], alpha: float) -> list[bool]:
    """Which of several tests are significant at α together (Holm, Scand. J. Stat. 6, 1979, p. 65).

    >>> holm([0.004, 0.5, 0.02], 0.05)
    [True, False, True]
    """
    order = np.argsort(p)
    found = [False] * len(p)
    for rank, k in enumerate(order):
        if p[k] > alpha / (len(p) - rank):
            break
        found[int(k)] = True
    return found
