"""Levenberg-Marquardt on all unknowns of Eq. (2) with a dense Jacobian.

For approximators without a local basis, such as networks of up to a few thousand coefficients: a
step solves (JᵀJ + μ D) δ = -Jᵀr, on the smaller side of J.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from pikanid.approximators import Array

Residual = Callable[[Array], Array]
Linearised = Callable[[Array], tuple[Array, Array]]
FLOOR = 1e-6  # of the mean squared column norm, for columns that hardly matter yet


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

    Parameters
    ----------
    residual, linearised : z -> r (rows,), and z -> (r, ∂r/∂z (rows, n))
    tolerance : relative fall of the cost in an iteration, three times in a row, at which to stop
    damping : first μ, relative to the columns' squared norms

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
        while True:
            step = _damped_step(jacobian, r, damping * scale)
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


def _damped_step(jacobian: Array, r: Array, penalty: Array) -> Array:
    """-(JᵀJ + diag(penalty))⁻¹ Jᵀ r; an infinite penalty holds its entry."""
    rows, columns = jacobian.shape
    inverse = 1.0 / penalty
    try:
        if rows < columns:
            # (JᵀJ + D)⁻¹ Jᵀ = D⁻¹ Jᵀ (J D⁻¹ Jᵀ + 1)⁻¹
            weighted = jacobian * inverse
            gram = weighted @ jacobian.T
            gram[np.diag_indices(rows)] += 1.0
            return -weighted.T @ cho_solve(cho_factor(gram, check_finite=False), r)
        root = np.sqrt(inverse)
        scaled = jacobian * root
        gram = scaled.T @ scaled
        gram[np.diag_indices(columns)] += 1.0
        return -root * cho_solve(cho_factor(gram, check_finite=False), scaled.T @ r)
    except LinAlgError:
        return np.zeros(columns)
