"""An approximator at fixed times: evaluated once where it is linear, again and again where not."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg.lapack import dtrtri

from pikanid.approximators import (
    Approximator,
    Array,
    LinearApproximator,
    is_linear,
    local_matrix,
)
from pikanid.approximators.bspline import BSpline

Matrix = Array | sparse.csr_array


class Shown(NamedTuple):
    """What a table is to show: a derivative of the approximator of coefficients `part`."""

    approximator: Approximator | LinearApproximator
    derivative: int
    part: slice


@dataclass(frozen=True, eq=False)
class Table:
    """The `derivative`-th derivative of an approximator at times t (M,).

    Its coefficients are `coefficients[part]` of a recording's coefficient vector (n,).
    """

    approximator: Approximator | LinearApproximator
    t: Array = field(repr=False)
    derivative: int
    part: slice
    first: NDArray[np.int64] | None = field(repr=False, default=None)
    local: Array | None = field(repr=False, default=None)

    @staticmethod
    def of(approximator: Approximator | LinearApproximator, t: Array, derivative: int,
           part: slice) -> Table:
        """Tabulate; a linear approximator is evaluated here once and for all."""
        if not is_linear(approximator):
            return Table(approximator, t, derivative, part)
        first, local = approximator.local(t, derivative)
        return Table(approximator, t, derivative, part, first + part.start, local)

    @property
    def shown(self) -> Shown:
        """What it shows, whatever the times."""
        return Shown(self.approximator, self.derivative, self.part)

    def values(self, coefficients: Array) -> Array:
        """Values (M,) for a recording's coefficients (n,)."""
        return side_by_side([self], coefficients)[:, 0]

    @functools.cached_property
    def basis(self) -> sparse.csr_array:
        """The tabulated basis (M, n_part) of a linear approximator."""
        first, local = self.window
        return local_matrix(first - self.part.start, local, self.part.stop - self.part.start)

    @property
    def window(self) -> tuple[NDArray[np.int64], Array]:
        """First coefficient (M,) and local basis values (M, width) of a linear approximator."""
        assert self.first is not None and self.local is not None
        return self.first, self.local

    def jacobian(self, coefficients: Array) -> Matrix:
        """Derivative of `values` by the approximator's own coefficients (M, n_part)."""
        if self.local is not None:
            return self.basis
        assert isinstance(self.approximator, Approximator)
        return self.approximator.jacobian(self.t, coefficients[self.part], self.derivative)


@dataclass(frozen=True, eq=False)
class Bases:
    """Local bases of T linear tables at the same M times, which one call evaluates together."""

    first: NDArray[np.int64]  # (T, M)
    local: Array = field(repr=False)  # one behind the other: (M, width[k]) from offset[k] on
    offset: NDArray[np.int64]  # (T,)
    width: NDArray[np.int64]  # (T,)

    @staticmethod
    def of(shown: Sequence[Shown], t: Array) -> tuple[tuple[Table, ...], Bases | None]:
        """Tables at times t (M,), their bases in one piece of memory; None if one is not linear."""
        linear = [one.approximator for one in shown if is_linear(one.approximator)]
        if len(linear) < len(shown):
            return tuple(Table.of(one.approximator, t, one.derivative, one.part)
                         for one in shown), None
        times = np.array(t, dtype=float)  # writeable and contiguous
        windows = [_placing(approximator, times, one.derivative)
                   for approximator, one in zip(linear, shown, strict=True)]
        width = [own for own, _ in windows]
        ends = list(itertools.accumulate((t.size * own for own in width), initial=0))
        bases = Bases(np.empty((len(shown), t.size), np.int64), np.empty(ends[-1]),
                      np.array(ends[:-1]), np.array(width))
        tables = []
        for k, (one, (own, place)) in enumerate(zip(shown, windows, strict=True)):
            first, local = bases.first[k], bases.local[ends[k]:ends[k + 1]].reshape(-1, own)
            place(first, local)
            first += one.part.start
            tables.append(Table(one.approximator, t, one.derivative, one.part, first, local))
        return tuple(tables), bases

    def values(self, coefficients: Array) -> Array:
        """Values (T, M) for a recording's coefficients (n,)."""
        from pikanid.approximators.local_basis import weigh_all

        out = np.empty(self.first.shape)
        weigh_all(self.first, self.local, self.offset, self.width, coefficients, out)
        return out


