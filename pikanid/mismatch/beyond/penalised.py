"""Penalised least squares beside free parameters: random curves, by restricted likelihood."""

from __future__ import annotations

import numpy as np
from scipy.linalg import cho_solve, solve_triangular
from scipy.optimize import brentq
from scipy.stats import norm

from pikanid.noise.projection import orthonormal

# of the force, in knot intervals: it follows an oscillation, or does not
MEMORIES = (2.0, 50.0)  # numerical: the likelihood takes one of two, and is flat between them
DECADES = 10  # numerical: of the penalty's weight, from almost no force downwards
HOPELESS = 60.0  # numerical: -2 ln likelihood above the best: e^-30, lighter weights are worse
NEARBY = 10.0 ** np.array([-0.6, -0.3, 0.0, 0.3, 0.6])  # numerical: of the weight of a like fit
LARGEST = 40.0  # numerical: standard errors: the normal tail is zero beyond, in double precision
GAUGE = 1e-6  # numerical: of the prior: tells apart forces that do the same as a parameter


class Penalised:
    """Penalised least squares of a target (N,) on columns D (N, K) beside J (N, p).

    Attributes:
        coefficients: (K,).
        root: (K, K) lower triangular; root rootᵀ is the penalised information at unit noise.
        gauge: (K, K) takes out of coefficients what J can do.
        freedom: Effective number of coefficients.
        left: Variance of what is left.
        weight, memory: Of the prior.
    """

    def __init__(self, D: np.ndarray, J: np.ndarray, target: np.ndarray, before: Penalised | None):
        q = orthonormal(J)
        target = target - q @ (q.T @ target)
        inside, whole = q.T @ D, D.T @ D
        self.information = whole - inside.T @ inside
        self.pull = D.T @ target
        self.power = float(target @ target)
        self.count = len(target) - q.shape[1]
        self.weight, self.memory = self._coarse() if before is None else self._near(before)
        penalty = self.weight * _prior(len(whole), self.memory)
        self.root = np.linalg.cholesky(self.information + penalty)
        self.coefficients = cho_solve((self.root, True), self.pull)
        held = solve_triangular(self.root, np.linalg.cholesky(penalty), lower=True)
        self.freedom = len(whole) - float(np.sum(held**2))
        self.left = (self.power - float(self.pull @ self.coefficients)) / self.count
        alike = cho_solve((np.linalg.cholesky(whole + GAUGE * penalty), True), inside.T)
        self.gauge = np.eye(len(whole)) - alike @ inside

    def _coarse(self) -> tuple[float, float]:
        """(weight, memory) of the most likely prior.

        The heaviest weight leaves about one effective coefficient: an estimate of nothing at all
        would have no band.
        """
        found: list[tuple[float, float, float]] = []
        for memory in MEMORIES:
            prior = _prior(len(self.pull), memory)
            most = float(np.trace(np.linalg.solve(prior, self.information)))
            volume, least = float(np.linalg.slogdet(prior)[1]), np.inf
            for weight in most * 10.0 ** -np.arange(DECADES):
                criterion = self._unlikely(weight, prior) - volume
                found.append((criterion, float(weight), memory))
                least = min(least, criterion)
                if criterion > least + HOPELESS:
                    break
        return min(found)[1:]

    def _near(self, before: Penalised) -> tuple[float, float]:
        """(weight, memory) about those of another fit."""
        prior = _prior(len(self.pull), before.memory)
        weights = before.weight * NEARBY
        return float(min(weights, key=lambda w: self._unlikely(w, prior))), before.memory

    def _unlikely(self, weight: float, prior: np.ndarray) -> float:
        """-2 ln of the restricted likelihood, the noise's variance profiled, + ln |prior|."""
        root = np.linalg.cholesky(self.information + weight * prior)
        explained = float(np.sum(solve_triangular(root, self.pull, lower=True) ** 2))
        left = max(self.power - explained, 1e-12 * self.power)
        return float(self.count * np.log(left / self.count) + 2 * np.sum(np.log(np.diag(root)))
                     - len(root) * np.log(weight))


def _prior(count: int, memory: float) -> np.ndarray:
    """(K, K) inverse covariance, up to its size, of coefficients that forget after `memory` steps:
    those of an Ornstein-Uhlenbeck process.
    """
    steps = np.diff(np.eye(count), axis=0)
    return np.asarray(steps.T @ steps + np.eye(count) / memory**2)


def critical_value(spread: np.ndarray, level: float) -> float:
    """Half the width, in standard errors, of a band that holds a whole Gaussian curve.

    The curve's unit vectors run on a sphere; the longer their way κ, the more independent chances
    there are to leave the band:  κ/π exp(-z²/2) + 2 (1 - Φ(z)) = 1 - level  (J. Sun and C. R.
    Loader, Ann. Stat. 22, 1994).  It grows with the effective degrees of freedom, as κ does.

    Args:
        spread: (K, G) root of the curve's covariance, which is spreadᵀ spread.
        level: Probability, between 0 and 1.

    >>> round(critical_value(np.ones((1, 5)), 0.95), 2)     # a constant: a single chance
    1.96
    """
    unit = spread / np.maximum(np.linalg.norm(spread, axis=0), 1e-300)
    way = float(np.sum(np.linalg.norm(np.diff(unit, axis=1), axis=0)))
    return float(brentq(lambda z: way / np.pi * np.exp(-z * z / 2) + 2 * norm.sf(z) - (1 - level),
                        0.0, LARGEST))
