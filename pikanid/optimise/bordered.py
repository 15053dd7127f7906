"""Eq. (2) for deep networks along time: Levenberg-Marquardt with banded-plus-border algebra.

The first layer's edges have time itself as their argument: a residual touches only the k + 1
splines of each that live there, whatever the later layers do.  JᵀJ is therefore a band in the first
layer's coefficients, bordered by all the others and θ, and a step costs O(N).

A network is redundant (what an outer edge scales, an inner one can scale back), JᵀJ singular, and
every step damped: in units that the caller gives and not in those of JᵀJ, because what a step must
not overshoot is the network's curvature, and the weight λ of the physics says nothing about that.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from pikanid.approximators import Array
from pikanid.objective.functional import Functional, Rows
from pikanid.optimise.box import box_minimum
from pikanid.optimise.cholesky import factor_band, solve_band
from pikanid.optimise.gauss_newton import Point
from pikanid.optimise.local_rows import Family, Layout
from pikanid.optimise.smoothing import multiply


@dataclass(frozen=True, eq=False)
class Evaluation:
    """Eq. (2) at an iterate: residual rows of every recording and the parts of ‖r‖²."""

    point: Point
    lam: float
    rows: tuple[tuple[Rows, ...], ...]
    data_costs: tuple[tuple[float, ...], ...]  # per recording, per data family
    physics_cost: float
    other_cost: float

    @property
    def data_cost(self) -> float:
        """Weighted sum of squares of the data rows."""
        return sum(map(sum, self.data_costs))

    @property
    def cost(self) -> float:
        """‖r‖², all families together."""
        return self.data_cost + self.physics_cost + self.other_cost


def evaluate(functional: Functional, point: Point, lam: float) -> Evaluation:
    """Residuals at a point."""
    rows, data, physics, other = [], [], 0.0, 0.0
    for r, (part, c) in enumerate(zip(functional.parts, point.coefficients, strict=True)):
        own = tuple(functional.rows(r, c, point.theta, lam))
        costs = [float(np.sum(row.residual**2)) for row in own]
        rows.append(own)
        data.append(tuple(costs[:len(part.data)]))
        physics += costs[len(part.data)]
        other += sum(costs[len(part.data) + 1:])
    return Evaluation(point, lam, tuple(rows), tuple(data), physics, other)


@dataclass(frozen=True, eq=False)
class Solved:
    """One recording eliminated: what is left for θ, and how its coefficients follow."""

    schur: Array  # (b, b)
    slope: Array  # (b,)
    inner: Array  # (n, b): Δα = -(outer + inner Δθ), in the order of the coefficient vector
    outer: Array  # (n,)


class Bordered:
    """Normal equations of one recording at a point, in units of the coefficients' moves."""

    def __init__(self, layout: Layout, families: list[Family], units: Array, n_theta: int):
        self.layout, self.units = layout, units
        near, far = layout.near_at, layout.far_at
        stride, n = layout.stride, near.size
        width = max(f.near.shape[2] for f in families)
        q = far.size + n_theta
        cells = n // stride - width // stride + 1
        square = np.zeros((cells, width, width))
        border = np.zeros((cells, width, q + 1))
        self.corner = np.zeros((q + 1, q + 1))  # the last column is the residual
        for family in families:
            right = np.concatenate([family.far, family.residual[..., None]], axis=2)
            rest = right.reshape(-1, q + 1)
            self.corner += rest.T @ rest
            # times increase within a family, so that a cell's rows follow each other
            present, starts = np.unique(family.first, return_index=True)
            for cell, start, stop in zip(present, starts, [*starts[1:], family.first.size],
                                         strict=True):
                local = family.near[start:stop].reshape(-1, width)
                square[cell] += local.T @ local
                border[cell] += local.T @ right[start:stop].reshape(-1, q + 1)
        self.band = np.zeros((width, n))
        for a in range(width):
            for b in range(a + 1):
                self.band[a - b, b:b + stride * cells:stride] += square[:, a, b]
        self.border = np.zeros((n, q + 1))
        for a in range(width):
            self.border[a:a + stride * cells:stride] += border[:, a]
        self._scale(q)

    def _scale(self, q: int) -> None:
        near, far = self.units[self.layout.near_at], self.units[self.layout.far_at]
        for d in range(self.band.shape[0]):
            count = near.size - d
            self.band[d, :count] *= near[:count] * near[d:]
        full = np.ones(q + 1)
        full[:far.size] = far
        self.border *= near[:, None] * full
        self.corner *= full[:, None] * full

    def solve(self, damping: float) -> Solved:
        """Eliminate the coefficients.

        Raises:
            LinAlgError: If the damping does not make the matrix positive definite.
        """
        q = self.layout.far_at.size
        moves = self.inverse(damping, self.border[:, q:], self.corner[:q, q:])
        scaled = moves / self.units[:, None]
        near, far = scaled[self.layout.near_at], scaled[self.layout.far_at]
        rest = self.corner[q:-1, q:] - self.border[:, q:-1].T @ near - self.corner[q:-1, :q] @ far
        return Solved(rest[:, :-1], rest[:, -1], moves[:, :-1], moves[:, -1])

    def inverse(self, damping: float, near: Array, far: Array) -> Array:
        """(JᵀJ + damping)⁻¹ of the coefficients on columns in their units, in natural order.

        Raises:
            LinAlgError: If the damping does not make the matrix positive definite.
        """
        q = self.layout.far_at.size
        band = self.band.copy()
        band[0] += damping
        solved = solve_band(factor_band(band), np.column_stack([self.border[:, :q], near]))
        middle = self.corner[:q, :q] - self.border[:, :q].T @ solved[:, :q]
        middle[np.diag_indices(q)] += damping
        beyond = cho_solve(cho_factor(middle, lower=True, check_finite=False),
                           far - self.border[:, :q].T @ solved[:, q:], check_finite=False)
        moves = np.empty((self.units.size, far.shape[1]))
        moves[self.layout.near_at] = solved[:, q:] - solved[:, :q] @ beyond
        moves[self.layout.far_at] = beyond
        return moves * self.units[:, None]

    def promise(self, move: Array, by_theta: Array) -> float:
        """Fall of ‖r‖² that the undamped quadratic model sees in a step (n,), θ's part (b,)."""
        scaled = move / self.units
        near = scaled[self.layout.near_at]
        rest = np.concatenate([scaled[self.layout.far_at], by_theta])
        bent = multiply(self.band, near[:, None])[:, 0] + 2.0 * self.border[:, :-1] @ rest
        straight = near @ self.border[:, -1] + rest @ self.corner[:-1, -1]
        return -float(2.0 * straight + near @ bent + rest @ self.corner[:-1, :-1] @ rest)


