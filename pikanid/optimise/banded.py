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
    columns: Ints  # (G, w): coefficients in band order, less `base`
    base: int
    span: int  # coefficients touched: base ... base + span - 1
    lower: tuple[Ints, Ints]  # pairs a >= b of the w local columns
    band: Ints  # (G, w(w+1)/2): where their products go in the flattened band (span, kd + 1)


@dataclass(frozen=True, eq=False)
class BandedNormal:
    """JᵀJ and Jᵀr of one recording: lower band (kd + 1, n), border (n, b), corner (b, b)."""

    band: Array
    border: Array
    corner: Array
    slope: Array  # (n,) Jᵀr by the coefficients
    slope_theta: Array  # (b,)
    costs: tuple[float, ...]  # ‖r‖² of each family


class BandedAssembler:
    """Knows the sparsity of one recording's Jacobian; multiplies it out at every iterate.

    `order[k]` is the natural index of the k-th coefficient in band order: those held by the initial
    state first, then all chains interleaved along time.
    """

    def __init__(self, part: Part, families: list[Sites]):
        self.n = part.n_coefficients
        self.order = _interleave(part, self.n)
        self.position = np.empty(self.n, dtype=np.int64)
        self.position[self.order] = np.arange(self.n)
        groups = [_columns(sites, self.position) for sites in families]
        self.bandwidth = max(
            int((columns.max(axis=1) - columns.min(axis=1)).max()) for _, columns in groups)
        self.stretches = [self._stretches(starts, columns) for starts, columns in groups]

    def _stretches(self, starts: Ints, columns: Ints) -> list[Stretches]:
        """Cut a family into pieces of some `ROWS_AT_ONCE` rows, at changes of the coefficients."""
        cuts = np.searchsorted(starts, np.arange(0, starts[-1], ROWS_AT_ONCE))
        cuts = np.unique(np.append(cuts, starts.size - 1))
        a, b = np.tril_indices(columns.shape[1])
        out = []
        for first, last in pairwise(cuts):
            own = columns[first:last]
            base = int(own.min())
            own = own - base
            one, other = own[:, a], own[:, b]
            band = np.minimum(one, other) * (self.bandwidth + 1) + np.abs(one - other)
            begins = starts[first:last + 1] - starts[first]
            lengths = np.diff(begins)
            distinct = np.unique(lengths)
            by_length: list[tuple[Ints | None, Ints]] = []
            for length in distinct:
                which = np.flatnonzero(lengths == length)
                times = None if distinct.size == 1 else begins[which][:, None] + np.arange(length)
                by_length.append((times, which))
            out.append(Stretches(slice(int(starts[first]), int(starts[last])), tuple(by_length),
                                 own, base, int(own.max()) + 1, (a, b), band))
        return out

    def normal(self, families: list[Sites], rows: list[Rows], b: int) -> BandedNormal:
        """Assemble JᵀJ and Jᵀr from the residual families (b columns of θ)."""
        n, kd = self.n, self.bandwidth
        band, border, corner = np.zeros((n, kd + 1)), np.zeros((n, b)), np.zeros((b, b))
        slope, slope_theta = np.zeros(n), np.zeros(b)
        costs = []
        for pieces, sites, row in zip(self.stretches, families, rows, strict=True):
            total = np.zeros((b + 1, b + 1))
            for piece in pieces:
                gram = _gram(piece, _stack(sites, row, piece.rows, b))
                w = piece.columns.shape[1]
                part = slice(piece.base, piece.base + piece.span)
                products = gram[:, piece.lower[0], piece.lower[1]].ravel()
                band[part] += np.bincount(
                    piece.band.ravel(), products, piece.span * (kd + 1)).reshape(-1, kd + 1)
                into = piece.columns.ravel()
                slope[part] += np.bincount(into, gram[:, :w, -1].ravel(), piece.span)
                if row.by_theta is not None:
                    for j in range(b):
                        column = gram[:, :w, w + j].ravel()
                        border[part, j] += np.bincount(into, column, piece.span)
                total += gram[:, w:, w:].sum(axis=0)
            corner += total[:b, :b]
            slope_theta += total[:b, b]
            costs.append(float(total[b, b]))
        return BandedNormal(np.ascontiguousarray(band.T), border, corner, slope, slope_theta,
                            tuple(costs))


