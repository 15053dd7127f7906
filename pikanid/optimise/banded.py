"""Normal equations of Eq. (2) for local bases: banded in the coefficients, bordered by θ.

A residual at time t touches only the degree + 1 coefficients that live there, so JᵀJ is a band with
a border of a few columns, and everything below costs O(N) time and memory.  Rows between the same
two knots share their columns; they are multiplied out together, one small dense product a stretch.
"""

from __future__ import annotations

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
    """Some consecutive rows of one family, grouped by the coefficients they touch."""

    rows: slice  # which times of the family
    by_length: tuple[tuple[Ints | None, Ints], ...]  # (times (g, L) or None = all, groups (g,))
    part: slice  # coefficients touched, in band order
    places: NDArray[np.int32]  # (G, pairs): where products go in the flattened (span, kd + b + 2)


@dataclass(frozen=True, eq=False)
class Windows:
    """Where the tables of a family stand among the w coefficients that a row touches."""

    states: tuple[slice, ...]
    tops: tuple[slice, ...]
    width: int
    firsts: tuple[Ints, ...]  # first coefficient (M,) of each chain

    def pairs(self, b: int) -> tuple[Ints, Ints]:
        """Which of the products of w + b + 1 columns are kept: those of w with w, of w with b + 1.

        Of the symmetric ones the lower half.
        """
        one, other = np.tril_indices(self.width)
        local, beside = np.divmod(np.arange(self.width * (b + 1)), b + 1)
        return np.append(one, local), np.append(other, self.width + beside)


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
        self.pairs = [windows.pairs(b) for windows in self.windows]
        groups = [_columns(windows, position) for windows in self.windows]
        self.bandwidth = max(
            int((columns.max(axis=1) - columns.min(axis=1)).max()) for _, columns in groups)
        self.stretches = [self._stretches(windows.width, starts, columns)
                          for windows, (starts, columns) in zip(self.windows, groups, strict=True)]

    def _stretches(self, w: int, starts: Ints, columns: Ints) -> list[Stretches]:
        """Cut a family into pieces of some `ROWS_AT_ONCE` rows, at changes of the coefficients."""
        cuts = np.searchsorted(starts, np.arange(0, starts[-1], ROWS_AT_ONCE))
        cuts = np.unique(np.append(cuts, starts.size - 1))
        a, b = np.tril_indices(w)
        beside = self.bandwidth + 1 + np.arange(self.b + 1)
        stride = beside[-1] + 1
        out = []
        for first, last in pairwise(cuts):
            base, end = int(columns[first:last].min()), int(columns[first:last].max()) + 1
            own = columns[first:last] - base
            one, other = own[:, a], own[:, b]
            band = np.minimum(one, other) * stride + np.abs(one - other)
            right = (own[:, :, None] * stride + beside).reshape(len(own), -1)
            out.append(Stretches(slice(int(starts[first]), int(starts[last])),
                                 _by_length(starts[first:last + 1] - starts[first]),
                                 slice(base, end),
                                 np.hstack([band, right]).astype(np.int32)))
        return out

    def normal(self, families: list[Sites], rows: list[Rows]) -> BandedNormal:
        """Assemble JᵀJ and Jᵀr from the residual families."""
        b, kd = self.b, self.bandwidth
        whole, corner = np.zeros((self.n, kd + b + 2)), np.zeros((b + 1, b + 1))
        costs = []
        for pieces, windows, pairs, sites, row in zip(
                self.stretches, self.windows, self.pairs, families, rows, strict=True):
            cost = 0.0
            for piece in pieces:
                gram = _gram(piece, _stack(windows, sites, row, piece.rows, b))
                into = whole[piece.part]
                into += np.bincount(piece.places.ravel(), gram[:, *pairs].ravel(),
                                    into.size).reshape(into.shape)
                total = gram[:, windows.width:, windows.width:].sum(axis=0)
                corner += total
                cost += float(total[b, b])
            costs.append(cost)
        return BandedNormal(whole[:, :kd + 1].T, whole[:, kd + 1:], corner, tuple(costs))


def _stack(windows: Windows, sites: Sites, rows: Rows, part: slice, b: int) -> Array:
    """[∂r/∂local coefficients, ∂r/∂θ, r] (M + 1, E, w + b + 1) of some rows of a family.

    The last row is zero: it fills up the stretches that are shorter than others.
    """
    residual, w = rows.residual[part], windows.width
    stacked = np.zeros((residual.shape[0] + 1, residual.shape[1], w + b + 1))
    out = stacked[:-1]
    if rows.by_state is not None:
        for s, (table, at) in enumerate(zip(sites.states, windows.states, strict=True)):
            out[:, :, at] += rows.by_state[part, :, s, None] * table.window[1][part, None, :]
    if rows.by_top is not None:
        for e, (table, at) in enumerate(zip(sites.tops, windows.tops, strict=True)):
            out[:, e, at] += rows.by_top[part, e, None] * table.window[1][part]
    if rows.by_theta is not None:
        out[:, :, w:w + b] = rows.by_theta[part]
    out[:, :, -1] = residual
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


def _by_length(begins: Ints) -> tuple[tuple[Ints | None, Ints], ...]:
    """Stretches (G,) of like length together, each with the times of its rows.

    Like means that the longest is at most half as long again: the others repeat the time that
    stands for a row of zeros.
    """
    lengths = np.diff(begins)
    if np.all(lengths == lengths[0]):
        return ((None, np.arange(lengths.size)),)
    found: list[tuple[Ints | None, Ints]] = []
    left = lengths.copy()
    while longest := int(left.max()):
        which = np.flatnonzero(3 * left >= 2 * longest)
        step = np.arange(longest)
        inside = step < lengths[which, None]
        found.append((np.where(inside, begins[which, None] + step, begins[-1]), which))
        left[which] = 0
    return tuple(found)


def _columns(windows: Windows, position: Ints) -> tuple[Ints, Ints]:
    """Starts of the stretches (G + 1,) and the coefficients each touches (G, w), in band order."""
    firsts = np.column_stack(windows.firsts)
    changes = np.flatnonzero(np.any(np.diff(firsts, axis=0) != 0, axis=1)) + 1
    starts = np.concatenate([[0], changes, [firsts.shape[0]]]).astype(np.int64)
    sizes = {at.start: at.stop - at.start for at in (*windows.states, *windows.tops)}
    columns = [firsts[starts[:-1], i][:, None] + np.arange(size)
               for i, size in enumerate(sizes.values())]
    return starts, position[np.concatenate(columns, axis=1)]


def _interleave(part: Part, n: int) -> Ints:
    """Order of the coefficients: held ones first, then by their relative place in each chain."""
    key = np.zeros(n)
    key[part.held] = -1.0
    for table in part.physics.tops:
        free = table.part.start + np.flatnonzero(key[table.part] == 0.0)
        key[free] = (np.arange(free.size) + 0.5) / free.size
    return np.argsort(key, kind="stable").astype(np.int64)


def _gram(stretches: Stretches, stacked: Array) -> Array:
    """Products VᵀV (G, W, W) of every stretch of stacked rows V (M + 1, E, W)."""
    width = stacked.shape[2]
    out = np.empty((len(stretches.places), width, width))
    for times, groups in stretches.by_length:
        rows = stacked[:-1] if times is None else np.take(stacked, times, axis=0)
        v = rows.reshape(groups.size, -1, width)
        out[groups] = np.matmul(v.transpose(0, 2, 1), v)
    return out
