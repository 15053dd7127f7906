"""Small optimisers that record their iterates, to be run on two versions of one objective."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

Array = NDArray[np.float64]
Residuals = Callable[[Array], tuple[Array, Array]]
Loss = Callable[[Array], tuple[float, Array]]

# A step stays as well defined as double precision allows.
_LEAST_DAMPING = 1e-8  # numerical: paths of two versions of one objective part by rounding alone
_LEAST_GAIN = 1e-12  # numerical: relative, in the loss: less is rounding


@dataclass(frozen=True, eq=False)
class Path:
    """Iterates (steps + 1, unknowns), start first, and whether the last is a minimiser."""

    iterates: Array
    converged: bool

    def first(self, steps: int) -> Path:
        """The start and the first ``steps`` iterates."""
        return Path(self.iterates[: steps + 1], self.converged)

    def last(self) -> Path:
        """The last iterate alone."""
        return Path(self.iterates[-1:], self.converged)


def levenberg_marquardt(residuals: Residuals, start: Array, steps: int) -> Path:
    """Levenberg-Marquardt with column scaling, by QR of the damped system.

    >>> path = levenberg_marquardt(lambda x: (x**2 - 4.0, np.diag(2 * x)), np.ones(1), 30)
    >>> path.converged, float(path.iterates[-1, 0].round(6))
    (True, 2.0)
    """
    x, damping = start.copy(), 1e-3
    r, jacobian = residuals(x)
    iterates = [x]
    while len(iterates) <= steps:
        scale = np.maximum(np.linalg.norm(jacobian, axis=0), 1e-12)
        system = np.vstack([jacobian / scale, np.sqrt(damping) * np.eye(x.size)])
        step = np.linalg.lstsq(system, np.concatenate([-r, np.zeros(x.size)]), rcond=None)[0]
        model = r + jacobian @ (step / scale)
        # A gain that rounding would hide is none: both versions stop at the same iterate.
        if r @ r - model @ model <= _LEAST_GAIN * (r @ r):
            return Path(np.array(iterates), True)
        candidate = x + step / scale
        r_new, jacobian_new = residuals(candidate)
        if r_new @ r_new < r @ r:
            x, r, jacobian = candidate, r_new, jacobian_new
            damping = max(damping / 10.0, _LEAST_DAMPING)
        else:
            damping *= 10.0
        iterates.append(x)
    return Path(np.array(iterates), False)


def lbfgs(loss: Loss, start: Array, steps: int) -> Path:
    """SciPy's L-BFGS-B, which PIKAN trainings use in one form or another."""
    iterates = [start.copy()]
    result = minimize(loss, start, jac=True, method="L-BFGS-B",
                      callback=lambda x: iterates.append(x.copy()),
                      options={"maxiter": steps, "ftol": 0.0, "gtol": 0.0})
    return Path(np.array(iterates), bool(result.status == 0))


def adam(loss: Loss, start: Array, steps: int, rate: float = 1e-3) -> Path:
    """Adam (Kingma and Ba 2015) with its usual constants.

    >>> adam(lambda x: (float(x @ x), 2 * x), np.ones(1), 2, rate=0.5).iterates.ravel().round(6)
    array([1.     , 0.5    , 0.03391])
    """
    x = start.copy()
    mean, square = np.zeros_like(x), np.zeros_like(x)
    iterates = [x]
    for step in range(1, steps + 1):
        _, gradient = loss(x)
        mean = 0.9 * mean + 0.1 * gradient
        square = 0.999 * square + 0.001 * gradient**2
        move = mean / (1.0 - 0.9**step) / (np.sqrt(square / (1.0 - 0.999**step)) + 1e-8)
        x = x - rate * move
        iterates.append(x)
    return Path(np.array(iterates), False)
