"""The edges of a KAN one by one: where their coefficients are, what they were given."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from pikanid.approximators.kan.bases import silu
from pikanid.approximators.kan.build import from_state
from pikanid.approximators.kan.deep import DeepKAN
from pikanid.approximators.kan.plan import Array, KanPlan, uniform_extended_knots
from pikanid.approximators.kan.state import KanState, to_state

LEAST_INTERVALS = 12  # numerical: a smooth edge refitted as a cubic errs by some 12^-4


@dataclass(frozen=True, eq=False)
class KanEdge:
    """One active edge, from node `source` of a layer to subnode `target` of the next.

    `at` (K,) are the places of its coefficients in the network's vector; φ(u) = basis(u) @ c[at].
    """

    layer: int
    source: int
    target: int
    at: NDArray[np.int64]
    knots: Array
    k: int
    scale: float
    has_base: bool

    @property
    def splines(self) -> NDArray[np.int64]:
        """Places of the spline's coefficients alone."""
        return self.at[:-1] if self.has_base else self.at

    def basis(self, u: Array) -> Array:
        """What the coefficients multiply (n, K), at arguments u (n,)."""
        start, stop = self.knots[self.k], self.knots[-self.k - 1]
        inside = np.clip(u, start, stop)
        rows = _design(inside, self.knots, self.k) * self.scale
        return np.column_stack([rows, silu(u, 0)]) if self.has_base else rows


def edges_of(network: DeepKAN) -> tuple[KanEdge, ...]:
    """Every edge whose mask is not zero, layer by layer.

    >>> from pikanid.approximators.kan import build_kan
    >>> [(e.layer, e.source, e.target, len(e.at)) for e in edges_of(DeepKAN(build_kan([2, 1, 1])))]
    [(0, 0, 0, 8), (0, 1, 0, 8), (1, 0, 0, 8)]
    """
    plan, found, first = network.plan, [], 0
    silus = plan.base == "silu"
    for number in range(plan.depth):
        edges = network.kan.act_fun[number]
        scale = edges.scale_sp.detach().cpu().numpy() * edges.mask.detach().cpu().numpy()
        live = [(i, s) for i in range(scale.shape[0]) for s in range(scale.shape[1])
                if float(edges.mask[i, s]) != 0.0]
        size = plan.intervals(number) + plan.k
        for order, (i, s) in enumerate(live):
            at = first + order * size + np.arange(size)
            if silus:
                at = np.append(at, first + len(live) * size + order)
            found.append(KanEdge(number, i, s, at, plan.knots[number][i], plan.k,
                                 float(scale[i, s]), silus))
        first += len(live) * (size + silus)
    return tuple(found)


def beside(edges: Sequence[KanEdge], edge: KanEdge) -> NDArray[np.int64]:
    """Places of the coefficients of all edges that enter the same subnode."""
    same = [e.at for e in edges if (e.layer, e.target) == (edge.layer, edge.target)]
    return np.concatenate(same)


def arguments(kan: Any, x: Array) -> tuple[Array, ...]:
    """What enters every layer of a pykan model (M, nodes), its outputs last.

    Args:
        x: Inputs (M, inputs).
    """
    torch = import_module("torch")
    with torch.no_grad():
        place = kan.act_fun[0].grid
        batch = torch.from_numpy(np.array(x, float)).to(place.device, place.dtype)
        saving, kan.save_act = kan.save_act, True
        kept = kan.cache_data
        try:
            out = kan(batch)
        finally:
            kan.save_act, kan.cache_data = saving, kept
    return tuple(np.array(a.detach().cpu().numpy(), float) for a in (*kan.acts[:-1], out))


