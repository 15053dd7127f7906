"""A deep KAN as a curve over time, with the known kinks of the trajectory beside it.

x̂(t) = KAN(t) + Σ height_j · bump_j(t).  A bump is a kink (see `kinks`) on the first layer's knots,
of jump 1 / (knot spacing)^order.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from pikanid import errors
from pikanid.approximators.kan.build import build_kan
from pikanid.approximators.kan.deep import DeepKAN
from pikanid.approximators.kan.kinks import Kink
from pikanid.approximators.kan.plan import Array
from pikanid.approximators.kan.refine import regrid
from pikanid.approximators.kan.shallow import ShallowKAN
from pikanid.approximators.kan.sweeps import LocalJet

HIGHEST = 2  # limit: time derivative that `DeepKAN` evaluates
_KEPT = 32  # limit: tables of bumps


class KanCurve:
    """A [1, ..., 1] pykan model and bumps as one approximator.

    Coefficients (n_coefficients,): those of the network as in `DeepKAN`, then one a bump.

    Args:
        kan: A pykan model with one input and one output.
        kinks: Times of the kinks [s], inside the first layer's grid, or ready `Kink`s.
        orders: Orders at each time, 1 to k, by default 2 and 3.

    Raises:
        BadSetting: If the model has several inputs or outputs or masked edges, or a kink lies
            outside its grid.

    >>> kan = build_kan([1, 3, 1], grid=[10, 4], k=3, grid_range=[(0, 5), (-1, 1)])
    >>> curve = KanCurve(kan, kinks=[0.2], orders=[2, 3])
    >>> curve.n_coefficients, curve.jacobian(np.array([0.0, 0.3]), curve.coefficients, 2).shape
    (62, (2, 62))
    """

    def __init__(self, kan: Any, kinks: Sequence[float | Kink] = (),
                 orders: Sequence[int] | None = None) -> None:
        self.network = DeepKAN(kan)
        plan = self.network.plan
        full = all(bool(edges.mask.all()) for edges in kan.act_fun)
        if plan.nodes(0) != 1 or plan.nodes(-1) != 1 or not full:
            raise errors.BadSetting(errors.kan_not_a_curve([list(w) for w in plan.width]))
        knots, k = plan.knots[0][0], plan.k
        self.start, self.stop = float(knots[k]), float(knots[-k - 1])
        beside = build_kan([1, 1], plan.intervals(0), k, (self.start, self.stop), noise=0.0)
        self._beside = ShallowKAN(beside, kinks, orders)
        self._columns = np.array(self._beside.kink_columns, dtype=np.int64)
        self.heights = np.zeros(self._columns.size)
        # Bumps do not change with the coefficients: kept for the times that come again and again.
        self._known: dict[tuple[int, int], tuple[Array, Array]] = {}

    @property
    def kan(self) -> Any:
        """The pykan model."""
        return self.network.kan

    @property
    def n_coefficients(self) -> int:
        """Coefficients of the network and of the bumps."""
        return self.network.n_coefficients + self._columns.size

    @property
    def coefficients(self) -> Array:
        """Coefficients (n_coefficients,) that the pykan model and the bumps hold now."""
        return np.concatenate([self.network.coefficients, self.heights])

    def set_coefficients(self, coefficients: Array) -> None:
        """Put coefficients (n_coefficients,) into the pykan model and the bumps.

        Raises:
            BadSetting: If the shape is another.
        """
        weights, self.heights = self._split(coefficients)
        self.network.set_coefficients(weights)

    @property
    def width(self) -> int:
        """Subnodes S that the first layer's edges enter."""
        return self.network.plan.subnodes(1)

    @property
    def n_splines(self) -> int:
        """Splines of an edge of the first layer, G + k."""
        return self.network.plan.intervals(0) + self.network.plan.k

    def bumps(self, t: Array, derivative: int = 0) -> Array:
        """The bumps or their time derivatives at ``t`` (M,): (M, number of bumps)."""
        key = (id(t), derivative)
        if key not in self._known:
            columns = self._beside.basis(t, derivative)[:, self._columns].toarray()
            if len(self._known) >= _KEPT:
                self._known.clear()
            self._known[key] = (t, columns)  # with t, so that its id stays taken
        return self._known[key][1]

    def values(self, t: Array, coefficients: Array, derivative: int = 0) -> Array:
        """The curve or its time derivative at ``t`` (M,)."""
        _carried(derivative)
        weights, heights = self._split(coefficients)
        return self.network.values(t, weights, derivative) + self.bumps(t, derivative) @ heights

    def jacobian(self, t: Array, coefficients: Array, derivative: int = 0) -> Array:
        """Derivative of ``values`` by the coefficients, (M, n_coefficients)."""
        _carried(derivative)
        weights, _ = self._split(coefficients)
        return np.hstack([self.network.jacobian(t, weights, derivative),
                          self.bumps(t, derivative)])

    def locally(self, t: Array, coefficients: Array, order: int) -> LocalJet:
        """Jacobians of the derivatives 0 to ``order`` without their zeros; bumps are the last of
        the far coefficients.
        """
        _carried(order)
        jet = self.network.locally(t, self._split(coefficients)[0], order)
        return replace(jet, far=tuple(np.hstack([far, self.bumps(t, d)])
                                      for d, far in enumerate(jet.far)))

    def coverage(self, t: Array, coefficients: Array) -> float:
        """How far hidden values over ``t`` reach: 0 the middle of their grids, 1 an end."""
        places = self.network.coverage(t, self._split(coefficients)[0])[1:]
        return max((float(np.abs(2.0 * place - 1.0).max()) for place in places), default=0.0)

    def widened(self) -> KanCurve:
        """The same curve with a cell more on either side of every hidden grid."""
        plan = self.network.plan
        ranges = [(self.start, self.stop)]
        for layer in range(1, plan.depth):
            knots, k = plan.knots[layer][0], plan.k
            ranges.append((float(knots[k - 1]), float(knots[-k])))
        other = KanCurve(regrid(self.kan, ranges).kan, self._beside.kinks)
        other.heights = self.heights.copy()
        return other

    def forward(self, t: Array) -> Array:
        """The curve (M,) by pykan's own forward pass, plus the bumps."""
        import torch

        with torch.no_grad():
            column = torch.from_numpy(np.array(t, dtype=float)[:, None])
            there = self.kan(column.to(self.kan.act_fun[0].grid.device))
        return np.array(there.cpu().numpy())[:, 0] + self.bumps(t) @ self.heights

    def _split(self, coefficients: Array) -> tuple[Array, Array]:
        given = np.asarray(coefficients, float)
        if given.shape != (self.n_coefficients,):
            raise errors.BadSetting(errors.kan_coefficients(given.shape, (self.n_coefficients,)))
        count = self.network.n_coefficients
        return given[:count], given[count:].copy()


def _carried(order: int) -> None:
    if order > HIGHEST:
        raise errors.BadSetting(errors.kan_order(order, HIGHEST))