def side_by_side(tables: Sequence[Table], coefficients: Array) -> Array:
    """Values (M, len(tables)) of tables at the same times."""
    from pikanid.approximators.local_basis import weigh

    out = np.empty((tables[0].t.size, len(tables)))
    for k, table in enumerate(tables):
        if table.first is not None and table.local is not None:
            weigh(table.first, table.local, coefficients, out, k)
        else:
            assert isinstance(table.approximator, Approximator)
            own = coefficients[table.part]
            out[:, k] = table.approximator.values(table.t, own, table.derivative)
    return out


def _placing(approximator: LinearApproximator, t: Array, derivative: int
             ) -> tuple[int, Callable[[NDArray[np.int64], Array], None]]:
    """Width of a local basis, and what writes its first functions (M,) and values to a place."""
    if isinstance(approximator, BSpline):  # no values before the place is known
        return approximator.degree + 1, functools.partial(approximator.fill, t, derivative)
    found = approximator.local(t, derivative)

    def place(first: NDArray[np.int64], local: Array) -> None:
        first[:], local[:] = found

    return found[1].shape[1], place


def gauss_nodes(breakpoints: Array, points: int) -> tuple[Array, Array]:
    """Gauss-Legendre nodes and weights in every interval between breakpoints (E + 1,).

    Nodes lie strictly inside, so none straddles or touches a switch that is a breakpoint.

    Returns:
        Times (E·points,) increasing, weights (E·points,) [s].

    >>> times, weights = gauss_nodes(np.array([0.0, 2.0, 3.0]), 2)
    >>> bool(np.isclose((weights * times**3).sum(), 3**4 / 4))
    True
    """
    nodes, weights = _legendre(points)
    half = 0.5 * np.diff(breakpoints)[:, None]
    middle = 0.5 * (breakpoints[1:] + breakpoints[:-1])[:, None]
    return (middle + half * nodes).ravel(), (half * weights).ravel()


@functools.lru_cache
def _legendre(points: int) -> tuple[Array, Array]:
    return np.polynomial.legendre.leggauss(points)


def anchor(approximators: tuple[Approximator | LinearApproximator, ...], lengths: tuple[int, ...],
           start: float) -> tuple[NDArray[np.int64], Array] | None:
    """How clamped splines are held at a given initial state, exactly, by elimination.

    At the first knot the leading m coefficients of a clamped spline alone decide its value and
    m - 1 derivatives, so that c[held] = matrix @ (chain states at the start, chain after chain).

    Returns:
        (held (k,), matrix (k, k)), or None where an approximator is not clamped there.
    """
    held, blocks, offset = [], [], 0
    at = np.array([start])
    for approximator, length in zip(approximators, lengths, strict=True):
        if not is_linear(approximator):
            return None
        rows = []
        for q in range(length):
            first, values = approximator.local(at, q)
            row = values[0].tolist()
            sizes = [abs(value) for value in row]
            if first[0] or max(sizes[q + 1:], default=0.0) > 1e-9 * max(sizes):
                return None
            rows.append(row[:q + 1] + [0.0] * (length - q - 1))
        held.append(offset + np.arange(length))
        blocks.append(dtrtri(np.array(rows), lower=1)[0])
        offset += approximator.n_basis
    size = sum(lengths)
    matrix, at_row = np.zeros((size, size)), 0
    for block in blocks:
        end = at_row + block.shape[0]
        matrix[at_row:end, at_row:end] = block
        at_row = end
    return np.concatenate(held), matrix
