"""Levenberg-Marquardt for Eq. (2) of deep networks; see `bordered` for its linear algebra.

`optimise.levenberg_marquardt` knows no structure: with 690 unknowns (320 cells, two hidden nodes) a
step by bordered bands takes 22 ms on one core with its normal equations, and one by a dense matrix
113 ms once that is there.  Nor does it charge coefficients and θ differently, or refuse a trial
that leaves the hidden grids before it is evaluated.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from scipy.linalg import LinAlgError

from pikanid.approximators import Array
from pikanid.optimise.bordered import Bordered, BorderedSystem, Evaluation, evaluate
from pikanid.optimise.gauss_newton import ROUNDING, Point

LEAST_DAMPING, MOST_DAMPING = 1e-6, 1e15  # numerical: undamped, or no step at all


@dataclass(frozen=True, eq=False)
class Stop:
    """Where the optimiser stopped, and how."""

    at: Evaluation
    damping: float
    path: tuple[Array, ...]  # θ at every iterate
    converged: bool


def levenberg_marquardt(system: BorderedSystem, point: Point, lam: float, lower: Array,
                        upper: Array, *, damping: float = 1.0, iterations: int = 50,
                        tolerance: float = 1e-3,
                        admitted: Callable[[Point], bool] = lambda _: True) -> Stop:
    """Minimise Eq. (2) at one λ from a point; θ keeps to its bounds in every step.

    A step δ is charged damping·‖δ/units‖², θ's part nothing.  A trial that is not `admitted`
    (hidden values have left their grid) is a failed one.  Converged when the promised decrease is
    below `tolerance` of one datum's share of the cost, or when no step helps and the promise is a
    rounding error.
    """
    functional = system.functional
    at, grow = evaluate(functional, point, lam), 2.0
    path = [point.theta]
    for done in range(iterations + 1):
        share = at.cost / max(1, functional.n_data)
        normal = system.normal(at)
        while True:
            step, promised, damping = _step(system, at, normal, damping, lower, upper)
            if promised <= tolerance * share or done == iterations:
                return Stop(at, damping, tuple(path), promised <= tolerance * share)
            moved = Point(
                tuple(c + d for c, d in zip(at.point.coefficients, step.coefficients, strict=True)),
                at.point.theta + step.theta)
            if admitted(moved):
                trial = evaluate(functional, moved, lam)
                gained = (at.cost - trial.cost) / promised
                if gained > 1e-4:
                    break
            damping, grow = damping * grow, 2.0 * grow
            if damping > MOST_DAMPING:
                return Stop(at, damping, tuple(path), promised <= ROUNDING * share)
        # Nielsen's rule (IMM-REP-1999-05): a third where the model is right, no more than doubled
        damping, grow = max(LEAST_DAMPING, damping * max(1 / 3, 1 - (2 * gained - 1) ** 3)), 2.0
        at = trial
        path.append(at.point.theta)
    raise AssertionError("the last iteration returns")


def _step(system: BorderedSystem, at: Evaluation, normal: list[Bordered], damping: float,
          lower: Array, upper: Array) -> tuple[Point, float, float]:
    """The step at a damping, or at the least one that makes the matrices positive definite."""
    while True:
        try:
            return *system.step(at, normal, damping, lower, upper), damping
        except LinAlgError:
            damping *= 10.0
            if damping > MOST_DAMPING:
                raise
