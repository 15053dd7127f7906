"""Is anything left in a residual?  Tests with a known rate of false alarms.

The whitened residual of a right model, freed of what its estimated parameters can take up, is white
Gaussian noise projected.  Against that stand the signs of the catalogue (largest one counts), the
power in bands of frequency, and the correlation with the input at small lags.  All of them are
functions of a few hundred linear projections of the residual, so that their joint distribution is
drawn exactly from a Gaussian of that size; the noise level's own error is drawn with it.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

DRAWS = 4000
SHARES = (0.6, 0.2, 0.2)  # of α for catalogue, bands and inputs


@dataclass(frozen=True)
class Detection:
    """p-values: of everything, of each kind of test; `z` (m,) the signs' standard scores."""

    p_value: float
    catalogue: float
    bands: float
    inputs: float
    z: np.ndarray
    power: float


def project(J: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Rows (N,) or (N, k) without what the columns of J (N, n) span."""
    if J.shape[1] == 0:
        return rows
    norms = np.linalg.norm(J, axis=0)
    u, s, _ = np.linalg.svd(J[:, norms > 0] / norms[norms > 0], full_matrices=False)
    q = u[:, s > 1e-9 * s[0]] if len(s) else u
    return rows - q @ (q.T @ rows)


def unit_columns(D: np.ndarray, J: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """D without what J explains, in unit columns, and the lengths left (m,); 0 where nothing is."""
    with np.errstate(over="ignore", invalid="ignore"):  # a sign without bounds tells nothing
        before = np.linalg.norm(D, axis=0)
        rest = project(J, D)
        length = np.linalg.norm(rest, axis=0)
    good = np.isfinite(length) & (length > 1e-4 * before) & (before > 0)
    scaled = np.where(good, rest / np.where(good, length, 1.0), 0.0)
    return scaled, np.where(good, length, 0.0)


def detect(r: np.ndarray, J: np.ndarray, units: np.ndarray, one_sided: np.ndarray,
           bands: list[np.ndarray], inputs: np.ndarray, spread: float, seed: int = 0) -> Detection:
    """Test a whitened residual r (N,) of a fit with Jacobian J (N, n).

    Args:
        units: (N, m) signs from `unit_columns`.
        one_sided: (m,) whether only positive scores count.
        bands: Columns (N, k) of each band of frequency, of about unit length.
        inputs: (N, k) columns of the inputs' past, orthonormal.
        spread: Relative standard error of the noise's power.
    """
    blocks = [units, *(project(J, b) for b in bands), project(J, inputs)]
    L = np.concatenate(blocks, axis=1)
    C = L.T @ L
    # signs and bands overlap: what they share makes C singular up to rounding
    root = np.linalg.cholesky(C + 1e-7 * max(float(np.diag(C).max(initial=0.0)), 1e-12)
                              * np.eye(len(C)))
    rng = np.random.default_rng(seed)
    draws = rng.standard_normal((DRAWS, len(C))) @ root.T
    draws *= np.exp(0.5 * spread * rng.standard_normal((DRAWS, 1)))
    z = L.T @ r
    everything = np.vstack([z, draws])
    ends = np.cumsum([0, *(b.shape[1] for b in blocks)])
    m = units.shape[1]
    scores = everything[:, :m]
    strongest = np.max(np.where(one_sided, np.maximum(scores, 0.0), np.abs(scores)) ** 2, axis=1,
                       initial=0.0)
    powers = np.stack([np.sum(everything[:, a:b] ** 2, axis=1) for a, b in pairwise(ends[1:])],
                      axis=1)
    # bands of many and of few lines compare by their standard scores (Wilson and Hilferty)
    freedom = np.maximum(np.diff(ends)[1:], 1)
    normal = ((powers / freedom) ** (1 / 3) - (1 - 2 / (9 * freedom))) / np.sqrt(2 / (9 * freedom))
    loudest = np.max(normal[:, :-1], axis=1)
    p = [_tail(strongest), _tail(loudest), _tail(normal[:, -1])]
    total = min(1.0, min(q / share for q, share in zip(p, SHARES, strict=True)))
    return Detection(total, p[0], p[1], p[2], z[:m], float(r @ r))


def _tail(values: np.ndarray) -> float:
    """p-value of the first against the others; beyond them by the exponential tail of a χ²."""
    observed, drawn = float(values[0]), np.sort(values[1:])
    above = len(drawn) - int(np.searchsorted(drawn, observed))
    if above >= 10:
        return (above + 1) / (len(drawn) + 1)
    # a generalised Pareto tail would do more; an exponential through two quantiles is cautious
    q1, q2 = drawn[int(0.9 * len(drawn))], drawn[int(0.99 * len(drawn))]
    slope = np.log(10) / max(q2 - q1, 1e-12)
    return float(max(0.01 * np.exp(-slope * max(observed - q2, 0.0)), 1e-300))


def frequency_bands(t: np.ndarray, rate: float, count: int = 9) -> list[np.ndarray]:
    """Sines and cosines (N, k) of about unit length at times t, in bands up to six natural rates.

    Bands widen with frequency, so that a line and a broad hump are both seen.
    """
    span = float(t[-1] - t[0])
    step = float(np.median(np.diff(t)))
    top = min(6 * rate if rate else np.inf, 0.9 * np.pi / step, 2 * np.pi * 150 / span)
    lines = np.arange(1, max(int(top * span / (2 * np.pi)), 3) + 1)
    edges = np.unique(np.round(np.geomspace(1, len(lines) + 1, count + 1)).astype(int))
    bands = []
    for a, b in pairwise(edges):
        phase = 2 * np.pi / span * np.outer(t - t[0], lines[a - 1:b - 1])
        bands.append(np.concatenate([np.cos(phase), np.sin(phase)], axis=1) * np.sqrt(2 / len(t)))
    return bands


def past_inputs(t: np.ndarray, inputs: list[tuple[np.ndarray, np.ndarray]], rate: float,
                lags: int = 12) -> np.ndarray:
    """Orthonormal columns (N, k): each input (times, values) at lags up to a natural period."""
    period = 2 * np.pi / rate if rate else (t[-1] - t[0]) / 20
    columns = [np.interp(t - lag, time, values, left=values[0])
               for time, values in inputs for lag in np.linspace(0, period, lags)]
    if not columns:
        return np.empty((len(t), 0))
    stacked = np.stack(columns, axis=1)
    u, s, _ = np.linalg.svd(stacked - stacked.mean(axis=0), full_matrices=False)
    return np.asarray(u[:, s > 1e-3 * max(float(s[0]), 1e-300)])
