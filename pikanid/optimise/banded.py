"""Normal equations of Eq. (2) for local bases: banded in the coefficients, bordered by θ.

A residual at time t touches only the degree + 1 coefficients that live there, so JᵀJ is a band with
a border of a few columns, and everything below costs O(N) time and memory.  Rows between the same
two knots share their columns: a stretch of them is summed up before it goes to its place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pikanid.approximators import Array
from pikanid.objective.functional import Part, Rows, Sites

Ints = NDArray[np.int64]

# Slopes that are zero, in the form that the compiled sums take.
NO_SLOPES = np.zeros((0, 0, 0))  # definition: an empty array


@dataclass(frozen=True, eq=False)
class Stretches:
    """The rows of one family, grouped by the coefficients that they touch."""

    starts: Ints  # (G + 1,): first row of each group
    columns: Ints  # (G, w): the coefficients, in band order


@dataclass(frozen=True, eq=False)
class Windows:
    """Where the tables of a family stand among the w coefficients that a row touches."""

    at: Ints  # first place of each table, states before tops
    firsts: tuple[Ints, ...]  # first coefficient (M,) of each chain
    sizes: tuple[int, ...]  # so many of each chain: w altogether


class BandedNormal(NamedTuple):
    """JᵀJ and Jᵀr of one recording, the residual r as one more column beside ∂r/∂θ.

    Lower band (kd + 1, n), right-hand columns [border | Jᵀr] (n, b + 1), and the corner
    (b + 1, b + 1), whose last entry is ‖r‖².
    """

    band: Array
    right: Array
    corner: Array
    costs: tuple[float, ...]  # ‖r‖² of each family


class Products(NamedTuple):
    """Sums of products of one recording: of the data, of the physics, and of what holds its start.

    Each as in `BandedNormal`, band and right-hand columns side by side: whole (G, n, kd + b + 2)
    and corner (G, b + 1, b + 1), G = 2 where nothing need hold the start.
    """

    whole: Array
    corner: Array
    costs: tuple[float, ...]  # ‖r‖² of each family
    lam: float  # at which those of the physics were taken


class BandedAssembler:
    """Knows the sparsity of one recording's Jacobian; multiplies it out at every iterate.

    `order[k]` is the natural index of the k-th coefficient in band order: those held by the initial
    state first, then all chains interleaved along time.
    """

    def __init__(self, part: Part, families: list[Sites], b: int):
        from pikanid.optimise import banded_products

        self.compiled = banded_products  # imported once: an iterate takes little longer than that
        self.n, self.b, self.data = part.n_coefficients, b, len(part.data)
        self.order = _interleave(part, self.n)
        position = np.empty(self.n, dtype=np.int64)
        position[self.order] = np.arange(self.n)
        self.bases = [sites.bases for sites in families if sites.bases is not None]
        self.windows = [_windows(sites) for sites in families]
        self.stretches = [_stretches(windows, position) for windows in self.windows]
        self.bandwidth = max([
            int((own.columns.max(axis=1) - own.columns.min(axis=1)).max())
            for own in self.stretches])
        # what samples of a state add, whatever the iterate, but for their residuals
        self.shown = [sites.shown for sites in families]
        self.bases_of = [None if state is None else sites.states[state].window[1]
                         for sites, state in zip(families, self.shown, strict=True)]
        self.constant = np.zeros((self.n, self.bandwidth + b + 2))
        for k, sites in enumerate(families):
            if sites.shown is not None and sites.target is not None:
                rows = sites.measured(np.repeat(sites.target, len(sites.states), axis=0))
                assert rows is not None
                self._add_products(k, rows, self.constant, np.zeros((b + 1, b + 1)))

    def products(self, rows: Sequence[Rows], lam: float) -> Products:
        """Multiply out all residual families, taken at λ."""
        b, groups = self.b, len(rows) - self.data + 1
        whole = np.zeros((groups, *self.constant.shape))
        whole[0] = self.constant
        corner = np.zeros((groups, b + 1, b + 1))
        costs = []
        for k, row in enumerate(rows):
            state, basis = self.shown[k], self.bases_of[k]
            if state is None or basis is None:
                group = max(k - self.data + 1, 0)
                costs.append(self._add_products(k, row, whole[group], corner[group]))
            else:
                own = self.stretches[k]
                costs.append(self.compiled.add_slope(
                    row.weight, row.value, row.target, basis, self.windows[k].at[state],
                    own.starts, own.columns, whole[0, :, -1]))
                corner[0, b, b] += costs[-1]
        return Products(whole, corner, tuple(costs), lam)

    def _add_products(self, k: int, row: Rows, whole: Array, corner: Array) -> float:
        """Add the products of family k with each other; its ‖r‖²."""
        own, bases = self.stretches[k], self.bases[k]
        return self.compiled.add_products(
            row.weight, row.factor, row.value, row.target, slopes(row.state_slopes),
            slopes(row.theta_slopes), row.topped, bases.local, bases.offset, bases.width,
            self.windows[k].at, own.starts, own.columns, whole, corner)

    def normal(self, products: Products, lam: float) -> BandedNormal:
        """JᵀJ and Jᵀr of all families together, at any λ."""
        ratio, kd = 1.0 if lam == products.lam else lam / products.lam, self.bandwidth
        whole, corner = np.empty(products.whole.shape[1:]), np.empty(products.corner.shape[1:])
        self.compiled.add_up(products.whole, ratio, whole)
        self.compiled.add_up(products.corner, ratio, corner)
        costs = list(products.costs)
        costs[self.data] *= ratio
        return BandedNormal(whole[:, :kd + 1].T, whole[:, kd + 1:], corner, tuple(costs))

    def data_band(self, products: Products) -> Array:
        """The data's share (kd + 1, n) of the band."""
        return products.whole[0, :, :self.bandwidth + 1].T


def slopes(given: Array | None) -> Array:
    """Slopes (M, E, k) as the compiled sums take them: k = 0 where all are zero."""
    return NO_SLOPES if given is None else given


def _windows(sites: Sites) -> Windows:
    """The chains' windows side by side; all tables of a chain share one."""
    places: dict[int, int] = {}
    firsts: list[Ints] = []
    sizes: list[int] = []
    for table in (*sites.states, *sites.tops):
        if table.part.start not in places:
            first, values = table.window
            places[table.part.start] = sum(sizes)
            firsts.append(first)
            sizes.append(values.shape[1])
    return Windows(np.array([places[table.part.start] for table in (*sites.states, *sites.tops)]),
                   tuple(firsts), tuple(sizes))


def _stretches(windows: Windows, position: Ints) -> Stretches:
    """Where the coefficients that rows touch change, and their places in band order."""
    new = np.ones(windows.firsts[0].size + 1, dtype=bool)
    new[1:-1] = False
    for first in windows.firsts:
        new[1:-1] |= first[1:] != first[:-1]
    starts, = new.nonzero()
    columns = [first[starts[:-1]][:, None] + np.arange(size)
               for first, size in zip(windows.firsts, windows.sizes, strict=True)]
    return Stretches(starts, position[np.concatenate(columns, axis=1)])


def _interleave(part: Part, n: int) -> Ints:
    """Order of the coefficients: held ones first, then by their relative place in each chain."""
    key = np.zeros(n)
    key[part.held] = -1.0
    for table in part.physics.tops:
        free = table.part.start + (key[table.part] == 0.0).nonzero()[0]
        key[free] = (np.arange(free.size) + 0.5) / free.size
    return key.argsort(kind="stable")