def plain(kan: Any, x: Array) -> Any:
    """The same function over inputs x (M, inputs) with nothing but splines on uniform grids.

    A model that is so already comes back as a copy.  Where a grid was adapted, a base function
    trained or an edge made symbolic, every edge is refitted on a grid over what it was given.
    """
    state = to_state(kan)
    if state.base == "zero" and all(
            not layer.symbolic_mask.any() and _even(layer.grid) for layer in state.layers):
        return from_state(state)
    inputs, k, layers = arguments(kan, x), state.k, []
    for number, layer in enumerate(state.layers):
        intervals = max(LEAST_INTERVALS, layer.grid.shape[1] - 2 * k - 1)
        shape = layer.mask.shape
        coef, grid = np.zeros((*shape, intervals + k)), []
        for i in range(shape[0]):
            low, high = float(inputs[number][:, i].min()), float(inputs[number][:, i].max())
            knots = uniform_extended_knots(low, max(high, low + 1e-9), intervals, k)
            u = np.linspace(knots[k], knots[-k - 1], 12 * intervals)
            rows = _design(u, knots, k)
            for s in range(shape[1]):
                coef[i, s] = np.linalg.lstsq(rows, _edge(kan, state, number, i, s, u),
                                             rcond=None)[0]
            grid.append(knots)
        live = (layer.mask != 0.0) | (layer.symbolic_mask.T != 0.0)
        layers.append(replace(
            layer, grid=np.array(grid), coef=coef, scale_sp=np.ones(shape), mask=live.astype(float),
            scale_base=np.zeros(shape), symbolic_mask=np.zeros_like(layer.symbolic_mask)))
    return from_state(replace(state, base="zero", layers=tuple(layers)))


def _even(grid: Array) -> bool:
    steps = np.diff(grid, axis=1)
    return bool(np.ptp(steps, axis=1).max() <= 1e-9 * np.abs(grid).max())


def _edge(kan: Any, state: KanState, number: int, i: int, s: int, u: Array) -> Array:
    """One edge as pykan evaluates it: spline, base function, symbolic function."""
    torch = import_module("torch")
    layer, k = state.layers[number], state.k
    values = np.zeros(len(u))
    if layer.mask[i, s] != 0.0:
        knots, step = layer.grid[i], np.diff(layer.grid[i])
        # pykan's splines fade beyond their grid: so do these, with zeros as neighbours
        wide = np.concatenate([knots[0] - step[0] * np.arange(k, 0, -1), knots,
                               knots[-1] + step[-1] * np.arange(1, k + 1)])
        padded = np.pad(layer.coef[i, s], k)
        spline = BSpline(wide, padded, k, extrapolate=False)(u)
        values = layer.scale_sp[i, s] * np.nan_to_num(spline)
        if state.base == "silu":
            values = values + layer.scale_base[i, s] * silu(u, 0)
        values = layer.mask[i, s] * values
    if layer.symbolic_mask[s, i] != 0.0:
        a, b, c, d = layer.symbolic_affine[s, i]
        with torch.no_grad():
            f = kan.symbolic_fun[number].funs[s][i](torch.from_numpy(a * u + b)).numpy()
        values = values + layer.symbolic_mask[s, i] * (c * f + d)
    return values


def _design(u: Array, knots: Array, k: int) -> Array:
    return np.asarray(BSpline.design_matrix(u, knots, k).toarray())


def groups_of(plan: KanPlan) -> tuple[tuple[tuple[int, ...], ...], ...]:
    """Layer by layer, the subnodes that every node multiplies (one for a sum)."""
    every = []
    for number in range(1, plan.depth + 1):
        sums = plan.width[number][0]
        groups: list[tuple[int, ...]] = [(s,) for s in range(sums)]
        at = sums
        for factors in plan.factors(number):
            groups.append(tuple(range(at, at + factors)))
            at += factors
        every.append(tuple(groups))
    return tuple(every)


def without_edge(kan: Any, layer: int, source: int, target: int) -> Any:
    """A new model in which one edge is masked out."""
    state = to_state(kan)
    mask = state.layers[layer].mask.copy()
    mask[source, target] = 0.0
    layers = list(state.layers)
    layers[layer] = replace(layers[layer], mask=mask)
    return from_state(replace(state, layers=tuple(layers)))
