"""Does the network's low loss deceive?  The parameters against a simulation started from them.

A network can follow the data closely at wrong parameters, and its loss does not tell.  A few
Gauss-Newton steps of Eq. (1) from the estimate do: they cost milliseconds.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pikanid import errors
from pikanid.approximators import Array
from pikanid.objective.shooting import Shooting
from pikanid.optimise.minpack import minimise
from pikanid.problem.problem import Problem
from pikanid.strategies.settings import CLIMB
from pikanid.uncertainty import covariance

VISIBLE = 1e-3  # numerical: relative: on clean data every difference is many standard errors


@dataclass(frozen=True)
class Verdict:
    """What a simulation says of a curve's parameters.

    Attributes:
        excess: By how much refining them lowers the weighted sum of squares of Eq. (1), in units of
            what is left per degree of freedom, or of the noise where that is more; zero where the
            noise is not known and no parameter is visibly elsewhere, infinite where the model
            cannot be simulated.
        notes: A sentence on the parameter that is furthest outside what the data allow, or none.
    """

    excess: float
    notes: tuple[str, ...]


def against_simulation(problem: Problem, theta: Array, residual: float,
                       far: float = CLIMB.far) -> Verdict:
    """Hold θ against a simulation refined from it.

    `residual` is the root mean square distance of the curve from the data, for the sentence; `far`
    is how many standard errors are too many.
    """
    shooting = Shooting(problem)
    try:
        shooting.choose_steps(theta, "fine")
    except errors.SimulationFailed:
        return Verdict(np.inf, ())
    before = _square(shooting.residual(theta))
    found = minimise(shooting.residual, shooting.jacobian, theta, problem.lower, problem.upper)
    after = _square(shooting.residual(found.theta))
    left = after / max(shooting.rows - theta.size, 1)
    given = shooting.adequacy(found.theta).source == "given"
    scale = 1.0 if given else left
    std = np.sqrt(np.diag(covariance(shooting.jacobian(found.theta),
                                     np.ones(theta.size, bool))) * scale)
    gap = np.abs(theta - found.theta)
    visible = gap > VISIBLE * np.abs(found.theta)
    excess = (before - after) / max(left, float(given), 1e-300) if given or visible.any() else 0.0
    apart = (gap > far * std) & visible & np.isfinite(std)
    if not np.any(apart) or not before - after > far**2 * scale or not found.converged:
        return Verdict(excess, ())
    k = int(np.argmax(np.where(apart, gap / np.maximum(std, 1e-300), -1.0)))
    f = problem.free[k]
    return Verdict(excess, (
        errors.curve_misleads(f.label, theta[k], found.theta[k], std[k], residual, f.unit),))


def _square(residual: Array) -> float:
    return float(residual @ residual)
