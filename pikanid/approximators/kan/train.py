"""A KAN fitted to points by Levenberg-Marquardt on exact Jacobians, slightly smoothed.

    min |y - f(x; c)|² / var(y) + μ M Σ_edges |D² c_e|² + ε |c|²

D² are second differences (P-splines; Eilers & Marx, Statistical Science 11, 1996, p. 89).  Steps
that take hidden values off their grids, where edges fade to zero, are refused.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pikanid import errors
from pikanid.approximators.kan.build import from_state
from pikanid.approximators.kan.deep import DeepKAN
from pikanid.approximators.kan.edges import edges_of
from pikanid.approximators.kan.plan import Array
from pikanid.approximators.kan.state import to_state

RIDGE = 1e-8  # numerical: holds coefficients that no sample sees


@dataclass(frozen=True, eq=False)
class PointFit:
    """A KAN at the least squares of its points.

    Attributes:
        kan: A new pykan model.
        network: The same, evaluated fast.
        residual: y - f(x) (M,).
        jacobian: ∂f/∂c (M, coefficients).
        normal: JᵀJ + penalty.
        effective: Effective number of coefficients.
    """

    kan: Any
    network: DeepKAN
    residual: Array
    jacobian: Array
    normal: Array
    effective: float

    @property
    def variance(self) -> float:
        """Of the noise, by what is left."""
        return float(self.residual @ self.residual) / max(len(self.residual) - self.effective, 1.0)

    def covariance(self, at: NDArray[np.int64], beside: NDArray[np.int64]) -> Array:
        """Of the coefficients at places `at`, those `beside` unknown too and all others known.

        Scales that layers or factors trade among each other make the whole matrix meaningless: an
        edge is judged beside the edges of the same sum.
        """
        every = np.union1d(at, beside)
        inverse = np.linalg.pinv(self.normal[np.ix_(every, every)], 1e-14, True)
        mine = np.searchsorted(every, at)
        return np.asarray(self.variance * inverse[np.ix_(mine, mine)], float)


def fit_points(kan: Any, x: Array, y: Array, *, smooth: float = 1e-6, iterations: int = 100
               ) -> PointFit:
    """Fit a copy of a KAN with one output to points, starting at its coefficients.

    Args:
        kan: A pykan model of splines on uniform grids.
        x: Inputs (M, inputs).
        y: Outputs (M,).
        smooth: μ.
        iterations: Steps at most; 0 only evaluates.

    Raises:
        BadSetting: If the shapes do not fit the model or values are not finite.

    >>> from pikanid.approximators.kan import build_kan
    >>> x = np.linspace(-1.0, 1.0, 100)[:, None]
    >>> fit = fit_points(build_kan([1, 1], grid=5), x, x[:, 0] ** 3)
    >>> bool(np.abs(fit.residual).max() < 1e-3)
    True
    """
    x, y = np.asarray(x, float), np.asarray(y, float).ravel()
    network = DeepKAN(from_state(to_state(kan)))
    plan = network.plan
    fits = x.ndim == 2 and x.shape == (len(y), plan.nodes(0)) and plan.nodes(-1) == 1
    if not fits or not (np.isfinite(x).all() and np.isfinite(y).all()):
        raise errors.BadSetting(errors.kan_points(x.shape, y.shape, plan.nodes(0), plan.nodes(-1)))
    size = float(np.std(y)) or 1.0
    P = size**2 * _penalty(network, smooth * len(y))
    c, damping, grow = network.coefficients, 1e-2, 2.0
    jet = network.evaluate(x, c, order=0, jacobian=True)
    r, J = y - jet.values[0][:, 0], jet.jacobians[0][:, 0]
    cost = float(r @ r + c @ P @ c)
    for _ in range(iterations):
        A, g = J.T @ J + P, J.T @ r - P @ c
        diagonal = np.diag(A).max()
        accepted = False
        while damping < 1e12:
            step = np.linalg.solve(A + damping * 1e-3 * diagonal * np.eye(len(c)), g)
            moved = c + step
            if _inside(network, x, moved):
                left = y - network.evaluate(x, moved, order=0).values[0][:, 0]
                new = float(left @ left + moved @ P @ moved)
                if new < cost:
                    accepted = True
                    break
            damping, grow = damping * grow, 2.0 * grow
        if not accepted:
            break
        gain, c, cost, damping, grow = 1.0 - new / cost, moved, new, max(damping / 5, 1e-12), 2.0
        jet = network.evaluate(x, c, order=0, jacobian=True)
        r, J = y - jet.values[0][:, 0], jet.jacobians[0][:, 0]
        if gain < 1e-7:
            break
    network.set_coefficients(c)
    H = J.T @ J
    inverse = np.linalg.pinv(H + P, 1e-12, True)
    effective = float(np.trace(inverse @ H))
    return PointFit(network.kan, network, r, J, H + P, effective)


def _inside(network: DeepKAN, x: Array, c: Array) -> bool:
    """Whether all hidden values lie on their grids."""
    places = network.coverage(x, c)[1:]
    return all(bool(np.isfinite(p).all() and p.min() >= 0.0 and p.max() <= 1.0) for p in places)


def _penalty(network: DeepKAN, weight: float) -> Array:
    """Second differences of every edge's spline, and a trace of a ridge."""
    P = RIDGE * np.eye(network.n_coefficients) * max(weight, 1.0)
    for edge in edges_of(network):
        at = edge.splines
        D = np.diff(np.eye(len(at)), 2, axis=0) * abs(edge.scale)
        P[np.ix_(at, at)] += weight * (D.T @ D)
    return P
