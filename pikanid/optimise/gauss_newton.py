"""Gauss-Newton (Levenberg-damped where needed) on coefficients and parameters together.

Block elimination: with A_r the band of recording r, B_r its border and C the corner of θ,
    (C - Σ B_rᵀ A_r⁻¹ B_r) Δθ = -(g_θ - Σ B_rᵀ A_r⁻¹ g_r),   Δα_r = -A_r⁻¹ (g_r + B_r Δθ),
so that a step costs O(N).  Bounds on θ hold in every step: Δθ minimises the reduced quadratic model
inside the box.

`optimise.levenberg_marquardt` is dense: with 552 unknowns (1049 rows) it would take 25 ms for the
normal equations and 51 ms for a step on one core, with 4004 unknowns 3 s and 28 s; here both
together take 0.23 ms and 1.0 ms.
"""

from __future__ import annotations

import copy
import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import LinAlgError

from pikanid.approximators import Array
from pikanid.objective.functional import Functional, Rows
from pikanid.optimise.banded import BandedAssembler, BandedNormal, Products
from pikanid.optimise.box import box_minimum


@dataclass(frozen=True, eq=False)
class Point:
    """An iterate: coefficients of every recording and θ (b,)."""

    coefficients: tuple[Array, ...]
    theta: Array


class Eliminated(NamedTuple):
    """One recording's normal equations without the held coefficients: they move with θ alone."""

    band: Array  # (kd + 1, n - k)
    right: Array  # (n - k, b + 1): border, and gradient as the last column
    corner: Array  # (b + 1, b + 1)
    held_by_theta: Array | None  # (k, b)

    @property
    def border(self) -> Array:
        """JᵀJ between coefficients and θ (n - k, b)."""
        return self.right[:, :-1]

    @property
    def slope(self) -> Array:
        """Jᵀr by the coefficients (n - k,)."""
        return self.right[:, -1]


@dataclass(frozen=True, eq=False)
class Linearisation:
    """Eq. (2) and its Gauss-Newton model at a point."""

    functional: Functional
    point: Point
    lam: float
    products: tuple[Products, ...]  # per recording
    blocks: tuple[Eliminated, ...]
    data_costs: tuple[tuple[float, ...], ...]  # per recording, per data family
    data_cost: float  # their sum
    physics_cost: float
    cost: float  # ‖r‖², all families together

    @functools.cached_property
    def rows(self) -> tuple[Sequence[Rows], ...]:
        """Per recording, per family: what was summed up, for the few points that need it."""
        return tuple(self.functional.rows(r, c, self.point.theta, self.lam)
                     for r, c in enumerate(self.point.coefficients))


@dataclass(frozen=True, eq=False)
class Step:
    """A proposed change, what the quadratic model promises of it, and the reduced matrix of θ."""

    coefficients: tuple[Array, ...]
    theta: Array
    promised: float
    schur: Array  # (b, b): C - Σ BᵀA⁻¹B; its inverse is the θ block of (JᵀJ)⁻¹
    inner: tuple[Array, ...]  # A_r⁻¹ B_r (n_r - k_r, b_r)


class BandedSystem:
    """A functional with local bases, ready for Gauss-Newton."""

    def __init__(self, functional: Functional):
        from pikanid.optimise import banded_solves, small_matrices

        self.solves, self.small = banded_solves, small_matrices
        self.functional = functional
        self.columns = [functional.problem.columns(r)[1] for r in range(len(functional.parts))]
        self.families = [functional.families(r) for r in range(len(functional.parts))]
        self.assemblers = [
            BandedAssembler(functional, r, columns.size) for r, columns in enumerate(self.columns)]
        self.start_moves = functional.start_moves
        self.counts = [len(part.data) for part in functional.parts]
        self.lower, self.upper = functional.problem.lower, functional.problem.upper
        self.orders = [assembler.order for assembler in self.assemblers]

    def over(self, functional: Functional) -> BandedSystem:
        """Another functional at the same sites, whose sparsity is therefore the same."""
        other = copy.copy(self)
        other.functional = functional
        return other

    def linearise(self, at: Point | Linearisation, lam: float) -> Linearisation:
        """Residuals and normal equations at a point, or at another λ where they are known."""
        point = at if isinstance(at, Point) else at.point
        blocks, data, seen, physics, cost = [], [], 0.0, 0.0, 0.0
        multiplied = []
        for r, (part, c) in enumerate(zip(self.functional.parts, point.coefficients, strict=True)):
            assembler = self.assemblers[r]
            products = (assembler.products(self.functional, c, point.theta, lam)
                        if isinstance(at, Point) else at.products[r])
            normal = assembler.normal(products, lam)
            held = self.functional.hold_jacobian(r, point.theta) if self.start_moves else None
            multiplied.append(products)
            blocks.append(_eliminate(normal, part.held.size, held))
            count = self.counts[r]
            data.append(normal.costs[:count])
            seen += sum(normal.costs[:count])
            physics += normal.costs[count]
            cost += sum(normal.costs)
        return Linearisation(self.functional, point, lam, tuple(multiplied), tuple(blocks),
                             tuple(data), seen, physics, cost)

    def moved(self, point: Point, step: Step) -> Point:
        """The point after a step, held coefficients set from the initial state."""
        theta = point.theta + step.theta
        coefficients = []
        for r, (c, change) in enumerate(zip(point.coefficients, step.coefficients, strict=True)):
            moved = c + change
            if self.start_moves:
                moved = self.functional.complete(r, moved, theta)
            coefficients.append(moved)
        return Point(tuple(coefficients), theta)

    def step(self, at: Linearisation, lower: Array, upper: Array, damping: float = 0.0) -> Step:
        """Minimise the (damped) Gauss-Newton model with θ inside [lower, upper].

        Raises:
            LinAlgError: If a band or the reduced matrix is not positive definite.
        """
        theta, b = at.point.theta, at.point.theta.size
        schur, slope, promised = np.zeros((b, b)), np.zeros(b), 0.0
        solutions, inner = [], []
        for columns, block in zip(self.columns, at.blocks, strict=True):
            solved = np.empty(block.right.shape)
            promised += self.solves.reduce_block(
                block.band, damping, block.right, block.corner, columns, solved, schur, slope)
            if math.isnan(promised):
                raise LinAlgError("a recording's band is not positive definite")
            solutions.append(solved)
            inner.append(solved[:, :-1])
        change = np.empty(b)
        gain = self.small.free_minimum(schur, slope, theta, lower, upper, change)
        if math.isnan(gain):  # seldom: a bound is met
            change = box_minimum(schur, slope, lower - theta, upper - theta)
            gain = self.small.fall(schur, slope, change)
        promised += gain
        moves = []
        for columns, order, solved in zip(self.columns, self.orders, solutions, strict=True):
            # Held coefficients, the first, are set from the initial state afterwards, exactly.
            move = np.zeros(order.size)
            self.solves.follow_theta(solved, change, columns, order, move)
            moves.append(move)
        return Step(tuple(moves), change, promised, schur, tuple(inner))


