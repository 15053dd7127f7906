"""One edge as data: points with noise, or a spline's coefficients with their covariance.

Naming needs least squares of y against a few functions of x, in units of the noise, beside columns
that are free anyway: the constant, and what an edge cannot show (its gauge).  `Curve` gives exactly
that, whatever the edge came from.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from pikanid import errors
from pikanid.symbolic.numeric import Array

FEWEST = 8  # limit: points that can name anything
SHOWN = 0.05  # numerical: of a function's size: with less left beside the free columns it is theirs
INFORMED = 1e-9  # numerical: of the largest eigenvalue: those below are rounding
EXACT = 1e-6  # numerical: of the spread of y: closer than this nothing is told apart


@dataclass(frozen=True, eq=False)
class Curve:
    """An edge over its range.

    Attributes:
        x, y: Argument and value (n,), sorted by x.
        weight: Functions of x are compared as `weight @ f`: (r, n), or (n,) for a diagonal; in
            units of the noise where `known`.
        known: Whether the noise is known, or only that all of `weight` is equally noisy.
        free: Further columns (n, m) that every candidate may use.
        samples: Number of observations behind the curve, for BIC.
        argument, unit, x_unit: What x and y are.
        target: y as it is compared (r,).
        std: Standard deviation of y (n,), where it is known.
        exact: Share of the spread of y below which nothing is told apart.
    """

    x: Array
    y: Array
    weight: Array
    known: bool
    free: Array
    samples: int
    argument: str = "x"
    unit: str = ""
    x_unit: str = ""
    target: Array = field(default_factory=lambda: np.empty(0))
    std: Array | None = None
    exact: float = EXACT

    @staticmethod
    def of_points(x: Array, y: Array, sigma: float | Array | None = None, *,
                  argument: str = "x", unit: str = "", x_unit: str = "",
                  exact: float = EXACT) -> Curve:
        """Points with independent noise of standard deviation sigma; None: equal and unknown.

        Raises:
            BadSetting: Fewer than 8 points, values that are not finite, an x that does not move, a
                sigma that is not positive.
        """
        x, y = np.asarray(x, float).ravel(), np.asarray(y, float).ravel()
        if len(x) != len(y) or len(x) < FEWEST or not np.isfinite([x, y]).all() or np.ptp(x) == 0:
            raise errors.BadSetting(errors.edge_points(len(x), len(y), FEWEST))
        order = np.argsort(x, kind="stable")
        spread = np.ones(len(x))
        if sigma is not None:
            spread = np.broadcast_to(np.asarray(sigma, float), x.shape)[order]
            if not (np.isfinite(spread).all() and np.all(spread > 0)):
                raise errors.BadSetting(errors.bad_value("sigma", sigma, "a positive number"))
        weight = 1.0 / spread
        return Curve(x[order], y[order], weight, sigma is not None, np.empty((len(x), 0)), len(x),
                     argument, unit, x_unit, weight * y[order],
                     None if sigma is None else spread, exact)

    @staticmethod
    def of_spline(x: Array, basis: Array, coefficients: Array, covariance: Array, *,
                  samples: int | None = None, free: Array | None = None, argument: str = "x",
                  unit: str = "", x_unit: str = "") -> Curve:
        """basis (n, K) @ coefficients (K,) of covariance (K, K), at x (n,).

        Candidates are compared after projection on the spline: it is not blamed for what it cannot
        follow.  The constant and the `free` columns (n, m) may have any variance: they are taken
        out before anything is compared.
        """
        x = np.asarray(x, float)
        order = np.argsort(x, kind="stable")
        B = np.asarray(basis, float)[order]
        extra = np.empty((len(x), 0)) if free is None else np.asarray(free, float)[order]
        values, vectors = np.linalg.eigh(0.5 * (covariance + covariance.T))
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        u, s, _ = np.linalg.svd(np.column_stack([np.ones(len(x)), extra]), full_matrices=False)
        u = u[:, s > 1e-10 * s[0]]
        spread = B @ root
        spread = spread - u @ (u.T @ spread)
        left, sizes, _ = np.linalg.svd(spread, full_matrices=False)
        good = sizes > 1e-6 * sizes[0]
        weight = (left[:, good] / sizes[good]).T
        y = B @ coefficients
        return Curve(x[order], y, weight, True, extra, samples or int(good.sum()), argument,
                     unit, x_unit, weight @ y, np.linalg.norm(spread, axis=1))

    @staticmethod
    def of_covariance(x: Array, y: Array, covariance: Array, *, samples: int | None = None,
                      free: Array | None = None, argument: str = "x", unit: str = "",
                      x_unit: str = "") -> Curve:
        """Values (n,) with a full covariance (n, n), which may be singular."""
        values, vectors = np.linalg.eigh(0.5 * (covariance + covariance.T))
        good = values > 1e-9 * values[-1]
        root = vectors[:, good]
        return Curve.of_spline(x, root, root.T @ np.asarray(y, float), np.diag(values[good]),
                               samples=samples, free=free, argument=argument, unit=unit,
                               x_unit=x_unit)

    @staticmethod
    def of_likelihood(x: Array, basis: Array, coefficients: Array, covariance: Array,
                      information: Array, gain: Array, *, samples: int, free: Array,
                      argument: str = "x", unit: str = "", x_unit: str = "") -> Curve:
        """basis (n, K) @ coefficients (K,), compared by χ² = cᵀ information c - 2 gainᵀ c + const.

        Unlike `of_spline` nothing smooths what is compared: a law with a kink is not blamed for a
        prior that has none.  A law's c is its least-squares spline at x; the information must not
        see the constant.  `covariance` (K, K) is shown; `free` (n, m) are columns that it holds
        already.
        """
        x = np.asarray(x, float)
        order = np.argsort(x, kind="stable")
        B = np.asarray(basis, float)[order]
        sizes, vectors = np.linalg.eigh(information)
        good = sizes > INFORMED * sizes[-1]
        root = vectors[:, good] * np.sqrt(sizes[good])
        weight = root.T @ np.linalg.pinv(B, 1e-10)
        target = (vectors[:, good] / np.sqrt(sizes[good])).T @ gain
        std = np.sqrt(np.maximum(np.einsum("ni,ij,nj->n", B, covariance, B), 0.0))
        return Curve(x[order], B @ coefficients, weight, True, np.asarray(free, float)[order],
                     samples, argument, unit, x_unit, target, std)

    @property
    def low(self) -> float:
        """Lower end of the range."""
        return float(self.x[0])

    @property
    def high(self) -> float:
        """Upper end of the range."""
        return float(self.x[-1])

    @property
    def rows(self) -> int:
        """Number of whitened values r."""
        return len(self.target)

    def whiten(self, functions: Array) -> Array:
        """Functions of x (..., n) as they are compared (..., r)."""
        if self.weight.ndim == 1:
            return functions * self.weight
        return functions @ self.weight.T

    @cached_property
    def fixed(self) -> Array:
        """Orthonormal basis (r, m) of the whitened constant and free columns."""
        if self.weight.ndim == 2:  # they have been taken out already
            return np.empty((self.rows, 0))
        columns = np.vstack([np.ones(len(self.x)), self.free.T])
        u, s, _ = np.linalg.svd(self.whiten(columns).T, full_matrices=False)
        return np.asarray(u[:, s > 1e-10 * s[0]])

    @cached_property
    def taken(self) -> Array:
        """Orthonormal basis (n, m) of the constant and the free columns."""
        columns = np.column_stack([np.ones(len(self.x)), self.free])
        u, s, _ = np.linalg.svd(columns, full_matrices=False)
        return np.asarray(u[:, s > 1e-10 * s[0]])

    def visible(self, functions: Array) -> Array:
        """Which functions of x (..., n) are not the free columns over again: (...,) bool.

        A law that the free columns follow but for a trace could take any size, so that the trace
        fits what another law has left.
        """
        if not self.free.shape[1]:
            return np.ones(functions.shape[:-1], bool)
        centred = functions - functions.mean(axis=-1, keepdims=True)
        left = functions - (functions @ self.taken) @ self.taken.T
        return np.asarray(np.linalg.norm(left, axis=-1)
                          > SHOWN * np.linalg.norm(centred, axis=-1))

    def project(self, whitened: Array) -> Array:
        """Whitened functions (..., r) without their constant and free parts."""
        return whitened - (whitened @ self.fixed) @ self.fixed.T

    @cached_property
    def centred(self) -> Array:
        """The whitened values (r,) without their constant and free parts."""
        return self.project(self.target)

    @cached_property
    def total(self) -> float:
        """Sum of squares of `centred`."""
        return float(self.centred @ self.centred)

    @cached_property
    def floor(self) -> float:
        """Mean square that counts as none: rounding, and iterations that stop."""
        return self.exact**2 * self.total / self.rows

    def score(self, rss: float, parameters: int) -> float:
        """BIC of a fit with this residual sum of squares, up to a constant of the curve."""
        penalty = parameters * float(np.log(max(self.samples, 2)))
        if self.known:
            return rss + penalty
        return self.rows * float(np.log(rss / self.rows + self.floor + 1e-300)) + penalty

    def variance(self, rss: float, parameters: int) -> float:
        """Of whitened values: 1 where the noise is known."""
        return 1.0 if self.known else rss / max(self.rows - parameters, 1)

    def thinned(self, most: int) -> Callable[[Array], Array]:
        """Which points a first search may do with: a slice of functions (..., n)."""
        step = 1 if self.weight.ndim == 2 else max(1, len(self.x) // most)
        return lambda functions: functions[..., ::step]
