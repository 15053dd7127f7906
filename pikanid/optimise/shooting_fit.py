"""`minimise` for `Shooting`: where a compiled model is fitted to one recording, in compiled calls.

Between two evaluations of a short recording Python takes half as long as the simulation.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pikanid.objective.shooting import Shooting
from pikanid.optimise.minpack import Optimum, minimise
from pikanid.simulation.simulator import Response

if TYPE_CHECKING:
    from pikanid.optimise.lmder import Descent

SHORT = 20_000  # limit: sub-steps of a simulation; Python's part is small beyond, and hears Ctrl-C


def fit_shooting(shooting: Shooting, start: np.ndarray, tolerance: float = 1e-9, limit: int = 100
                 ) -> Optimum:
    """The local optimum from `start` (n,) within the bounds of θ."""
    problem = shooting.problem

    def go_on(descent: Descent) -> int | None:
        return _compiled(shooting, descent)

    return minimise(shooting.residual, shooting.jacobian, start, problem.lower, problem.upper,
                    tolerance, limit, go_on)


def _compiled(shooting: Shooting, descent: Descent) -> int | None:
    """Go on to the end and say what that was; None where parameters move more than the states."""
    simulator, steps = shooting.simulators[0], shooting.steps[0]
    experiment = simulator.experiment
    if len(shooting.simulators) > 1 or not (simulator.fixed and experiment.starts_fixed):
        return None
    active, own = shooting.columns[0]
    p = shooting.problem.parameters(descent.theta, 0)
    grid, integrate, before, S0 = simulator.prepared(p, active, steps)
    if before[1].sum() > SHORT:
        return None
    from pikanid.optimise.lmder_shooting import descend
    from pikanid.simulation.native_call import integrate_address

    address = integrate_address(integrate)
    if not address:
        return None
    rows, n = grid.rows, len(own)
    X, Y = np.empty((2, len(grid.T), len(experiment.model.states))), np.empty((2, rows))
    J, r, columns = np.empty((2, rows, n)), np.empty((2, rows)), np.empty((2, n, rows))
    told, best = descend(
        address, before, (experiment.initial(p), S0), p, active, own, tuple(grid.seen), (X, Y, J),
        (r, columns), (shooting.y, shooting.weights), descent.work)
    if best >= 0:
        response = Response(Y[best], J[best], grid.T, X[best], True, float(grid.T[-1]))
        shooting.keep(descent.theta, response, r[best], columns[best].T)
    return int(told) if told >= 0 else None