def _eliminate(normal: BandedNormal, k: int, held_by_theta: Array | None) -> Eliminated:
    """Substitute c[held] = const + Q θ (the first k in band order)."""
    band = normal.band[:, k:]
    if held_by_theta is None or k == 0:
        return Eliminated(band, normal.right[k:], normal.corner, None)
    n, kd = normal.right.shape[0], normal.band.shape[0] - 1
    leading = np.zeros((n, k))
    for j in range(k):
        end = min(n, j + kd + 1)
        leading[j:end, j] = normal.band[:end - j, j]
    leading[:k] = np.tril(leading[:k]) + np.tril(leading[:k], -1).T
    q = np.column_stack([held_by_theta, np.zeros(k)])  # the residual's column is no unknown
    cross = q.T @ normal.right[:k]
    return Eliminated(band, normal.right[k:] + leading[k:] @ q,
                      normal.corner + cross + cross.T + q.T @ leading[:k] @ q, held_by_theta)


MAX_ITERATIONS = 100  # limit: at one λ: of a valley that never ends
# A stop without decrease counts as converged up to this many times one datum's share of the cost.
ROUNDING = 1e-2  # numerical: θ is then within a tenth of a standard error
NOTHING = 1e-16  # numerical: of the samples' sum of squares; a lesser promise is rounding


@dataclass(frozen=True, eq=False)
class Outcome:
    """Where Gauss-Newton stopped."""

    at: Linearisation
    step: Step  # the undamped step that would come next: tiny where converged
    iterations: int
    converged: bool


def gauss_newton(system: BandedSystem, start: Point | Linearisation | Outcome, lam: float,
                 lower: Array, upper: Array, *, iterations: int = 50, tolerance: float = 1e-6,
                 enough: float = 0.0) -> Outcome:
    """Minimise Eq. (2) at one λ from a point, from where the same system was linearised, or on from
    where it ended at the same λ.

    Converged when the promised decrease is below `tolerance` of one datum's share of the cost: the
    estimate is then within √tolerance standard errors of the minimum; or below `enough`.  Damping
    starts at zero and grows only when a step fails.
    """
    begin, known = (start.at, start.step) if isinstance(start, Outcome) else (start, None)
    at = begin if isinstance(begin, Linearisation) and begin.lam == lam else (
        system.linearise(begin, lam))
    share = 1.0 / max(1, system.functional.n_data)
    nothing = max(enough, NOTHING * system.functional.data_square)
    damping, done = 0.0, 0
    step = known or damped_step(system, at, lower, upper, damping)
    while step.promised > max(tolerance * share * at.cost, nothing):
        if done == iterations:
            return Outcome(at, damped_step(system, at, lower, upper, 0.0), done, False)
        for _ in range(20):
            trial = system.linearise(system.moved(at.point, step), lam)
            if math.isfinite(trial.cost) and trial.cost <= at.cost - 1e-4 * step.promised:
                break
            damping = max(1e-4, 8.0 * damping)
            step = damped_step(system, at, lower, upper, damping)
        else:  # no decrease at any damping: rounding, or a kink
            step = damped_step(system, at, lower, upper, 0.0)
            return Outcome(at, step, done, step.promised <= ROUNDING * share * at.cost)
        at, done = trial, done + 1
        damping = 0.0 if damping < 1e-6 else 0.1 * damping
        step = damped_step(system, at, lower, upper, damping)
    if damping > 0.0:
        step = damped_step(system, at, lower, upper, 0.0)
    return Outcome(at, step, done, True)


def damped_step(system: BandedSystem, at: Linearisation, lower: Array, upper: Array,
                damping: float) -> Step:
    """The step at a damping, or at the least one that makes the matrices positive definite."""
    while True:
        try:
            return system.step(at, lower, upper, damping)
        except LinAlgError:
            damping = max(1e-8, 10.0 * damping)
            if damping > 1e6:
                raise
