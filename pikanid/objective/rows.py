"""The parts of Eq. (2): where residuals are taken, and what they are at an iterate."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from pikanid.approximators import Approximator, Array, LinearApproximator
from pikanid.approximators.tables import Bases, Shown, Table, side_by_side
from pikanid.simulation.vectorfield import Linearised

AnyApproximator = Approximator | LinearApproximator
ONE = np.ones(1)  # definition: the number one as an array


@dataclass(frozen=True, eq=False)
class Sites:
    """Where one family of residuals is taken: M times, E residuals each."""

    t: Array  # (M,)
    u: Array  # (M, m)
    weight: Array  # (M, E): square root of the quadrature weight, or 1/σ
    states: tuple[Table, ...]  # one per state
    tops: tuple[Table, ...] = ()  # highest derivative of each approximator: E of them
    target: Array | None = None  # (1, M): the samples
    output: int = 0  # which output they are samples of
    deviation: Array | None = None  # (M,): of the weighted samples, where σ is known
    lines: Linearised | None = None  # the model's formulas at the sites
    bases: Bases | None = None  # of states and tops together, where they are linear

    @staticmethod
    def of(t: Array, u: Array, weight: Array, states: Sequence[Shown], tops: Sequence[Shown] = (),
           target: Array | None = None, output: int = 0, deviation: Array | None = None,
           lines: Linearised | None = None) -> Sites:
        """Sites whose tables share their memory."""
        tables, bases = Bases.of((*states, *tops), t)
        n = len(states)
        return Sites(t, u, weight, tables[:n], tables[n:], target, output, deviation, lines, bases)

    def with_states(self, states: Sequence[Shown]) -> Sites:
        """The same sites with other tables of the states, of data."""
        return Sites.of(self.t, self.u, self.weight, states, (), self.target, self.output,
                        self.deviation, self.lines)

    def differentiated(self, extra: int) -> Sites:
        """The same sites, the tops `extra` derivatives higher."""
        states = [table.shown for table in self.states]
        tops = [table.shown._replace(derivative=table.derivative + extra) for table in self.tops]
        return Sites.of(self.t, self.u, self.weight, states, tops, self.target, self.output,
                        self.deviation, self.lines)

    @functools.cached_property
    def shown(self) -> int | None:
        """The state that the samples show as it is; None of formulas, or without samples."""
        return None if self.lines is None or self.target is None else self.lines.state

    def measured(self, values: Array) -> Rows | None:
        """The rows of samples of a state as it is, from all states (n, M); None of formulas."""
        if self.shown is None or self.target is None:
            return None
        return self._samples(values[self.shown].reshape(-1, 1), self.target)

    def measured_at(self, c: Array) -> Rows | None:
        """The same for a recording's coefficients: no other state is evaluated."""
        if self.shown is None or self.target is None:
            return None
        return self._samples(side_by_side([self.states[self.shown]], c), self.target)

    def _samples(self, value: Array, target: Array) -> Rows:
        return Rows(self.weight, ONE, value, target, self._state_slopes, None)

    @functools.cached_property
    def _state_slopes(self) -> Array:
        """Of a state by all of them (M, 1, n)."""
        slopes = np.zeros((self.t.size, 1, len(self.states)))
        slopes[:, :, self.shown] = 1.0
        return slopes

    def values(self, c: Array) -> Array:
        """States, then tops (n + E, M) for a recording's coefficients."""
        if self.bases is None:
            return side_by_side((*self.states, *self.tops), c).T
        return self.bases.values(c)


@dataclass(frozen=True, eq=False)
class Part:
    """One recording's share: its approximators (one per chain) and residual families."""

    approximators: tuple[AnyApproximator, ...]
    data: tuple[Sites, ...]
    physics: Sites
    start: Sites | None  # heavy rows for the initial state, where it cannot be eliminated
    held: NDArray[np.int64]  # coefficients fixed by the initial state
    hold: Array  # (k, n): c[held] = hold @ x0

    @property
    def n_coefficients(self) -> int:
        """Number of coefficients of the recording's approximators together."""
        return int(self.physics.tops[-1].part.stop)


@dataclass(frozen=True, eq=False)
class Rows:
    """Residuals of a family, factor·weight·(value - target), and what their derivatives consist of.

    Kept in these pieces, so that another λ changes nothing but `factor`; None means zero.
    """

    weight: Array  # (M, E)
    factor: Array  # (E,)
    value: Array  # (M, E)
    target: Array  # (E, M): the samples, or the tops
    state_slopes: Array | None  # (M, E, n): of `value`
    theta_slopes: Array | None  # (M, E, b): of `value`, columns `problem.columns(r)`
    topped: bool = False  # target e is the top of approximator e

    @functools.cached_property
    def _scale(self) -> Array:
        return self.factor * self.weight

    @functools.cached_property
    def residual(self) -> Array:
        """Weighted residuals (M, E)."""
        return self._scale * (self.value - self.target.T)

    @functools.cached_property
    def by_state(self) -> Array | None:
        """Derivative of the residuals by the states (M, E, n)."""
        return None if self.state_slopes is None else self._scale[:, :, None] * self.state_slopes

    @functools.cached_property
    def by_top(self) -> Array | None:
        """Derivative (M, E) of residual e by the top of approximator e; it knows no other."""
        return -self._scale if self.topped else None

    @functools.cached_property
    def by_theta(self) -> Array | None:
        """Derivative of the residuals by θ (M, E, b), columns `problem.columns(r)`."""
        return None if self.theta_slopes is None else self._scale[:, :, None] * self.theta_slopes


def by_coefficients(sites: Sites, rows: Rows, c: Array) -> sparse.csr_array:
    """Jacobian (M·E, n) of a family by a recording's coefficients, rows as `residual.ravel()`."""
    count, width = rows.residual.shape
    total = sparse.csr_array((count * width, c.size))
    for e in range(width):
        # Row m·E + e of the stack, as a matrix that spreads a family's M rows into it.
        spread = sparse.csr_array(
            (np.ones(count), (np.arange(count) * width + e, np.arange(count))),
            shape=(count * width, count))
        pieces = []
        if rows.by_state is not None:
            pieces += [(rows.by_state[:, e, s], table) for s, table in enumerate(sites.states)]
        if rows.by_top is not None:
            pieces.append((rows.by_top[:, e], sites.tops[e]))
        for weight, table in pieces:
            scaled = sparse.csr_array(table.jacobian(c)).multiply(weight[:, None]).tocsr()
            placed = sparse.csr_array(
                (scaled.data, scaled.indices + table.part.start, scaled.indptr),
                shape=(count, c.size))
            total = total + spread @ placed
    return total
