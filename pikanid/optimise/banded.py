"""Normal equations of Eq. (2) for local bases: banded in the coefficients, bordered by θ.

A residual at time t touches only the degree + 1 coefficients that live there, so JᵀJ is a band with
a border of a few columns, and everything below costs O(N) time and memory.  Rows between the same
two knots share their columns: a stretch of them is summed up before it goes to its place.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pikanid.approximators import Array
from pikanid.objective.functional import Functional, Part, Rows, Sites

if TYPE_CHECKING:
    from pikanid.simulation.native_field import NativeField

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

    def __init__(self, functional: Functional, r: int, b: int):
        from pikanid.optimise import banded_families, banded_products

        # imported once: an iterate takes little longer than that
        self.compiled, self.evaluating = banded_products, banded_families
        part, families = functional.parts[r], functional.families(r)
        self.r, self.families = r, families
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
        self.constant = np.zeros((self.n, self.bandwidth + b + 2))
        for k, sites in enumerate(families):
            if sites.shown is not None and sites.target is not None:
                rows = sites.measured(np.repeat(sites.target, len(sites.states), axis=0))
                assert rows is not None
                self._add_products(k, rows, self.constant, np.zeros((b + 1, b + 1)))

    def products(self, functional: Functional, c: Array, theta: Array, lam: float) -> Products:
        """Multiply out all residual families at coefficients c (n,), θ and λ.

        `functional` has the sites of the one that the sparsity was read from.
        """
        b, groups = self.b, len(self.families) - self.data + 1
        whole = np.zeros((groups, *self.constant.shape))
        whole[0] = self.constant
        corner = np.zeros((groups, b + 1, b + 1))
        p, costs = functional.problem.parameters(theta, self.r), []
        for k, sites in enumerate(functional.families(self.r)):
            if self.shown[k] is not None:
                cost = self._add_samples(k, sites, c, whole[0, :, -1])
                corner[0, b, b] += cost
            else:
                group = max(k - self.data + 1, 0)
                native = sites.lines.native if sites.lines and k == self.data else None
                if native is not None and functional.penalty == "physics":
                    cost = self._add_equations(k, sites, native, c, p,
                                               functional.physics_factor(lam), whole[group],
                                               corner[group])
                else:
                    with np.errstate(all="ignore"):  # a wild iterate is told from its cost
                        row = functional.family(self.r, k, c, p, lam)
                    cost = self._add_products(k, row, whole[group], corner[group])
            costs.append(cost)
        return Products(whole, corner, tuple(costs), lam)

    def _add_samples(self, k: int, sites: Sites, c: Array, slope: Array) -> float:
        """Add Jᵀr of family k, samples of a state; its ‖r‖²."""
        state, own = self.shown[k], self.stretches[k]
        assert state is not None and sites.target is not None
        first, basis = sites.states[state].window
        return self.evaluating.add_samples(
            sites.weight, sites.target, first, basis, c, self.windows[k].at[state], own.starts,
            own.columns, slope)

    def _add_equations(self, k: int, sites: Sites, native: NativeField, c: Array, p: Array,
                       factor: Array, whole: Array, corner: Array) -> float:
        """Add the products of family k, a smooth model's equations, without rows; its ‖r‖²."""
        own, bases = self.stretches[k], sites.bases
        assert bases is not None
        # registers of its own for every call: threads may share the field
        return self.evaluating.add_equations(
            native.code, native.at, native.r.copy(), native.d.copy(), sites.t, sites.u, p, c,
            bases.first, bases.local, bases.offset, bases.width, sites.weight, factor,
            self.windows[k].at, own.starts, own.columns, whole, corner)

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
