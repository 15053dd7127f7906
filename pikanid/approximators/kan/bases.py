"""Local spline bases on pykan's unclamped knots, powers in them, and the derivatives of SiLU."""

from __future__ import annotations

from math import factorial

import numpy as np
from numpy.typing import NDArray

from pikanid.approximators.bspline import BSpline

Array = NDArray[np.float64]
Index = NDArray[np.int64]


def spline_rows(t: Array, knots: Array, degree: int, derivative: int = 0) -> tuple[Index, Array]:
    """First active basis function at ``t`` (M,), and its degree + 1 active values (M, degree + 1).

    The last time takes its limit from the left, inside the grid; pykan's own recursion takes it
    from outside, which falsifies the k-th derivative.

    Raises:
        ValueError: If a time leaves the grid.

    >>> first, values = spline_rows(np.array([0.5]), np.arange(-1.0, 3.0), degree=1)
    >>> first, values
    (array([0]), array([[0.5, 0.5]]))
    """
    return BSpline(degree, knots).local(t, derivative)


def power_blossom(knots: Array, degree: int, centre: float, order: int) -> Array:
    """Coefficients (n,) of the polynomial (t - centre)^order / order! in a spline basis.

    The blossom of a power is the mean of the products of ``order`` of the ``degree`` inner knots
    (Ramshaw; de Boor's dual functionals), an elementary symmetric function.

    >>> knots = np.arange(-2.0, 5.0)
    >>> first, rows = spline_rows(np.array([1.25]), knots, degree=2)
    >>> c = power_blossom(knots, 2, centre=0.5, order=2)
    >>> float(rows[0] @ c[first[0] : first[0] + 3])
    0.28125
    """
    n = knots.size - degree - 1
    symmetric = np.zeros((order + 1, n))
    symmetric[0] = 1.0
    for step in range(1, degree + 1):
        symmetric[1:] += symmetric[:-1] * (knots[step : step + n] - centre)
    ways = factorial(degree) / factorial(degree - order)  # order! times the number of subsets
    return symmetric[order] / ways


def silu(t: Array, derivative: int = 0) -> Array:
    """t σ(t), pykan's base function, or a derivative: t σ^(n) + n σ^(n-1).

    >>> silu(np.array([0.0]), 1)
    array([0.5])
    """
    value = t * _sigmoid(t, derivative)
    return value + derivative * _sigmoid(t, derivative - 1) if derivative else value


def _sigmoid(t: Array, derivative: int) -> Array:
    """Derivatives of the logistic function as polynomials of it: σ' = σ (1 - σ)."""
    polynomial = np.polynomial.Polynomial([0.0, 1.0])
    slope = np.polynomial.Polynomial([0.0, 1.0, -1.0])
    for _ in range(derivative):
        polynomial = polynomial.deriv() * slope
    return polynomial(0.5 * (1.0 + np.tanh(0.5 * t)))
