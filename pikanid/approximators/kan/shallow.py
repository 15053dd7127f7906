"""The shallow KAN [1, n]: Eq. (4), a spline curve for every output, on the KAN's own knots.

Its values and time derivatives are basis matrices, fixed as long as the knots are.  Where an input
switches, the true curve has a kink in a derivative that no spline on simple knots can follow; the
basis may therefore be joined by kinks of order 2 and 3 at the switches (see `Kink`).  They are kept
beside the pykan model, in plain sight: curve = kan.forward + kinks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy import sparse

from pikanid import errors
from pikanid.approximators import local_matrix
from pikanid.approximators.bspline import BSpline
from pikanid.approximators.kan.bases import Index, power_blossom, silu
from pikanid.approximators.kan.blank import plan_of
from pikanid.approximators.kan.kinks import Kink, KinkTable
from pikanid.approximators.kan.plan import Array, PlannedKan
from pikanid.approximators.kan.refine import change_of_knots, refine
from pikanid.approximators.kan.tensors import read, write

# A kink of the spline's own degree this near to a knot (in spacings) is what the knot does already.
_NEAR_KNOT = 0.05  # numerical: nearer ones do what the knot does already


class ShallowKAN:
    """A [1, n] pykan model seen as a linear approximator.

    The coefficients of one output are (n_basis,): spline coefficients (mask · scale_sp · coef) in
    the order of their knots, a kink's coefficient (jump · spacing^order) between those that its
    time separates, and w_b last where the KAN has a base function.  Kinks vanish outside k cells,
    so that every row of the basis is short; with w_b the rows are full.

    Args:
        kan: A pykan model of width [1, n] (`build_kan`), or one that is made when its coefficients
            are asked for (`planned_kan`).
        kinks: Times of the kinks [s], inside the grid, or ready `Kink`s on the same knots.
        orders: Orders at each time, 1 to k, by default 2 and 3 (2 alone at k = 2); order k next to
            a knot is left out (it is a knot).

    Raises:
        BadSetting: If the model is not shallow, or a kink lies outside its grid.

    >>> from pikanid.approximators.kan import build_kan
    >>> shallow = ShallowKAN(build_kan([1, 1], grid=10, k=5, grid_range=(0, 5)), kinks=[0.2, 0.6])
    >>> shallow.n_basis, shallow.basis(np.array([0.0, 0.3]), derivative=2).shape
    (19, (2, 19))
    """

    def __init__(self, kan: Any, kinks: Sequence[float | Kink] = (),
                 orders: Sequence[int] | None = None) -> None:
        plan = kan.plan if isinstance(kan, PlannedKan) else plan_of(kan)
        if plan.depth != 1 or plan.width[0] != (1, 0) or plan.width[1][1]:
            raise errors.BadSetting(errors.kan_not_shallow([list(layer) for layer in plan.width]))
        if not isinstance(kan, PlannedKan) and float(kan.symbolic_fun[0].mask.abs().sum()) > 0.0:
            raise errors.BadSetting(errors.kan_symbolic(0))
        self._given = kan
        self.degree = plan.k
        self.knots = plan.knots[0][0]
        self.n_outputs = plan.nodes(1)
        self.has_base = plan.base == "silu"
        self._spacing = (self.stop - self.start) / plan.intervals(0)
        orders = range(2, min(3, self.degree) + 1) if orders is None else orders
        held = {(kink.time, kink.order): kink.jump for kink in kinks if isinstance(kink, Kink)}
        self._kinks = self._wanted(kinks, sorted({*orders, *(order for _, order in held)}))
        self._place_kinks()
        self._jumps = np.zeros((len(self._kinks), self.n_outputs))
        for number, place in enumerate(self._kinks):
            self._jumps[number] = held.get(place, 0.0)

    @cached_property
    def kan(self) -> Any:
        """The pykan model."""
        return self._given.make() if isinstance(self._given, PlannedKan) else self._given

    @property
    def start(self) -> float:
        """First time of the grid."""
        return float(self.knots[self.degree])

    @property
    def stop(self) -> float:
        """Last time of the grid."""
        return float(self.knots[-self.degree - 1])

    @property
    def n_splines(self) -> int:
        """Number of B-splines, G + k."""
        return int(self.knots.size - self.degree - 1)

    @property
    def n_basis(self) -> int:
        """Number of basis functions of an output: splines, kinks and w_b."""
        return self.n_splines + len(self._kinks) + self.has_base

    @property
    def n_coefficients(self) -> int:
        """Number of coefficients of an output."""
        return self.n_basis

    @property
    def kinks(self) -> tuple[Kink, ...]:
        """The enrichments with their present jumps."""
        return tuple(Kink(time, order, jump.copy(), self.knots, self.degree) for (time, order),
                     jump in zip(self._kinks, self._jumps, strict=True))

    @property
    def kink_columns(self) -> tuple[int, ...]:
        """Where the coefficients of `kinks`, in that order, stand among the n_basis."""
        return tuple(int(column) for column in self._kink_at)

    def basis(self, t: Array, derivative: int = 0) -> sparse.csr_array:
        """Basis or its time derivative at ``t`` (M,): csr (M, n_basis), consecutive nonzeros.

        Raises:
            BadSetting: If a time leaves the grid.
        """
        first, values = self.local(t, derivative)
        return local_matrix(first, values, self.n_basis)

    def local(self, t: Array, derivative: int = 0) -> tuple[Index, Array]:
        """First basis function of each row of ``basis`` (M,), and the row's values (M, width).

        Raises:
            BadSetting: If a time leaves the grid.
        """
        from pikanid.approximators.local_basis import spread

        t = self._inside(t)
        active, values = self._splines.local(t, derivative)
        first, local = self._row_start[active], np.zeros((t.size, self._row_width))
        spread(active, values, self._spline_at, first, local)
        self._table.join(t, derivative, active, values, self._scale, self._kink_at, first, local)
        if self.has_base:
            local[:, -1] = silu(t, derivative)
        return first, local

    def values(self, t: Array, coefficients: Array, derivative: int = 0) -> Array:
        """The curve for coefficients (n_basis,) or (n_basis, outputs) at ``t`` (M,)."""
        return self.basis(t, derivative) @ coefficients

    def jacobian(self, t: Array, coefficients: Array, derivative: int = 0) -> sparse.csr_array:
        """Derivative of ``values`` by one output's coefficients: the basis."""
        return self.basis(t, derivative)

    @property
    def coefficients(self) -> Array:
        """Coefficients (n_basis, outputs) that the pykan model and the kinks hold now."""
        edges = self.kan.act_fun[0]
        mask = read(edges.mask)[0]
        found = np.empty((self.n_basis, self.n_outputs))
        found[self._spline_at] = (mask * read(edges.scale_sp)[0])[None] * read(edges.coef)[0].T
        found[self._kink_at] = self._jumps * self._scale[:, None]
        if self.has_base:
            found[-1] = mask * read(edges.scale_base)[0]
        return found

    def set_coefficients(self, coefficients: Array) -> None:
        """Put coefficients (n_basis,) or (n_basis, outputs) into the pykan model and the kinks.

        Raises:
            BadSetting: If the shape is another.
        """
        wanted = (self.n_basis, self.n_outputs)
        given = np.asarray(coefficients, float)
        if given.shape == wanted[:1] and self.n_outputs == 1:
            given = given[:, None]
        if given.shape != wanted:
            raise errors.BadSetting(errors.kan_coefficients(given.shape, wanted))
        edges = self.kan.act_fun[0]
        mask = read(edges.mask)[0]
        scale = mask * read(edges.scale_sp)[0]
        self._jumps = given[self._kink_at] / self._scale[:, None]
        splines = given[self._spline_at]
        # A masked edge is zero whatever its coefficients are.
        coef = np.divide(splines, scale, out=np.zeros_like(splines), where=scale != 0.0)
        write(edges.coef, coef.T[None])
        if self.has_base:
            base = np.divide(given[-1], mask, out=np.zeros(self.n_outputs), where=mask != 0.0)
            write(edges.scale_base, base[None])

    def forward(self, t: Array) -> Array:
        """The curve (M, outputs) by pykan's own forward pass, plus the kinks."""
        import torch

        t = self._inside(t)
        with torch.no_grad():
            column = torch.from_numpy(t[:, None].copy()).to(self.kan.act_fun[0].grid.device)
            curve = np.array(self.kan(column).cpu().numpy())
        for kink in self.kinks:
            curve += kink(t)
        return curve

    def refined(self, grid: int) -> ShallowKAN:
        """The same curve on ``grid`` intervals; exact where they are a multiple of the old number.

        A kink of order k that now falls on a knot goes into the spline, which contains it.
        """
        kan = refine(self.kan, grid).kan
        knots, k = plan_of(kan).knots[0][0], self.degree
        finer, _ = change_of_knots(self.knots, knots, k)
        centres = KinkTable((), knots, k).centres
        splines, kept = np.zeros((centres.size, self.n_outputs)), []
        for kink in self.kinks:
            # Old and new kink are one power less splines: these differ near the kink alone.
            new, old = (_beside(kink, *on) for on in ((knots, centres),
                                                      (self.knots, self._table.centres)))
            near = np.abs(centres - kink.time) <= (k + 1) * self._spacing
            splines += np.where(near, new - finer @ old, 0.0)[:, None] * kink.jump
            if kink.order < k or np.abs(knots - kink.time).min() >= 1e-9 * self._spacing:
                kept.append(replace(kink, knots=knots))
        other = ShallowKAN(kan, kept)
        found = other.coefficients
        found[other._spline_at] += splines
        other.set_coefficients(found)
        return other

    def _inside(self, t: Array) -> Array:
        t = np.asarray(t, dtype=float)
        slack = 1e-9 * (self.stop - self.start)
        if t.size and (t.min() < self.start - slack or t.max() > self.stop + slack):
            raise errors.BadSetting(
                errors.kan_outside(float(t.min()), float(t.max()), self.start, self.stop))
        return np.clip(t, self.start, self.stop)

    def _wanted(self, kinks: Sequence[float | Kink],
                orders: Sequence[int]) -> list[tuple[float, int]]:
        if any(not 1 <= order <= self.degree for order in orders):
            raise errors.BadSetting(
                errors.bad_value("the order of a kink", orders, f"1 to {self.degree}"))
        places: set[tuple[float, int]] = set()
        for kink in kinks:
            if isinstance(kink, Kink):
                if not np.array_equal(kink.knots, self.knots):
                    raise errors.BadSetting(errors.kan_kink_elsewhere(kink.time))
                places.add((kink.time, kink.order))
                continue
            near = np.abs(self.knots - kink).min() <= _NEAR_KNOT * self._spacing
            places.update((float(kink), o) for o in orders if o < self.degree or not near)
        for time, _ in places:
            if not self.start < time < self.stop:
                raise errors.BadSetting(errors.kan_kink(time, self.start, self.stop))
        return sorted(places)

    def _place_kinks(self) -> None:
        n, k = self.n_splines, self.degree
        self._splines = BSpline(k, self.knots)
        self._table = KinkTable(self._kinks, self.knots, k)
        self._scale = self._spacing ** self._table.orders.astype(float)
        before = np.searchsorted(self._table.split, np.arange(n), side="right")
        self._spline_at = np.arange(n) + before
        self._kink_at = self._table.split + np.arange(len(self._kinks))
        starts = self._spline_at[: n - k]
        self._row_width = int((self._spline_at[k:] - starts).max()) + 1
        if self.has_base:
            self._row_width = self.n_basis
        self._row_start = np.minimum(starts, self.n_basis - self._row_width)


def _beside(kink: Kink, knots: Array, centres: Array) -> Array:
    """Coefficients (n,) of the spline that is subtracted from a kink's power, on any knots."""
    power = power_blossom(knots, kink.degree, kink.time, kink.order)
    return np.where(centres >= kink.time, power, 0.0)
