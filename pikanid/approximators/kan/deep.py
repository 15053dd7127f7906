"""KANs of any width, fast: values, time derivatives and their Jacobians in the coefficients.

A B-spline has k + 1 active functions, so an edge costs a gather and k + 1 products; one sweep
forward (jets of the values) and one backward (jets of the adjoints) give all derivatives.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pikanid import errors
from pikanid.approximators.kan.bases import silu
from pikanid.approximators.kan.blank import plan_of
from pikanid.approximators.kan.cells import local_bases
from pikanid.approximators.kan.jets import BINOMIAL, chain, matrix_product, product
from pikanid.approximators.kan.layers import Layer, read_layer, through_nodes
from pikanid.approximators.kan.plan import Array
from pikanid.approximators.kan.sweeps import KanJet, LocalJet, Sweep, edge_parts
from pikanid.approximators.kan.tensors import read, write


class DeepKAN:
    """A pykan model evaluated without torch.

    The coefficients are one vector, layer by layer: coef (inputs, subnodes, G + k) of the active
    edges, then scale_base (inputs, subnodes) where the KAN has a base function.

    Args:
        kan: Any pykan model with spline edges on uniform grids (`build_kan`).

    Raises:
        BadSetting: If edges are symbolic or a grid is not uniform.

    >>> from pikanid.approximators.kan import build_kan
    >>> deep = DeepKAN(build_kan([1, 5, 1], grid=40, grid_range=[(0, 5), (-1, 1)]))
    >>> jet = deep.evaluate(np.linspace(0, 5, 501), deep.coefficients, jacobian=True)
    >>> deep.n_coefficients, jet.values[2].shape, jet.jacobians[2].shape
    (430, (501, 1), (501, 1, 430))
    """

    def __init__(self, kan: Any) -> None:
        self.kan = kan
        self.plan = plan_of(kan)
        self._layers = [read_layer(kan, self.plan, number) for number in range(self.plan.depth)]
        # Masked edges keep their places in the dense layout but are no coefficients.
        self._active = np.concatenate([self._mask(layer) for layer in self._layers])

    @property
    def n_coefficients(self) -> int:
        """Number of coefficients of all active edges."""
        return int(self._active.sum())

    @property
    def coefficients(self) -> Array:
        """Coefficients (n_coefficients,) that the pykan model holds now."""
        parts = []
        for edges in self.kan.act_fun:
            parts.append(read(edges.coef).ravel())
            if self.plan.base == "silu":
                parts.append(read(edges.scale_base).ravel())
        return np.concatenate(parts)[self._active]

    def set_coefficients(self, coefficients: Array) -> None:
        """Put coefficients (n_coefficients,) into the pykan model.

        Raises:
            BadSetting: If the shape is another.
        """
        for edges, (coef, base) in zip(self.kan.act_fun, self._split(coefficients), strict=True):
            write(edges.coef, coef)
            if base is not None:
                write(edges.scale_base, base)

    def evaluate(self, x: Array, coefficients: Array, *, first: Array | None = None,
                 second: Array | None = None, order: int = 2, jacobian: bool = False) -> KanJet:
        """Outputs and their derivatives along a path through the inputs.

        Args:
            x: Inputs (M,) or (M, inputs).
            coefficients: (n_coefficients,).
            first: dx/ds (M, inputs); 1 unless given: with one input, s is that input.
            second: d²x/ds² (M, inputs); 0 unless given.
            order: Highest derivative in s, 0 to 2.
            jacobian: Whether the Jacobians are wanted.
        """
        if order not in (0, 1, 2):
            raise errors.BadSetting(errors.bad_value("order", order, "0, 1 or 2"))
        x = np.asarray(x, float).reshape(len(x), -1)
        jet = np.zeros((order + 1, *x.shape))
        jet[0] = x
        for depth, rate in ((1, 1.0 if first is None else first), (2, second)):
            if depth <= order and rate is not None:
                jet[depth] = np.reshape(rate, x.shape) if np.ndim(rate) else rate
        sweeps, jet = self._swept(jet, coefficients, slopes=jacobian)
        values = tuple(jet)
        if not jacobian:
            return KanJet(values)
        table = np.zeros((order + 1, x.shape[0], self.plan.nodes(-1), self._active.size))
        adjoint = self._adjoints(table, sweeps)
        adjoint = through_nodes(self._layers[0], adjoint, sweeps[0].factor)
        self._fill(table, 0, self._layers[0], adjoint, sweeps[0])
        slopes = matrix_product(adjoint, sweeps[0].slope.swapaxes(-1, -2))
        if not self._active.all():
            table = table[..., self._active]
        return KanJet(values, tuple(table), slopes[0])

    def locally(self, t: Array, coefficients: Array, order: int) -> LocalJet:
        """The Jacobians at ``t`` (M,) of the derivatives 0 to ``order``, without their zeros.

        For one input, one output and no masked edges.
        """
        jet = np.zeros((order + 1, t.size, 1))
        jet[0, :, 0] = t
        if order:
            jet[1] = 1.0
        sweeps, _ = self._swept(jet, coefficients, slopes=True)
        table = np.zeros((order + 1, t.size, 1, self._active.size))
        adjoint = self._adjoints(table, sweeps)
        layer, sweep = self._layers[0], sweeps[0]
        adjoint = through_nodes(layer, adjoint, sweep.factor)
        near = tuple(
            (part[:, 0, :, 0] * layer.scale[0]).reshape(t.size, -1)
            for part in edge_parts(adjoint, sweep)
        )
        splines = layer.mask.size * (layer.intervals + self.plan.k)
        self._fill_base(table[..., splines : self._mask(layer).size], layer, adjoint, sweep)
        return LocalJet(sweep.first[:, 0], near, tuple(table[:, :, 0, splines:]))

    def values(self, t: Array, coefficients: Array, derivative: int = 0) -> Array:
        """The first output or its derivative at ``t`` (M,), shape (M,)."""
        return self.evaluate(t, coefficients, order=derivative).values[derivative][:, 0]

    def jacobian(self, t: Array, coefficients: Array, derivative: int = 0) -> Array:
        """Derivative of ``values`` by the coefficients, shape (M, n_coefficients)."""
        jet = self.evaluate(t, coefficients, order=derivative, jacobian=True)
        return jet.jacobians[derivative][:, 0]

    def coverage(self, x: Array, coefficients: Array) -> tuple[Array, ...]:
        """Where the arguments of every layer lie on its grid: (inputs, 2), 0 start to 1 stop.

        A value outside [0, 1] says that edges fade to zero for some of the inputs ``x``: `regrid`.
        """
        jet = np.asarray(x, float).reshape(1, len(x), -1)
        places = []
        for layer, (coef, base) in zip(self._layers, self._split(coefficients), strict=True):
            start, step = layer.knots
            place = (jet[0] - start) / (step * layer.intervals)
            places.append(np.stack([place.min(axis=0), place.max(axis=0)], axis=1))
            _, jet = self._forward(layer, jet, coef, base, slopes=False)
        return tuple(places)

    def _swept(self, jet: Array, coefficients: Array, *, slopes: bool) -> tuple[list[Sweep], Array]:
        """The forward sweep through all layers."""
        sweeps = []
        for layer, (coef, base) in zip(self._layers, self._split(coefficients), strict=True):
            sweep, jet = self._forward(layer, jet, coef, base, slopes=slopes)
            sweeps.append(sweep)
        return sweeps, jet

    def _adjoints(self, table: Array, sweeps: list[Sweep]) -> Array:
        """The backward sweep down to the first layer's nodes, filling the later layers' columns."""
        outputs = self.plan.nodes(-1)
        adjoint = np.zeros((*table.shape[:2], outputs, outputs))
        adjoint[0] = np.eye(outputs)
        end = self._active.size
        for layer, sweep in zip(self._layers[:0:-1], sweeps[:0:-1], strict=True):
            end -= self._mask(layer).size
            adjoint = through_nodes(layer, adjoint, sweep.factor)
            self._fill(table, end, layer, adjoint, sweep)
            adjoint = matrix_product(adjoint, sweep.slope.swapaxes(-1, -2))
        return adjoint

    def _forward(self, layer: Layer, jet: Array, coef: Array, base: Array | None, *,
                 slopes: bool) -> tuple[Sweep, Array]:
        order, k = jet.shape[0] - 1, self.plan.k
        first, bases = local_bases(jet[0], *layer.knots, layer.intervals, k, order + slopes)
        rows = np.arange(coef.shape[0])[:, None]
        active = (coef * layer.scale[..., None]).transpose(0, 2, 1)[
            rows, first[..., None] + np.arange(k + 1)
        ]
        edges = np.matmul(bases, active)  # derivatives of every edge (M, inputs, d, subnodes)
        if base is not None:
            silus = np.stack([silu(jet[0], d) for d in range(order + slopes + 1)], axis=2)
            edges = edges + silus[..., None] * (layer.mask * base)[:, None]
        moved = np.moveaxis(edges, 2, 0)
        subnode = chain(moved[: order + 1], jet).sum(axis=2)
        sweep = Sweep(first, np.empty(0), None, np.empty(0), np.empty(0))
        if slopes:
            sweep.local = chain(np.moveaxis(bases, 2, 0)[: order + 1], jet)
            sweep.slope = chain(moved[1:], jet)
            if base is not None:
                sweep.base = chain(np.moveaxis(silus, 2, 0)[: order + 1, ..., None], jet)[..., 0]
        subnode = subnode * layer.subnode[0]
        subnode[0] += layer.subnode[1]
        sweep.factor = subnode
        node = np.empty((*subnode.shape[:2], len(layer.groups)))
        for number, group in enumerate(layer.groups):
            node[..., number] = product([subnode[..., s] for s in group])
        node *= layer.node[0]
        node[0] += layer.node[1]
        return sweep, node

    def _fill(self, table: Array, start: int, layer: Layer, adjoint: Array, sweep: Sweep) -> None:
        """The columns of one layer's coefficients."""
        inputs, outputs = layer.mask.shape
        size = layer.intervals + self.plan.k
        block = table[..., start : start + inputs * outputs * size]
        block = block.reshape(*table.shape[:3], inputs, outputs, size)
        window = sweep.first[..., None] + np.arange(self.plan.k + 1)
        points = np.arange(window.shape[0])[:, None, None]
        rows = np.arange(inputs)[None, :, None]
        for d, part in enumerate(edge_parts(adjoint, sweep)):
            block[d][points, :, rows, :, window] = part * layer.scale[:, None, None]
        self._fill_base(table[..., start + inputs * outputs * size :][..., : inputs * outputs],
                        layer, adjoint, sweep)

    def _fill_base(self, rest: Array, layer: Layer, adjoint: Array, sweep: Sweep) -> None:
        """The columns of one layer's scale_base, if there are any."""
        if sweep.base is None:
            return
        rest = rest.reshape(*rest.shape[:3], *layer.mask.shape)
        for d in range(len(rest)):
            for e in range(d + 1):
                base = sweep.base[d - e][:, None, :, None] * layer.mask
                rest[d] += BINOMIAL[d][e] * adjoint[e][:, :, None] * base

    def _split(self, coefficients: Array) -> list[tuple[Array, Array | None]]:
        given = np.asarray(coefficients, float)
        if given.shape != (self.n_coefficients,):
            raise errors.BadSetting(errors.kan_coefficients(given.shape, (self.n_coefficients,)))
        full = given
        if not self._active.all():
            full = np.zeros(self._active.size)
            full[self._active] = given
        parts: list[tuple[Array, Array | None]] = []
        at = 0
        for layer in self._layers:
            edges, size = layer.mask.size, layer.intervals + self.plan.k
            coef = full[at : at + edges * size].reshape(*layer.mask.shape, size)
            at += edges * size
            base = None
            if self.plan.base == "silu":
                base = full[at : at + edges].reshape(layer.mask.shape)
                at += edges
            parts.append((coef, base))
        return parts

    def _mask(self, layer: Layer) -> NDArray[np.bool_]:
        """Which places of a layer's dense layout are coefficients."""
        active = (layer.mask != 0.0).ravel()
        splines = np.repeat(active, layer.intervals + self.plan.k)
        return np.concatenate([splines, active]) if self.plan.base == "silu" else splines
