"""`minimise` for `Shooting`: where a compiled model is fitted to one recording, in compiled calls.

Between two evaluations of a short recording Python takes half as long as the simulation.
"""

from __future__ import annotations

import numpy as np

from pikanid.objective.shooting import Shooting
from pikanid.optimise.minpack import Optimum, inside, minimise
from pikanid.simulation.simulator import Response

SHORT = 20_000  # limit: sub-steps of a simulation; Python's part is small beyond, and hears Ctrl-C


def fit_shooting(shooting: Shooting, start: np.ndarray, tolerance: float = 1e-9, limit: int = 100,
                 enough: float = 0.0) -> Optimum:
    """The local optimum from `start` (n,) within the bounds of θ; the rest as for `minimise`."""
    lower, upper = shooting.problem.lower, shooting.problem.upper
    theta = np.minimum(np.maximum(start, lower), upper)
    reached = _compiled(shooting, theta, lower, upper, tolerance, limit, enough)
    if reached is None:
        return minimise(
            shooting.residual, shooting.jacobian, theta, lower, upper, tolerance, limit, enough)
    return inside(reached, shooting.residual, shooting.jacobian, theta, lower, upper, tolerance,
                  limit, enough)


def _compiled(shooting: Shooting, theta: np.ndarray, lower: np.ndarray, upper: np.ndarray,
              tolerance: float, limit: int, enough: float) -> Optimum | None:
    """Where MINPACK ends from θ; None where parameters move more than the states, and the like."""
    simulator, steps, (active, own) = (
        shooting.simulators[0], shooting.steps[0], shooting.columns[0])
    experiment, rows, n = simulator.experiment, shooting.rows, len(own)
    if len(shooting.simulators) > 1 or not 0 < n <= rows or not (
            simulator.fixed and experiment.starts_fixed):
        return None
    first, p = shooting.responses(theta)[0], shooting.problem.parameters(theta, 0)
    grid, integrate, before, S0 = simulator.prepared(p, active, steps)
    if not first.finished or before[1].sum() > SHORT:
        return None
    from pikanid.optimise.lmder import CONVERGED, Descent
    from pikanid.optimise.lmder_shooting import descend
    from pikanid.simulation.native_call import integrate_address

    address = integrate_address(integrate)
    if not address:
        return None
    descent = Descent(theta, lower, upper, rows, tolerance, limit, enough)
    X, Y = np.empty((2, len(grid.T), len(experiment.model.states))), np.empty((2, rows))
    flat, r, columns = np.empty((2, rows * n)), np.empty((2, rows)), np.empty((2, n, rows))
    J = flat.reshape(2, rows, n)
    told, best = descend(
        address, before, (experiment.initial(p), S0), p, active, own, tuple(grid.seen),
        (first.y, first.sensitivity), (X, Y, J, flat), (r, columns), (shooting.y, shooting.weights),
        descent.work)
    if told < 0:
        return None
    found = descent.theta
    if best >= 0:
        response = Response(Y[best], J[best], grid.T, X[best], True, float(grid.T[-1]))
        shooting.keep(found, response, r[best], columns[best].T)
    return Optimum(found, descent.cost, told == CONVERGED, descent.evaluations)
