"""Does the simulation at a relaxed estimate ask for another one?

In the limit of strong physics and fine grids a relaxed fit is the least-squares fit of the simulated
model, whose Gauss-Newton step from the estimate therefore says what grid and λ have left to gain.
The model is simulated there anyway, for the verdict.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import LinAlgError

from pikanid import errors
from pikanid.approximators import Array
from pikanid.objective.shooting import Shooting
from pikanid.optimise.box import met
from pikanid.optimise.cholesky import solve_positive
from pikanid.optimise.schedules import moved

# What "fine" integration steps may move an estimate by.
AGREES = 0.01  # numerical: [standard errors] of a step that is none


def at_optimum(shooting: Shooting, theta: Array, std: Array, relative: float) -> bool:
    """Whether the step of the simulated fit from θ (b,) is none beside standard errors (b,).

    Parameters at a bound stay there.  False where the model cannot be simulated at θ.
    """
    try:
        shooting.choose_steps(theta, "fine")
    except errors.SimulationFailed:
        return False
    problem = shooting.problem
    inside = ~met(theta, problem.lower, problem.upper)
    jacobian, step = shooting.jacobian(theta)[:, inside], np.zeros(theta.size)
    size = np.sqrt((jacobian**2).sum(axis=0))
    if not (size > 0.0).all():
        return False
    jacobian = jacobian / size
    try:
        step[inside] = solve_positive(
            jacobian.T @ jacobian, jacobian.T @ shooting.residual(theta)) / size
    except LinAlgError:
        return False
    return moved(theta, theta - step, std, relative) <= AGREES
