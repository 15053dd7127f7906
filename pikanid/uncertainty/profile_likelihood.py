"""Profile likelihood: how far one parameter can move while all others are refitted.

The excess 2 (cost - least cost)/σ² along a parameter follows χ²₁ at the truth (Raue et al.,
Bioinformatics 25, 2009, p. 1923); unlike a standard error it sees curvature and one-sided limits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pikanid import errors
from pikanid.model import Model
from pikanid.objective.shooting import Shooting
from pikanid.optimise.minpack import minimise
from pikanid.problem.problem import Problem
from pikanid.recording import Recording
from pikanid.uncertainty.information import covariance


@dataclass(frozen=True)
class Profile:
    """Profile of one parameter: `values` (k,) and `excess` (k,) of the cost there.

    `interval` holds the values whose excess stays below the χ²₁ quantile of `level`; an end is
    infinite where the profile never leaves it, and the bound where that comes first.
    """

    name: str
    values: np.ndarray
    excess: np.ndarray
    interval: tuple[float, float]
    level: float


def profile(model: Model, recordings: Recording | Sequence[Recording], theta: np.ndarray,
            name: str, level: float = 0.95, points: int = 12) -> Profile:
    """Profile likelihood interval of a parameter around a fitted θ.

    Steps outwards from the optimum on both sides, refitting all others, until the excess passes
    the quantile or the parameter's bound is met; the crossing is interpolated.

    Args:
        model, recordings, theta: As fitted (`estimate.model`, ..., `estimate.theta`).
        name: The parameter (its label, where every recording has its own).
        level: Coverage of the interval.
        points: Values a side at most.

    Raises:
        BadModel: The parameter was not estimated.
    """
    from scipy.stats import chi2

    along = _Along(model, recordings, theta, name)
    quantile = float(chi2.ppf(level, 1))
    low, below = _walk(along, -1.0, quantile, points)
    high, above = _walk(along, 1.0, quantile, points)
    found = {**below, along.best: 0.0, **above}
    order = sorted(found)
    return Profile(name, np.array(order), np.array([found[v] for v in order]), (low, high), level)


class _Along:
    """The cost as a function of one parameter, all others at their best."""

    def __init__(self, model: Model, recordings: Recording | Sequence[Recording],
                 theta: np.ndarray, name: str):
        problem = Problem(model, recordings)
        labels = [f.label for f in problem.free]
        if name not in labels:
            raise errors.BadModel(errors.not_in_model("free parameter", name, labels))
        self.k = labels.index(name)
        self.theta = np.array(theta, dtype=float)
        self.others = np.arange(len(theta)) != self.k
        self.lower, self.upper = problem.lower, problem.upper
        self.shooting = Shooting(problem)
        self.shooting.choose_steps(self.theta, "fine")
        r = self.shooting.residual(self.theta)
        self.least = float(r @ r)
        known = self.shooting.adequacy(self.theta).source == "given"
        self.variance = 1.0 if known else self.least / max(len(r) - len(theta), 1)
        J = self.shooting.jacobian(self.theta)
        # how the others follow at first order: far along a weak direction they must start near
        self.slope = -np.linalg.lstsq(J[:, self.others], J[:, self.k], rcond=None)[0]
        everything = covariance(J, np.ones(len(theta), bool))
        self.std = float(np.sqrt(everything[self.k, self.k] * self.variance))

    @property
    def best(self) -> float:
        return float(self.theta[self.k])

    def excess(self, value: float, start: np.ndarray) -> tuple[float, np.ndarray]:
        """Excess at a value, and the others (n-1,) there; `start` is where to look for them."""

        def full(q: np.ndarray) -> np.ndarray:
            theta = np.empty(len(self.theta))
            theta[self.k], theta[self.others] = value, q
            return theta

        def residual(q: np.ndarray) -> np.ndarray:
            return self.shooting.residual(full(q))

        def jacobian(q: np.ndarray) -> np.ndarray:
            return self.shooting.jacobian(full(q))[:, self.others]

        lower, upper = self.lower[self.others], self.upper[self.others]
        found = minimise(residual, jacobian, np.clip(start, lower, upper), lower, upper)
        return (2 * found.cost - self.least) / self.variance, found.theta


def _walk(along: _Along, side: float, quantile: float, points: int
          ) -> tuple[float, dict[float, float]]:
    """Where the profile crosses the quantile on one side, and what was met on the way."""
    bound = float(along.lower[along.k] if side < 0 else along.upper[along.k])
    # where the data leave the parameter open its standard error is no length to step by
    step = min(along.std * np.sqrt(quantile) / 2, max(abs(along.best), 1e-3))
    others, found = along.theta[along.others], {}
    before_value, before = along.best, 0.0
    for count in range(1, points + 1):
        # equal steps first, then longer ones: a flat profile must be left in finite time
        distance = step * (count if count < 5 else 2.0 ** (count - 2))
        value = along.best + side * distance
        value = max(value, bound) if side < 0 else min(value, bound)
        excess, others = along.excess(value, others + along.slope * (value - before_value))
        found[value] = excess
        if excess >= quantile:
            roots = np.sqrt([max(before, 0.0), quantile, excess])
            share = (roots[1] - roots[0]) / (roots[2] - roots[0])
            return float(before_value + share * (value - before_value)), found
        if value == bound:
            return bound, found
        before_value, before = value, excess
    return side * float("inf"), found
