"""Levenberg-Marquardt on all unknowns of Eq. (2) with a dense Jacobian.

For approximators without a local basis, such as networks of up to a few thousand coefficients: a
step solves (JᵀJ + μ D) δ = -Jᵀr, on the smaller side of J.

`optimise.levenberg_marquardt` is for a few parameters: it takes steps to the minimum of the model
in the box, and stops where statistics do.  In a PINN's chunk of ten iterations (J of 769 rows and
623 columns, one core) its step takes 111 ms against 29 ms here, and the ten iterations, as long as
these, end at a cost of 15260 against 9570: it begins with μ = 1e-3 again, where this goes on from
the last chunk's.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from pikanid.approximators import Array

Residual = Callable[[Array], Array]
Linearised = Callable[[Array], tuple[Array, Array]]
FLOOR = 1e-6  # numerical: of the mean squared column norm, for columns that hardly matter yet


@dataclass(frozen=True, eq=False)
class Solution:
    """Where Levenberg-Marquardt stopped: z (n,), r (rows,) and J (rows, n) there."""

    z: Array
    residual: Array
    jacobian: Array
    iterations: int
    converged: bool
    damping: float

    @property
    def cost(self) -> float:
        """Sum of squared residuals."""
        return float(self.residual @ self.residual)


def levenberg_marquardt(residual: Residual, linearised: Linearised, start: Array, *,
                        lower: Array, upper: Array, iterations: int = 100,
                        tolerance: float = 1e-6, damping: float = 1e-3) -> Solution:
    """Minimise |r(z)|² within bounds from `start` (n,).

    Args:
        residual, linearised: z -> r (rows,), and z -> (r, ∂r/∂z (rows, n)).
        tolerance: Relative fall of the cost in an iteration, three times in a row, at which to
            stop.
        damping: First μ, relative to the columns' squared norms.

    >>> def line(z): return np.array([z[0] - 3.0, z[0] * z[1] - 6.0]), np.array(
    ...     [[1.0, 0.0], [z[1], z[0]]])
    >>> none = np.full(2, np.inf)
    >>> levenberg_marquardt(lambda z: line(z)[0], line, np.ones(2), lower=-none, upper=none,
    ...                     tolerance=1e-12).z.round(6)
    array([3., 2.])
    """
    z = np.clip(start, lower, upper)
    r, jacobian = linearised(z)
    cost, grow, calm, count = float(r @ r), 2.0, 0, 0
    for count in range(1, iterations + 1):
        slope = jacobian.T @ r
        held = (z <= lower) & (slope > 0.0) | (z >= upper) & (slope < 0.0)
        norms = np.einsum("ij,ij->j", jacobian, jacobian)
        scale = np.where(held, np.inf, np.maximum(norms, FLOOR * norms.mean() + 1e-300))
        system = _Damped(jacobian, r, scale)
        while True:
            step = system.step(damping)
            trial = np.clip(z + step, lower, upper)
            with np.errstate(all="ignore"):
                there = residual(trial)
                new = float(there @ there)
            if np.isfinite(new) and new < cost:
                break
            damping, grow = damping * grow, 2.0 * grow
            if damping > 1e12:
                return Solution(z, r, jacobian, count, True, damping)
        damping, grow = max(damping / 5.0, 1e-14), 2.0
        fall, z = (cost - new) / max(cost, 1e-300), trial
        r, jacobian = linearised(z)
        cost = float(r @ r)
        calm = calm + 1 if fall < tolerance else 0
        if calm == 3:
            return Solution(z, r, jacobian, count, True, damping)
    return Solution(z, r, jacobian, count, False, damping)


class _Damped:
    """-(JᵀJ + μ diag(scale))⁻¹ Jᵀ r for any μ; an infinite scale holds its entry.

    With A = J·scale^-½ it is -scale^-½ (AᵀA + μ)⁻¹ Aᵀ r = -scale^-½ Aᵀ (AAᵀ + μ)⁻¹ r.
    """

    def __init__(self, jacobian: Array, r: Array, scale: Array):
        self.root = 1.0 / np.sqrt(scale)
        self.scaled = jacobian * self.root
        self.wide = jacobian.shape[0] < jacobian.shape[1]
        self.gram = self.scaled @ self.scaled.T if self.wide else self.scaled.T @ self.scaled
        self.pull = r if self.wide else self.scaled.T @ r

    def step(self, damping: float) -> Array:
        """The step (n,); zero where rounding leaves nothing to solve, so that it is refused."""
        matrix = self.gram.copy()
        matrix[np.diag_indices_from(matrix)] += damping
        try:
            solved = cho_solve(cho_factor(matrix, overwrite_a=True, check_finite=False), self.pull)
        except LinAlgError:
            return np.zeros(self.root.size)
        return -self.root * (self.scaled.T @ solved if self.wide else solved)
