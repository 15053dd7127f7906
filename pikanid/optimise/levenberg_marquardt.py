"""Levenberg-Marquardt within bounds, that stops where statistics do: at a hundredth of χ².

A step minimises the damped quadratic model inside the box, so that bounds hold exactly and a
parameter may be held by two equal ones.  A step that has left a bent valley tells how the residual
bends, and is taken once more with that (the second-order correction of M. K. Transtrum and
J. P. Sethna, arXiv:1201.5885, from the step that failed).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Generic, Protocol, TypeVar

import numpy as np
from scipy.linalg import LinAlgError

from pikanid.approximators import Array
from pikanid.optimise.box import box_minimum

TRIES = 8  # limit: dampings of one step
FIRST, LEAST, AGAIN = 1e-3, 1e-9, 1e-6  # numerical: damping at first, at least, after a failure
BENT = 0.1  # numerical: of a step, that a correction to second order may change it by
UNSEEN = 1e-6  # numerical: change of |r| that a parameter's own size makes, at least
NEAR = 1e-2  # numerical: change of |r| within which a parameter is at its bound
SQUARED = 1e150  # numerical: the square of more may be no number
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
    chi2: float = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "chi2", float(self.r @ self.r))  # asked for again and again

    def pinned(self, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
        """(n,) whether a bound (n,) holds a parameter, at it or so close that the way to it hardly
        changes the residual.
        """
        near = NEAR / np.maximum(np.linalg.norm(self.J, axis=0), 1e-300)
        return held(self.theta, self.J.T @ self.r, lower + near, upper - near)

    def movable(self, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
        """(rows, n) the Jacobian, with zeros for parameters that a bound (n,) holds."""
        return np.where(self.pinned(lower, upper), 0.0, self.J)


@dataclass(frozen=True, eq=False)
class Rows:
    """A residual r (rows,) and its Jacobian J (rows, n)."""

    r: Array
    J: Array

    @property
    def cost(self) -> float:
        """Sum of squares."""
        return float(self.r @ self.r)

    def normal(self) -> tuple[Array, Array]:
        """JᵀJ (n, n) and Jᵀr (n,)."""
        return self.J.T @ self.J, self.J.T @ self.r

    def bend(self, there: Rows, change: Array) -> Array:
        """Jᵀ (n,) times what r after a change (n,) of θ has that J does not foretell."""
        return self.J.T @ (there.r - self.r - self.J @ change)


def minimise(evaluate: Evaluate, start: Array, lower: Array, upper: Array, limit: int = 30,
             tolerance: float = 0.02, give_up: GiveUp = lambda count, last, cost: False,
             sizes: Array | None = None,
             glance: Callable[[Array], Array | None] | None = None) -> Minimum | None:
    """Minimise |r(θ)|² within bounds; None where the start cannot be evaluated.

    After each iteration it is asked whether to `give_up`.  No step takes a parameter of known size
    (n,) far out of its order of magnitude: to change by its size counts as an increase of one.
    A `glance` at r alone, where it costs less than both, tells what becomes of steps that are
    likely to fail.

    >>> line = lambda q: (np.array([q[0] - 3.0]), np.ones((1, 1)))
    >>> found = minimise(line, np.array([1.0]), np.array([0.0]), np.array([2.0]))
    >>> float(found.theta[0])
    2.0
    """
    def rows(theta: Array) -> Rows | None:
        at = evaluate(theta)
        return None if at is None or _beyond(at[0]) else Rows(*at)

    def alone(theta: Array) -> Rows | None:
        r = glance(theta) if glance is not None else None
        return None if r is None or _beyond(r) else Rows(r, np.empty((len(r), 0)))

    found = descend(rows, start, lower, upper, limit, give_up=give_up,
                    enough=lambda at: worth_a_step(at.cost, len(at.r), tolerance), sizes=sizes,
                    bend=Rows.bend, glance=None if glance is None else alone)
    return None if found is None else Minimum(found.theta, found.at.r, found.at.J, found.converged)


def _beyond(r: Array) -> bool:
    """Whether a residual is so large that its square is no number."""
    return bool(np.max(np.abs(r), initial=0.0) > SQUARED)


def worth_a_step(cost: float, rows: int, tolerance: float = 0.02) -> float:
    """Decrease of |r|² that `minimise` asks of a step: far from an explanation nobody needs the
    last digits.

    >>> worth_a_step(100.0, 1000), worth_a_step(5000.0, 1000)
    (0.02, 0.5)
    """
    return max(tolerance, 2e-5 * cost, 0.1 * cost / rows)


def descend(evaluate: Callable[[Array], At | None], start: Array, lower: Array, upper: Array,
            limit: int, enough: Callable[[At], float],
            give_up: GiveUp = lambda count, last, cost: False, sizes: Array | None = None,
            bend: Callable[[At, At, Array], Array] | None = None,
            glance: Callable[[Array], At | None] | None = None) -> Descent[At] | None:
    """Minimise a sum of squares within bounds; None where the start cannot be evaluated.

    Args:
        evaluate: θ (n,) -> the sum of squares there, None where there is none.
        start: (n,).
        lower: (n,).
        upper: (n,).
        limit: Iterations.
        enough: A decrease that is not worth another step.
        give_up: Asked after each iteration.
        sizes: (n,) of parameters, infinite where they are not known: a step by as much counts as an
            increase of one (a proximal term, R. T. Rockafellar, SIAM J. Control Optim. 14, 1976).
        bend: What the slope (n,) changes by, to second order, as a step (n,) from one place to
            another one shows.
        glance: The same as `evaluate`, but for derivatives: what tells whether a step behind one
            that failed, which most often fails as well, is taken.
    """
    theta = np.clip(start, lower, upper)
    usual = np.full(len(theta), np.inf) if sizes is None else sizes
    at, damping = evaluate(theta), FIRST
    if at is None or len(theta) == 0:
        return None if at is None else Descent(theta, at, True)
    for count in range(limit):
        about = _Quadratic(at, theta, lower, upper, usual)
        if not np.isfinite(about.near).all():
            break
        damping, step = about.step(damping)
        while about.fall(step) < enough(at) and damping > LEAST:
            damping, step = about.step(max(damping * 0.1, LEAST))  # it may be the damping's doing
        there = None
        for tried in range(TRIES):
            expected = about.fall(step)
            if expected < enough(at):
                return Descent(theta, at, tried == 0)
            look = evaluate if glance is None or tried == 0 else glance
            new = about.moved(step)
            there = look(new)
            if there is not None and there.cost >= at.cost and bend is not None:
                other = about.corrected(step, damping, bend(at, there, new - theta))
                if other is not None:
                    new = about.moved(other)
                    there = look(new)
            if there is not None and there.cost < at.cost:
                there = there if look is evaluate else evaluate(new)
                if there is not None:
                    break
            there = None
            damping, step = about.step(max(damping * 8, AGAIN))
        if there is None:
            return Descent(theta, at, False)
        before, gain = at.cost, at.cost - there.cost
        damping = max(damping * (0.1 if gain > 0.5 * expected else 1.0), LEAST)
        theta, at = new, there
        if give_up(count + 1, before, at.cost):
            return Descent(theta, at, False)
    return Descent(theta, at, False)


def promised(at: Linearised, theta: Array, lower: Array, upper: Array) -> float:
    """By how much |r|² falls, to second order, with the step within the bounds (n,) that is best
    from θ (n,).
    """
    about = _Quadratic(at, theta, lower, upper, np.full(len(theta), np.inf))
    return about.fall(about.step(LEAST)[1])


class _Quadratic:
    """|r|² about a θ (n,) within bounds, to second order, in units of what shows of a parameter."""

    def __init__(self, at: Linearised, theta: Array, lower: Array, upper: Array, usual: Array):
        gram, slope = at.normal()
        self.theta, self.lower, self.upper = theta, lower, upper
        self.norms = np.sqrt(np.maximum(gram.diagonal(), 1e-300))
        self.matrix, self.slope = gram / np.outer(self.norms, self.norms), slope / self.norms
        self.low, self.high = (lower - theta) * self.norms, (upper - theta) * self.norms
        sizes = np.maximum(usual, np.abs(theta)) * self.norms
        self.near = self.matrix + np.diag(np.maximum(sizes, UNSEEN) ** -2.0)

    def step(self, damping: float) -> tuple[float, Array]:
        """The damped step (n,), and the damping that it needed."""
        while True:
            try:
                return damping, self._lowest(damping, self.slope)
            except LinAlgError:  # alike columns, and hardly any damping
                damping = max(damping * 8, AGAIN)

    def corrected(self, step: Array, damping: float, bend: Array) -> Array | None:
        """The step with what the slope changes by on its way; None where that is much of it."""
        if not np.isfinite(bend).all():
            return None
        other = self._lowest(damping, self.slope + bend / self.norms)
        small = np.linalg.norm(other - step) <= BENT * np.linalg.norm(step)
        return other if small else None

    def fall(self, step: Array) -> float:
        """By how much a step lowers |r|², if nothing bends."""
        return -float(step @ (self.matrix @ step + 2 * self.slope))

    def moved(self, step: Array) -> Array:
        """θ after a step: at a wall exactly, not up to rounding."""
        inside = np.where(step >= self.high, self.upper, self.theta + step / self.norms)
        return np.asarray(np.where(step <= self.low, self.lower, inside))

    def _lowest(self, damping: float, slope: Array) -> Array:
        return box_minimum(self.near + damping * np.eye(len(slope)), slope, self.low, self.high)


def held(theta: Array, slope: Array, lower: Array, upper: Array) -> np.ndarray:
    """(n,) whether a bound holds a parameter that χ² with this slope would push further."""
    return np.asarray(((theta <= lower) & (slope > 0)) | ((theta >= upper) & (slope < 0)))
