"""Jacobian rows of Eq. (2) for deep networks along time: local in the first layer, dense beyond."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from pikanid.approximators import Approximator, Array
from pikanid.objective.functional import Part, Rows, Sites

Ints = NDArray[np.int64]


class Jet(Protocol):
    """Jacobians of an approximator and its time derivatives at M times."""

    @property
    def first(self) -> Ints:
        """First active spline (M,)."""

    @property
    def near(self) -> tuple[Array, ...]:
        """By the active splines' coefficients, (M, (k + 1)·S) for each derivative."""

    @property
    def far(self) -> tuple[Array, ...]:
        """By all other coefficients, (M, n_far) for each derivative."""


class Network(Approximator, Protocol):
    """A curve whose leading coefficients, S edges of `n_splines`, act locally in time."""

    @property
    def width(self) -> int:
        """Edges S of the first layer."""

    @property
    def n_splines(self) -> int:
        """Splines of each."""

    def locally(self, t: Array, coefficients: Array, order: int) -> Jet:
        """Jacobians of the derivatives 0 to ``order``."""


@dataclass(frozen=True, eq=False)
class Family:
    """One family's Jacobian, row e of time m: near coefficients, far ones, θ."""

    first: Ints  # (M,)
    near: Array  # (M, E, w)
    far: Array  # (M, E, q + b): far coefficients, then θ
    residual: Array  # (M, E)


class Layout:
    """Where a recording's coefficients stand: the near ones spline by spline, then the far ones.

    All its networks have the same first grid, one a chain; `near_at` (n_splines·S) and `far_at`
    (q,) are places in the recording's coefficient vector.
    """

    def __init__(self, part: Part):
        self.networks: list[Network] = list(part.approximators)  # type: ignore[arg-type]  # by its builder
        near, far = [], []
        self.starts = [table.part.start for table in part.physics.tops]
        for network, table in zip(self.networks, part.physics.tops, strict=True):
            count = network.width * network.n_splines
            places = np.arange(table.part.start, table.part.stop)
            near.append(places[:count].reshape(network.width, network.n_splines).T)
            far.append(places[count:])
        self.near_at = np.hstack(near).ravel()
        self.far_at = np.concatenate(far)
        self.stride = sum(network.width for network in self.networks)
        ends = np.cumsum([0, *(places.size for places in far)])
        self.far_part = [slice(a, b) for a, b in pairwise(ends)]
        edges = np.cumsum([0, *(network.width for network in self.networks)])
        self.edges = [slice(a, b) for a, b in pairwise(edges)]

    def family(self, sites: Sites, rows: Rows, c: Array, n_theta: int) -> Family:
        """The Jacobian of one family; every network is swept once, to the order needed."""
        count, width = rows.residual.shape
        far = np.zeros((count, width, self.far_at.size + n_theta))
        if rows.by_theta is not None:
            far[:, :, self.far_at.size:] = rows.by_theta
        near = np.zeros((0, 0))
        first = np.zeros(count, dtype=np.int64)
        for i, network in enumerate(self.networks):
            pieces = self._pieces(i, sites, rows)
            if not pieces:
                continue
            order = max(derivative for _, derivative in pieces)
            n = self.starts[i]
            jet = network.locally(sites.t, c[n:n + network.n_coefficients], order)
            first = jet.first
            if near.ndim == 2:
                active = jet.near[0].shape[1] // network.width
                near = np.zeros((count, width, active, self.stride))
            for weight, derivative in pieces:
                local = jet.near[derivative].reshape(count, 1, -1, network.width)
                near[..., self.edges[i]] += weight[:, :, None, None] * local
                far[..., self.far_part[i]] += weight[:, :, None] * jet.far[derivative][:, None]
        return Family(first, near.reshape(count, width, -1), far, rows.residual)

    def _pieces(self, i: int, sites: Sites, rows: Rows) -> list[tuple[Array, int]]:
        """Weights (M, E) of network i's derivatives in the residuals."""
        start = self.starts[i]
        pieces = []
        if rows.by_state is not None:
            pieces += [(rows.by_state[:, :, s], table.derivative)
                       for s, table in enumerate(sites.states)
                       if table.part.start == start and np.any(rows.by_state[:, :, s])]
        if rows.by_top is not None:
            weight = np.zeros(rows.residual.shape)
            weight[:, i] = rows.by_top[:, i]
            pieces.append((weight, sites.tops[i].derivative))
        return pieces
