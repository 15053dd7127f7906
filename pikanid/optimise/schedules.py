"""How λ moves: the second column of Table I.

A schedule looks at the stages fitted so far and names the next λ, or None to stop.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from pikanid.approximators import Array

NOTHING = 1e-8  # numerical: of the noise's cost: a physics cost without any influence
QUICK = 6  # numerical: iterations from a bad guess, where λ leads nowhere else
LOCKABLE_BIAS = 0.05 / 9  # numerical: [standard errors] where λ rises tenfold: a move of 0.05


@dataclass(frozen=True, eq=False)
class Stage:
    """One λ fitted: estimate and standard errors (b,), cost parts, effort.

    `std` may be an upper bound of the standard errors where those themselves decide nothing.
    `free` says that the splines were seen to follow the physics at this λ: whatever rose there is
    the model's misfit, and no lock.
    """

    lam: float
    theta: Array
    std: Array
    data_cost: float
    physics_cost: float
    iterations: int
    converged: bool
    free: bool = False


class Schedule(Protocol):
    """Names the next λ."""

    @property
    def enough(self) -> float:
        """What a fit at a λ on the way may still promise of the cost."""

    @property
    def warmup(self) -> int:
        """Iterations at the first λ in which only the trajectory moves, θ staying at its guess."""

    def next(self, past: Sequence[Stage]) -> float | None:
        """The next λ, or None to stop."""

    def keep(self, past: Sequence[Stage]) -> int:
        """Index of the stage that is the result: the last one or the one before."""

    def locked(self, past: Sequence[Stage]) -> bool:
        """Whether the last stage looks as if the splines could not follow the physics."""


@dataclass(frozen=True)
class Fixed:
    """One λ throughout, as in Table II.

    >>> Fixed(1e-4).next([]), Fixed(1e-4).warmup
    (0.0001, 15)
    """

    lam: float
    warmup: int = 15
    enough: float = 0.0

    def next(self, past: Sequence[Stage]) -> float | None:
        """λ once."""
        return None if past else self.lam

    def keep(self, past: Sequence[Stage]) -> int:
        """The only stage."""
        return len(past) - 1

    def locked(self, past: Sequence[Stage]) -> bool:
        """There is nothing to compare with."""
        return False


@dataclass(frozen=True)
class Continuation:
    """λ up by `factor` until a finite λ biases no parameter by more than `bias` standard errors.

    Where the splines can meet the physics for any θ, the bias and the physics' cost λ·P fall as 1/λ
    in the end: where λ·P fell to its f-th part, a move of Δ leaves no more than Δ/(f - 1).
    Beyond the third stage, or after a slow one, λ rises by the root of the factor.

    `lockable` splines cannot (smoother than the equation, they have fewer coefficients than there
    are physics conditions): their λ·P has a floor that rises as λ, so that f is taken to be the
    factor, and a larger λ locks the fit (1/l -> 0 minimises the physics alone).  The stage before
    that is then the result.  `noise_cost` is the data cost that noise alone explains; below half of
    it the splines still follow the noise, and a rise means nothing.
    """

    noise_cost: float
    lockable: bool = False
    start: float = 1.0
    factor: float = 1e4
    bias: float = 1e-3
    relative: float = 1e-6
    limit: float = 1e12
    warmup: int = 0
    enough: float = 0.0

    def next(self, past: Sequence[Stage]) -> float | None:
        """The next λ, or None where the estimate has settled, locked, or got no further."""
        if not past:
            return self.start
        last = past[-1]
        if self.locked(past) or last.lam >= self.limit or (
                len(past) > 1 and not last.converged):
            return None
        if len(past) >= 3 and self._eased(past[-2], last) and moved(
                past[-2].theta, last.theta, past[-2].std, self.relative
                ) <= self.bias * (self._fall(past[-2], last) - 1.0):
            return None
        far = self.lockable or (len(past) < 3 and last.iterations <= QUICK)
        return last.lam * (self.factor if far else self.factor**0.5)

    def keep(self, past: Sequence[Stage]) -> int:
        """The last stage before a lock or a failure to converge."""
        bad = self.locked(past) or (len(past) > 1 and not past[-1].converged)
        return len(past) - (2 if bad else 1)

    def _eased(self, before: Stage, last: Stage) -> bool:
        """Whether the physics has begun to win: λP falls (or there is nothing to win).

        While λ is too weak to matter, P stays and λP rises as λ: there θ rests as well, at what a
        regression on the smoothed data gives, and of a model that misfits that is another θ.
        """
        return last.physics_cost <= max(before.physics_cost, NOTHING * self.noise_cost)

    def _fall(self, before: Stage, last: Stage) -> float:
        """How many times as small as before the bias is."""
        if self.lockable or last.physics_cost <= NOTHING * self.noise_cost:
            return last.lam / before.lam
        return before.physics_cost / last.physics_cost

    def locked(self, past: Sequence[Stage]) -> bool:
        """Whether a cost rose as it does in a lock, and the splines were not seen to be free."""
        if not self.lockable or len(past) < 2 or past[-1].free:
            return False
        last, before = past[-1], past[-2]
        floor = last.physics_cost > 0.5 * self.factor * before.physics_cost
        misfit = last.data_cost > 1.5 * max(self.noise_cost, before.data_cost)
        return misfit or (floor and last.data_cost > 0.5 * self.noise_cost)


def moved(before: Array, after: Array, std: Array, relative: float) -> float:
    """Largest change of a parameter in standard errors, a change below `relative` counting as none.

    >>> round(moved(np.array([1.0, 5.0]), np.array([1.0, 5.2]), np.array([0.1, 0.1]), 1e-6), 2)
    2.0
    """
    if after.size == 0:
        return 0.0
    scale = np.maximum(std + relative / 0.05 * np.abs(after), 1e-150)
    return float(np.max(np.abs(after - before) / scale))
