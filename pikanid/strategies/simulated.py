"""Does the simulation at a relaxed estimate ask for another one?

In the limit of strong physics and fine grids a relaxed fit is the least-squares fit of the
simulated model, whose Gauss-Newton step from the estimate therefore says what grid and λ have left
to gain.  The model is simulated there anyway, for the verdict.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.linalg import LinAlgError

from pikanid import errors
from pikanid.approximators import Array
from pikanid.objective.shooting import Shooting
from pikanid.optimise.box import met
from pikanid.optimise.cholesky import solve_positive
from pikanid.optimise.schedules import moved


def choose_steps(shooting: Shooting, theta: Array) -> None:
    """Fine steps at θ, foretold of coarse ones: that takes a simulation less than from nothing.

    Raises:
        SimulationFailed: The trajectory is not finite at θ with any step.
    """
    shooting.choose_steps(theta, "coarse", passed=True)
    shooting.choose_steps(theta, "fine")


def step_left(shooting: Shooting, theta: Array, std: Array, relative: float) -> float:
    """The largest step of the simulated fit from θ (b,), in standard errors (b,), see `moved`.

    Parameters at a bound stay there.  Infinite where the model cannot be simulated at θ, or does
    not show every parameter.
    """
    try:
        choose_steps(shooting, theta)
    except errors.SimulationFailed:
        return math.inf
    problem = shooting.problem
    inside = ~met(theta, problem.lower, problem.upper)
    jacobian, step = shooting.jacobian(theta)[:, inside], np.zeros(theta.size)
    size = np.sqrt((jacobian**2).sum(axis=0))
    if not (size > 0.0).all():
        return math.inf
    jacobian = jacobian / size
    try:
        step[inside] = solve_positive(
            jacobian.T @ jacobian, jacobian.T @ shooting.residual(theta)) / size
    except LinAlgError:
        return math.inf
    return moved(theta, theta - step, std, relative)
