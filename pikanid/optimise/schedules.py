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
    left.  That holds for splines with as many coefficients as physics conditions.
    """

    start: float = 1.0
    factor: float = 100.0
    settled: float = 0.05
    relative: float = 1e-6
    limit: float = 1e12
    warmup: int = 3

    def next(self, past: Sequence[Stage]) -> float | None:
        """The next λ, or None where the estimate has settled or λ has its limit."""
        if not past:
            return self.start
        settled = len(past) >= 3 and _move(past, -1, self.relative) <= self.settled
        return None if settled or past[-1].lam >= self.limit else past[-1].lam * self.factor

    def keep(self, past: Sequence[Stage]) -> int:
        """The last stage."""
        return len(past) - 1


@dataclass(frozen=True)
class Cautious:
    """λ up by `factor`, back one step where the splines themselves become the limit.

    Splines smoother than the equation have fewer coefficients than there are physics conditions;
    a large λ locks them (1/l -> 0 minimises the physics alone).  The sign: where the physics could
    be met, its cost λ·P falls as 1/λ; where the discretisation leaves a floor, it rises as λ.
    `noise_cost` is the data cost that noise alone explains; below half of it the splines still
    follow the noise, and a rise means nothing.
    """

    noise_cost: float
    start: float = 1.0
    factor: float = 10.0
    settled: float = 0.05
    relative: float = 1e-6
    limit: float = 1e12
    warmup: int = 3

    def next(self, past: Sequence[Stage]) -> float | None:
        """The next λ, or None where the estimate has settled or the splines began to lock."""
        if not past:
            return self.start
        calm = len(past) >= 3 and _move(past, -1, self.relative) <= self.settled
        if calm or self._locked(past) or past[-1].lam >= self.limit:
            return None
        return past[-1].lam * self.factor

    def keep(self, past: Sequence[Stage]) -> int:
        """The last stage before the lock."""
        return len(past) - (2 if self._locked(past) else 1)

    def _locked(self, past: Sequence[Stage]) -> bool:
        if len(past) < 2:
            return False
        last, before = past[-1], past[-2]
        floor = last.physics_cost > 0.5 * self.factor * before.physics_cost
        misfit = last.data_cost > 1.5 * max(self.noise_cost, before.data_cost)
        return misfit or (floor and last.data_cost > 0.5 * self.noise_cost)


def _move(past: Sequence[Stage], index: int, relative: float) -> float:
    """Move into stage `index`, in the standard errors of the stage before it."""
    before, after = past[index - 1], past[index]
    return moved(before.theta, after.theta, before.std, relative)


def moved(before: Array, after: Array, std: Array, relative: float) -> float:
    """Largest change of a parameter in standard errors, a change below `relative` counting as none.

    >>> moved(np.array([1.0, 5.0]), np.array([1.0, 5.2]), np.array([0.1, 0.1]), 1e-6)
    2.0...
    """
    if after.size == 0:
        return 0.0
    scale = std + relative / 0.05 * np.abs(after) + np.finfo(float).tiny
    return float(np.max(np.abs(after - before) / scale))
