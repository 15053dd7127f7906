"""Levenberg-Marquardt within bounds, that stops where statistics do: at a hundredth of χ².

A step minimises the damped quadratic model inside the box, so that bounds hold exactly and a
parameter may be held by two equal ones.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

import numpy as np
from scipy.linalg import LinAlgError

from pikanid.approximators import Array
from pikanid.optimise.box import box_minimum

TRIES = 8  # limit: dampings of one step
NEAR = 1e-2  # numerical: change of |r| within which a parameter is at its bound
Evaluate = Callable[[Array], tuple[Array, Array] | None]
GiveUp = Callable[[int, float, float], bool]  # number of an iteration, |r|² before and after it


class Linearised(Protocol):
    """A sum of squares |r|² at some θ, to second order."""

    @property
    def cost(self) -> float:
        """|r|²."""

    def normal(self) -> tuple[Array, Array]:
        """JᵀJ (n, n) and Jᵀr (n,)."""


At = TypeVar("At", bound=Linearised)


@dataclass(frozen=True)
class Descent(Generic[At]):
    """Where a descent ended: θ (n,), what was evaluated there, and whether it is a minimum."""

    theta: Array
    at: At
    converged: bool


@dataclass(frozen=True)
class Minimum:
    """θ (n,), residual r (rows,) and Jacobian (rows, n) there; |r|² is χ²."""

    theta: np.ndarray
    r: np.ndarray
    J: np.ndarray
    converged: bool

    @property
    def chi2(self) -> float:
        """Sum of squares."""
        return float(self.r @ self.r)

    def movable(self, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
        """(rows, n) the Jacobian, with zeros for parameters that a bound (n,) holds, at it
        or so close that the way to it hardly changes the residual.
        """
        near = NEAR / np.maximum(np.linalg.norm(self.J, axis=0), 1e-300)
        return np.where(held(self.theta, self.J.T @ self.r, lower + near, upper - near),
                        0.0, self.J)


@dataclass(frozen=True, eq=False)
class Rows:
    """A residual (rows,) and its Jacobian (rows, n)."""

    r: Array
    J: Array

    @property
    def cost(self) -> float:
        """Sum of squares."""
        return float(self.r @ self.r)

    def normal(self) -> tuple[Array, Array]:
        """JᵀJ (n, n) and Jᵀr (n,)."""
        return self.J.T @ self.J, self.J.T @ self.r


def minimise(evaluate: Evaluate, start: Array, lower: Array, upper: Array, limit: int = 30,
             tolerance: float = 0.02, give_up: GiveUp = lambda count, last, cost: False
             ) -> Minimum | None:
    """Minimise |r(θ)|² within bounds; None where the start cannot be evaluated.

    After each iteration it is asked whether to `give_up`.

    >>> line = lambda q: (np.array([q[0] - 3.0]), np.ones((1, 1)))
    >>> found = minimise(line, np.array([1.0]), np.array([0.0]), np.array([2.0]))
    >>> float(found.theta[0])
    2.0
    """
    def rows(theta: Array) -> Rows | None:
        at = evaluate(theta)
        return None if at is None else Rows(*at)

    found = descend(rows, start, lower, upper, limit, give_up=give_up,
                    enough=lambda at: worth_a_step(at.cost, len(at.r), tolerance))
    return None if found is None else Minimum(found.theta, found.at.r, found.at.J, found.converged)


def worth_a_step(cost: float, rows: int, tolerance: float = 0.02) -> float:
    """Decrease of |r|² that `minimise` asks of a step: far from an explanation nobody needs the
    last digits.

    >>> worth_a_step(100.0, 1000), worth_a_step(5000.0, 1000)
    (0.02, 0.5)
    """
    return max(tolerance, 2e-5 * cost, 0.1 * cost / rows)


def descend(evaluate: Callable[[Array], At | None], start: Array, lower: Array, upper: Array,
            limit: int, enough: Callable[[At], float],
            give_up: GiveUp = lambda count, last, cost: False) -> Descent[At] | None:
    """Minimise a sum of squares within bounds; None where the start cannot be evaluated.

    Args:
        evaluate: θ (n,) -> the sum of squares there, None where there is none.
        start: (n,).
        lower: (n,).
        upper: (n,).
        limit: Iterations.
        enough: A decrease that is not worth another step.
        give_up: Asked after each iteration.
    """
    theta = np.clip(start, lower, upper)
    at, damping = evaluate(theta), 1e-3
    if at is None or len(theta) == 0:
        return None if at is None else Descent(theta, at, True)
    for count in range(limit):
        gram, slope = at.normal()
        norms = np.sqrt(np.maximum(gram.diagonal(), 1e-300))
        matrix, pull = gram / np.outer(norms, norms), slope / norms
        low, high = (lower - theta) * norms, (upper - theta) * norms
        there = None
        for _ in range(TRIES):
            try:
                step = box_minimum(matrix + damping * np.eye(len(theta)), pull, low, high)
            except LinAlgError:  # alike columns, and hardly any damping
                damping = max(damping * 8, 1e-4)
                continue
            expected = -float(step @ (matrix @ step + 2 * pull))
            if expected < enough(at):
                return Descent(theta, at, True)
            # at a wall exactly, not up to rounding
            new = np.where(step <= low, lower, np.where(step >= high, upper, theta + step / norms))
            there = evaluate(new)
            if there is not None and there.cost < at.cost:
                break
            damping, there = max(damping * 8, 1e-4), None
        if there is None:
            return Descent(theta, at, False)
        before, gain = at.cost, at.cost - there.cost
        damping = max(damping * (0.1 if gain > 0.5 * expected else 1.0), 1e-9)
        theta, at = new, there
        if give_up(count + 1, before, at.cost):
            return Descent(theta, at, False)
    return Descent(theta, at, False)


def held(theta: Array, slope: Array, lower: Array, upper: Array) -> np.ndarray:
    """(n,) whether a bound holds a parameter that χ² with this slope would push further."""
    return np.asarray(((theta <= lower) & (slope > 0)) | ((theta >= upper) & (slope < 0)))