def _stack(sites: Sites, rows: Rows, part: slice, b: int) -> Array:
    """[∂r/∂local coefficients, ∂r/∂θ, r] (M, E, w + b + 1) of some rows of a family."""
    local = local_jacobian(sites, rows, part)
    residual = rows.residual[part]
    w = local.shape[2]
    stacked = np.zeros((*residual.shape, w + b + 1))
    stacked[..., :w] = local
    if rows.by_theta is not None:
        stacked[..., w:w + b] = rows.by_theta[part]
    stacked[..., -1] = residual
    return stacked


def local_jacobian(sites: Sites, rows: Rows, part: slice) -> Array:
    """Jacobian by the coefficients that a row touches, (M, E, w), of some rows of a family."""
    blocks = _blocks(sites)
    count, width = rows.residual[part].shape
    out = np.zeros((count, width, sum(size for _, size, _ in blocks.values())))
    if rows.by_state is not None:
        for s, table in enumerate(sites.states):
            at, size, _ = blocks[table.part.start]
            by_state = rows.by_state[part, :, s, None]
            out[:, :, at:at + size] += by_state * table.window[1][part, None, :]
    if rows.by_top is not None:
        for e, table in enumerate(sites.tops):
            at, size, _ = blocks[table.part.start]
            out[:, e, at:at + size] += rows.by_top[part, e, None] * table.window[1][part]
    return out


def _blocks(sites: Sites) -> dict[int, tuple[int, int, Ints]]:
    """Chain (by the start of its coefficients) -> (first local column, width, first columns)."""
    blocks: dict[int, tuple[int, int, Ints]] = {}
    at = 0
    for table in (*sites.states, *sites.tops):
        if table.part.start not in blocks:
            first, values = table.window
            size = values.shape[1]
            blocks[table.part.start] = (at, size, first)
            at += size
    return blocks


def _columns(sites: Sites, position: Ints) -> tuple[Ints, Ints]:
    """Starts of the stretches (G + 1,) and the coefficients each touches (G, w), in band order."""
    blocks = list(_blocks(sites).values())
    firsts = np.column_stack([first for _, _, first in blocks])
    changes = np.flatnonzero(np.any(np.diff(firsts, axis=0) != 0, axis=1)) + 1
    starts = np.concatenate([[0], changes, [firsts.shape[0]]]).astype(np.int64)
    columns = [firsts[starts[:-1], i][:, None] + np.arange(size)
               for i, (_, size, _) in enumerate(blocks)]
    return starts, position[np.concatenate(columns, axis=1)]


def _interleave(part: Part, n: int) -> Ints:
    """Order of the coefficients: held ones first, then by their relative place in each chain."""
    key = np.empty(n)
    for table in part.physics.tops:
        inside = np.arange(table.part.start, table.part.stop)
        free = inside[~np.isin(inside, part.held)]
        key[free] = (np.arange(free.size) + 0.5) / free.size
    key[part.held] = -1.0
    return np.argsort(key, kind="stable").astype(np.int64)


def _gram(stretches: Stretches, stacked: Array) -> Array:
    """Products VᵀV (G, W, W) of every stretch of stacked rows V (M, E, W)."""
    width = stacked.shape[2]
    out = np.empty((stretches.columns.shape[0], width, width))
    for times, groups in stretches.by_length:
        rows = stacked if times is None else stacked[times]
        v = rows.reshape(groups.size, -1, width)
        out[groups] = np.matmul(v.transpose(0, 2, 1), v)
    return out
