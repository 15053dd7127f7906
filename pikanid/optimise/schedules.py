"""How λ moves: the second column of Table I.

A schedule looks at the stages fitted so far and names the next λ, or None to stop.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from pikanid.approximators import Array


@dataclass(frozen=True, eq=False)
class Stage:
    """One λ fitted: estimate and standard errors (b,), cost parts, effort."""

    lam: float
    theta: Array
    std: Array
    data_cost: float
    physics_cost: float
    iterations: int
    converged: bool


class Schedule(Protocol):
    """Names the next λ."""

    @property
    def warmup(self) -> int:
        """Iterations at the first λ in which only the trajectory moves, θ staying at its guess."""

    def next(self, past: Sequence[Stage]) -> float | None:
        """The next λ, or None to stop."""

    def keep(self, past: Sequence[Stage]) -> int:
        """Index of the stage that is the result."""


@dataclass(frozen=True)
class Fixed:
    """One λ throughout, as in Table II.

    >>> Fixed(1e-4).next([]), Fixed(1e-4).warmup
    (0.0001, 15)
    """

    lam: float
    warmup: int = 15

    def next(self, past: Sequence[Stage]) -> float | None:
        """λ once."""
        return None if past else self.lam

    def keep(self, past: Sequence[Stage]) -> int:
        """The only stage."""
        return len(past) - 1


@dataclass(frozen=True)
class Continuation:
    """λ up by `factor` until no parameter moves by more than `settled` standard errors.

    What a finite λ biases falls as 1/λ, so that after a move of Δ no more than Δ/(factor - 1) is
    left.  `ceiling` is the data cost above which a rise of more than `jump` in one stage counts as
    a lock: the spline cannot follow the equation, the data fit breaks down and 1/l -> 0.  The stage
    before is then the result.  (Splines with as many coefficients as collocation conditions cannot
    lock; for them it is infinite.)
    """

    start: float = 1.0
    factor: float = 100.0
    settled: float = 0.05
    relative: float = 1e-6
    limit: float = 1e12
    warmup: int = 3
    ceiling: float = np.inf
    jump: float = 1.5

    def next(self, past: Sequence[Stage]) -> float | None:
        """The next λ, or None where the estimate has settled, λ has its limit, or it locked."""
        if not past:
            return self.start
        last = past[-1]
        if self.locked(past) or last.lam >= self.limit:
            return None
        if len(past) >= 3 and moved(past[-2].theta, last.theta, last.std, self.relative) <= (
                self.settled):
            return None
        return last.lam * self.factor

    def locked(self, past: Sequence[Stage]) -> bool:
        """Whether the last stage broke the data fit."""
        if len(past) < 2:
            return False
        before, last = past[-2].data_cost, past[-1].data_cost
        return last > self.ceiling and last > self.jump * before

    def keep(self, past: Sequence[Stage]) -> int:
        """The last stage that did not lock."""
        return len(past) - (2 if self.locked(past) else 1)


def moved(before: Array, after: Array, std: Array, relative: float) -> float:
    """Largest change of a parameter in standard errors, a change below `relative` counting as none.

    >>> moved(np.array([1.0, 5.0]), np.array([1.0, 5.2]), np.array([0.1, 0.1]), 1e-6)
    2.0...
    """
    if after.size == 0:
        return 0.0
    scale = std + relative / 0.05 * np.abs(after) + np.finfo(float).tiny
    return float(np.max(np.abs(after - before) / scale))
