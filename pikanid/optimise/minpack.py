"""Bounded nonlinear least squares to the last digit: MINPACK, and what holds parameters at bounds.

MINPACK knows no bounds: a step outside them is refused, and only a start that ends there
is finished by `levenberg_marquardt`.  It stands beside that one for its speed: a start of NLS takes
1.8 ms with this one, in 15 simulations, and 3.8 ms with the other, in 20
(`benchmarks/test_bench_least_squares.py`).  The other stands beside this one for diagnoses: this
one can neither hold a parameter nor give up what is out of reach, and two of the simulated rigs
took 6.4 s and 5.9 s with it instead of 4.5 s and 4.6 s.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from pikanid.optimise.levenberg_marquardt import Rows, descend, promised

BESIDE = 1e-3  # numerical: of a parameter, by which it may be off a bound that it is beside
LAST = 1e-4  # numerical: of what a step must promise elsewhere, that one beside a bound must
Vector = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Optimum:
    """Where a local fit stopped; cost is half the sum of squared residuals."""

    theta: np.ndarray
    cost: float
    converged: bool
    evaluations: int


def minimise(residual: Vector, jacobian: Vector, start: np.ndarray, lower: np.ndarray,
             upper: np.ndarray, tolerance: float = 1e-9, limit: int = 100, enough: float = 0.0
             ) -> Optimum:
    """Minimise ½|r(θ)|² within bounds from `start` (n,).

    Args:
        residual, jacobian: θ (n,) -> r (rows,) and ∂r/∂θ (rows, n).
        tolerance: Relative change of θ and of the cost at which to stop.
        limit: Evaluations allowed.
        enough: Share of the cost that a step must promise.

    >>> found = minimise(lambda q: np.array([q[0] - 3.0]), lambda q: np.ones((1, 1)),
    ...                  np.array([1.0]), np.array([0.0]), np.array([2.0]))
    >>> round(float(found.theta[0]), 6)
    2.0
    """
    theta = np.minimum(np.maximum(start, lower), upper)
    r = residual(theta)
    if len(start) == 0:
        return Optimum(theta, 0.5 * float(r @ r), True, 1)
    reached = Optimum(theta, np.inf, False, 0)
    if len(r) >= len(start):
        from pikanid.optimise.lmder import CONVERGED, EVALUATE, LINEARISE, Descent

        descent = Descent(theta, lower, upper, len(r), tolerance, limit, enough)
        told = descent.linearise(r, jacobian(theta))
        while told == EVALUATE:
            r = residual(descent.trial)
            told = descent.judge(r)
            if told == LINEARISE:
                told = descent.linearise(r, jacobian(descent.theta))
        reached = Optimum(
            descent.theta, descent.cost, told == CONVERGED, descent.evaluations)
    return inside(reached, residual, jacobian, theta, lower, upper, tolerance, limit, enough)


def inside(reached: Optimum, residual: Vector, jacobian: Vector, start: np.ndarray,
           lower: np.ndarray, upper: np.ndarray, tolerance: float, limit: int, enough: float
           ) -> Optimum:
    """What MINPACK has `reached` from `start`, or what `levenberg_marquardt` makes of it where a
    step within the bounds promises more: MINPACK takes a bound for the end of its way.  The rest as
    for `minimise`.
    """
    theta, evaluations = reached.theta, 0

    def at(q: np.ndarray) -> Rows | None:
        nonlocal evaluations
        if evaluations >= limit:
            return None
        evaluations += 1
        r = residual(q)
        return Rows(r, jacobian(q)) if np.isfinite(r).all() else None

    # beside a bound MINPACK's last steps were cut short, and are not as good as they promise
    beside = np.any(np.minimum(theta - lower, upper - theta) < BESIDE * np.abs(theta) + 1e-15)
    here, share = at(theta), max(tolerance, enough) * (LAST if beside else 1.0)
    if here is None:
        return reached
    if (more := promised(here, theta, lower, upper)) <= share * here.cost:
        exact = here.cost == 0.0  # also where MINPACK has not been asked
        return replace(reached, cost=0.0, converged=True) if exact else reached
    first = residual(start)
    least = tolerance**2 * float(first @ first)  # of what is exact, no share is worth a step
    if more < least:
        return reached
    found = descend(at, theta, lower, upper, limit, lambda now: share * now.cost + least,
                    bend=Rows.bend)
    if found is None or 0.5 * found.at.cost > (1.0 - tolerance) * reached.cost:
        return replace(reached, evaluations=reached.evaluations + evaluations)
    return Optimum(found.theta, 0.5 * found.at.cost, found.converged,
                   reached.evaluations + evaluations)