class BorderedSystem:
    """A functional of networks, ready for Levenberg-Marquardt."""

    def __init__(self, functional: Functional, units: tuple[Array, ...]):
        self.functional, self.units = functional, units
        count = range(len(functional.parts))
        self.columns = [functional.problem.columns(r)[1] for r in count]
        self.families = [functional.families(r) for r in count]
        self.layouts = [Layout(part) for part in functional.parts]

    def normal(self, at: Evaluation) -> list[Bordered]:
        """Normal equations at a point."""
        return [
            Bordered(layout, self.jacobian(r, at), units, self.columns[r].size)
            for r, (layout, units) in enumerate(zip(self.layouts, self.units, strict=True))]

    def jacobian(self, r: int, at: Evaluation) -> list[Family]:
        """Jacobians of all families of a recording."""
        return [self.layouts[r].family(sites, rows, at.point.coefficients[r], self.columns[r].size)
                for sites, rows in zip(self.families[r], at.rows[r], strict=True)]

    def step(self, at: Evaluation, normal: list[Bordered], damping: float, lower: Array,
             upper: Array) -> tuple[Point, float]:
        """Minimise the damped Gauss-Newton model with θ inside its bounds: step and promise.

        Raises:
            LinAlgError: If the damping is too small.
        """
        theta = at.point.theta
        schur, slope = np.zeros((theta.size, theta.size)), np.zeros(theta.size)
        solved = [one.solve(damping) for one in normal]
        for columns, one in zip(self.columns, solved, strict=True):
            schur[np.ix_(columns, columns)] += one.schur
            slope[columns] += one.slope
        schur = 0.5 * (schur + schur.T)
        change = box_minimum(schur, slope, lower - theta, upper - theta)
        moves = tuple(-(one.outer + one.inner @ change[columns])
                      for columns, one in zip(self.columns, solved, strict=True))
        promised = sum(one.promise(move, change[columns]) for columns, one, move in zip(
            self.columns, normal, moves, strict=True))
        return Point(moves, change), promised
