"""Correlations of a whitened residual, with bands and joint tests that count what was fitted.

For a Gaussian residual r of covariance s²Σ the sums r'S_k r, S_k the shift by k samples made
symmetric, have the means s² tr(S_k Σ) and the covariances 2 s⁴ tr(S_k Σ S_l Σ); without parameters
that is the variance of G. M. Ljung and G. E. P. Box, Biometrika 65, 1978.  An AR coefficient that
was fitted to the same residual takes its share of the first lags (G. E. P. Box and D. A. Pierce,
J. Am. Stat. Assoc. 65, 1970).  Correlations with columns X that do not depend on the noise, such as
inputs at some lags, have the covariance s² Xᵀ Σ X.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pikanid.comparison.whitened import White

BLOCK = 20_000  # numerical: rows at once, to keep memory small
SHOWN = 1e-3  # numerical: of the largest singular value: what is below repeats other columns
LEFT = 1e-6  # numerical: of a unit column's power, that must be left after what was fitted


@dataclass(frozen=True, eq=False)
class Correlation:
    """Correlations at lags, and what noise allows.

    Attributes:
        lags: (K,) in samples; with an input, positive where the residual follows it.
        values: (K,).
        mean: (K,) expected of a right model: small, since parameters were fitted.
        std: (K,) standard deviation for a right model.
    """

    lags: np.ndarray
    values: np.ndarray
    mean: np.ndarray
    std: np.ndarray


@dataclass(frozen=True)
class Joint:
    """A joint test: its kind, what it is about, statistic, degrees of freedom, p-value."""

    kind: str
    of: str
    statistic: float
    dof: int
    p_value: float


def autocorrelation(white: White, lags: int) -> tuple[Correlation, Joint]:
    """Correlation of a residual with itself at lags 1 to `lags`, and whether all are chance."""
    from scipy.special import chdtrc

    size = int(white.places[-1]) + 1
    there = np.zeros(size)
    there[white.places] = 1.0
    r, W = np.zeros(size), np.zeros((size, white.W.shape[1]))
    r[white.places], W[white.places] = white.r, white.W
    lags = min(lags, size - 1)
    power = float(r @ r)
    values = np.array([r[k:] @ r[:-k] for k in range(1, lags + 1)]) / power
    mean, covariance = _moments(there, W, white.D, lags)
    D = white.rho ** np.arange(lags) if white.estimated else np.zeros(lags)
    taken = np.outer(D, D) / (D @ D) if white.estimated else np.zeros((lags, lags))
    keep = np.eye(lags) - taken
    mean, covariance = keep @ mean, keep @ covariance @ keep.T
    rank = lags - int(white.estimated)
    inverse = np.linalg.pinv(covariance, rcond=1e-9, hermitian=True)
    statistic = float((values - mean) @ inverse @ (values - mean))
    found = Correlation(np.arange(1, lags + 1), values, mean,
                        np.sqrt(np.maximum(np.diag(covariance), 0.0)))
    return found, Joint("whiteness", "", statistic, rank, float(chdtrc(rank, statistic)))


def _moments(there: np.ndarray, W: np.ndarray, D: np.ndarray, lags: int
             ) -> tuple[np.ndarray, np.ndarray]:
    """Mean (K,) and covariance (K, K) of the autocorrelations on a grid (M,) with gaps."""
    n, w, size = float(there.sum()), W.shape[1], len(there)
    pairs = np.array([there[k:] @ there[:-k] for k in range(1, lags + 1)])
    gram = np.zeros((lags * w, lags * w))
    inner = np.zeros((lags, w, w))
    padded = np.concatenate([np.zeros((lags, w)), W, np.zeros((lags, w))])
    for a in range(0, size, BLOCK):
        b = min(a + BLOCK, size)
        G = np.stack([0.5 * (padded[lags + a + k:lags + b + k] + padded[lags + a - k:lags + b - k])
                      for k in range(1, lags + 1)], axis=1) * there[a:b, None, None]
        inner += np.einsum("rkj,ri->kij", G, W[a:b])
        flat = G.reshape(b - a, lags * w)
        gram += flat.T @ flat
    first = np.einsum("kjj,j->k", inner, D)
    blocks = gram.reshape(lags, w, lags, w)
    second = 2 * np.einsum("kjlj,j->kl", blocks, D)
    third = np.einsum("kij,lji,i,j->kl", inner, inner, D, D)
    product = W.T @ W
    power = n + float(np.sum(D * np.diag(product)))
    squared = n + 2 * float(np.sum(D * np.diag(product))) + float(D @ product**2 @ D)
    covariance = (np.diag(pairs) + 2 * (second + third)) / (power**2 + 2 * squared)
    return first / power, covariance


def with_columns(white: White, columns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Correlations (k,) with columns (N, k), and their standard deviations for a right model."""
    norms = np.linalg.norm(columns, axis=0)
    unit = columns / np.where(norms > 0, norms, 1.0)
    variance = np.sum(unit**2, axis=0) + white.D @ (white.W.T @ unit) ** 2
    values = unit.T @ white.r / np.linalg.norm(white.r)
    return values, np.sqrt(np.maximum(variance, 0.0) / white.freedom)


def jointly(white: White, columns: np.ndarray, kind: str, of: str) -> Joint | None:
    """F-test of whether a residual knows anything of columns X (N, k); None where they show
    nothing that the fit has not taken up.
    """
    from scipy.special import fdtrc

    norms = np.linalg.norm(columns, axis=0)
    if not np.any(norms > 0):
        return None
    u, s, _ = np.linalg.svd(columns[:, norms > 0] / norms[norms > 0], full_matrices=False)
    basis = u[:, s > SHOWN * s[0]]
    values, vectors = np.linalg.eigh(white.covariance(basis))
    good = values > LEFT
    q, n = int(good.sum()), white.freedom
    if q == 0 or n <= q + 1:
        return None
    scores = (vectors[:, good].T @ (basis.T @ white.r)) / np.sqrt(values[good])
    explained = float(scores @ scores)
    total = float(white.r @ white.r)
    statistic = (explained / q) / max((total - explained) / (n - q), 1e-300)
    return Joint(kind, of, statistic, q, float(fdtrc(q, n - q, statistic)))
