"""Normal equations of Eq. (2) for local bases: banded in the coefficients, bordered by θ.

A residual at time t touches only the degree + 1 coefficients that live there, so JᵀJ is a band with
a border of a few columns, and everything below costs O(N) time and memory.  Rows between the same
two knots share their columns: a stretch of them is summed up before it goes to its place.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from pikanid.approximators import Array
from pikanid.functional import Part, Rows, Sites

Ints = NDArray[np.int64]


# Rows multiplied out at once: bounds the memory of the products without slowing them down.
ROWS_AT_ONCE = 32_768


@dataclass(frozen=True, eq=False)
class Stretches:
    """The rows of one family, grouped by the coefficients that they touch."""

    starts: Ints  # (G + 1,): first row of each group
    columns: Ints  # (G, w): the coefficients, in band order

    def pieces(self) -> Iterator[tuple[Ints, Ints]]:
        """Consecutive groups of some `ROWS_AT_ONCE` rows: their starts and columns."""
        cuts = np.searchsorted(self.starts, np.arange(0, self.starts[-1], ROWS_AT_ONCE))
        for first, last in pairwise([*np.unique(cuts).tolist(), self.starts.size - 1]):
            yield self.starts[first:last + 1], self.columns[first:last]


@dataclass(frozen=True, eq=False)
class Windows:
    """Where the tables of a family stand among the w coefficients that a row touches."""

    states: tuple[slice, ...]
    tops: tuple[slice, ...]
    width: int
    firsts: tuple[Ints, ...]  # first coefficient (M,) of each chain


@dataclass(frozen=True, eq=False)
class BandedNormal:
    """JᵀJ and Jᵀr of one recording, the residual r as one more column beside ∂r/∂θ.

    Lower band (kd + 1, n), right-hand columns [border | Jᵀr] (n, b + 1), and the corner
    (b + 1, b + 1), whose last entry is ‖r‖².
    """

    band: Array
    right: Array
    corner: Array
    costs: tuple[float, ...]  # ‖r‖² of each family


class BandedAssembler:
    """Knows the sparsity of one recording's Jacobian; multiplies it out at every iterate.

    `order[k]` is the natural index of the k-th coefficient in band order: those held by the initial
    state first, then all chains interleaved along time.
    """

    def __init__(self, part: Part, families: list[Sites], b: int):
        self.n, self.b = part.n_coefficients, b
        self.order = _interleave(part, self.n)
        position = np.empty(self.n, dtype=np.int64)
        position[self.order] = np.arange(self.n)
        self.windows = [_windows(sites) for sites in families]
        self.stretches = [_stretches(windows, position) for windows in self.windows]
        self.bandwidth = max(int(np.ptp(own.columns, axis=1).max()) for own in self.stretches)
        self.pieces = [list(own.pieces()) for own in self.stretches]

    def normal(self, families: list[Sites], rows: list[Rows]) -> BandedNormal:
        """Assemble JᵀJ and Jᵀr from the residual families."""
        from pikanid.optimise.banded_products import add_products

        b, kd = self.b, self.bandwidth
        whole, corner = np.zeros((self.n, kd + b + 2)), np.zeros((b + 1, b + 1))
        costs, before = [], 0.0
        for pieces, windows, sites, row in zip(
                self.pieces, self.windows, families, rows, strict=True):
            for starts, columns in pieces:
                stacked = _stack(windows, sites, row, slice(int(starts[0]), int(starts[-1])), b)
                add_products(stacked, starts, columns, kd, whole, corner)
            cost = float(corner[b, b])
            costs.append(cost - before)
            before = cost
        return BandedNormal(whole[:, :kd + 1].T, whole[:, kd + 1:], corner, tuple(costs))


def _stack(windows: Windows, sites: Sites, rows: Rows, part: slice, b: int) -> Array:
    """[∂r/∂local coefficients, ∂r/∂θ, r] (m, E, w + b + 1) of some rows of a family."""
    from pikanid.optimise.banded_products import spread, spread_top

    residual, w = rows.residual[part], windows.width
    stacked = np.zeros((*residual.shape, w + b + 1))
    if rows.by_state is not None:
        for s, (table, at) in enumerate(zip(sites.states, windows.states, strict=True)):
            spread(table.window[1], rows.by_state, s, part.start, at.start, stacked)
    if rows.by_top is not None:
        for e, (table, at) in enumerate(zip(sites.tops, windows.tops, strict=True)):
            spread_top(table.window[1], rows.by_top, e, part.start, at.start, stacked)
    if rows.by_theta is not None:
        stacked[:, :, w:w + b] = rows.by_theta[part]
    stacked[:, :, -1] = residual
    return stacked


def _windows(sites: Sites) -> Windows:
    """The chains' windows side by side; all tables of a chain share one."""
    places: dict[int, slice] = {}
    firsts, width = [], 0
    for table in (*sites.states, *sites.tops):
        if table.part.start not in places:
            first, values = table.window
            places[table.part.start] = slice(width, width + values.shape[1])
            firsts.append(first)
            width += values.shape[1]
    return Windows(tuple(places[table.part.start] for table in sites.states),
                   tuple(places[table.part.start] for table in sites.tops), width, tuple(firsts))


def _stretches(windows: Windows, position: Ints) -> Stretches:
    """Where the coefficients that rows touch change, and their places in band order."""
    firsts = np.column_stack(windows.firsts)
    changes = np.flatnonzero(np.any(np.diff(firsts, axis=0) != 0, axis=1)) + 1
    starts = np.concatenate([[0], changes, [firsts.shape[0]]]).astype(np.int64)
    sizes = {at.start: at.stop - at.start for at in (*windows.states, *windows.tops)}
    columns = [firsts[starts[:-1], i][:, None] + np.arange(size)
               for i, size in enumerate(sizes.values())]
    return Stretches(starts, position[np.concatenate(columns, axis=1)])


def _interleave(part: Part, n: int) -> Ints:
    """Order of the coefficients: held ones first, then by their relative place in each chain."""
    key = np.zeros(n)
    key[part.held] = -1.0
    for table in part.physics.tops:
        free = table.part.start + np.flatnonzero(key[table.part] == 0.0)
        key[free] = (np.arange(free.size) + 0.5) / free.size
    return np.argsort(key, kind="stable").astype(np.int64)
