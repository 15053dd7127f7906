"""Finer or wider grids for a KAN, edge by edge.

pykan's own refinement refits every edge on the inputs of the last forward pass: where those are
fewer than the new coefficients, the function is destroyed.  Here the finer spline space is taken
for what it is: where it contains the coarser one (G a multiple of the old), the new coefficients
are the blossom of the old polynomials at the new knots, and the function stays what it was.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pikanid import errors
from pikanid.approximators.kan.bases import spline_rows
from pikanid.approximators.kan.cells import local_bases
from pikanid.approximators.kan.plan import Array, uniform_extended_knots
from pikanid.approximators.kan.state import LayerState, restored, to_state


@dataclass(frozen=True, eq=False)
class Refinement:
    """A KAN on other knots.

    Attributes:
        kan: The new pykan model.
        exact: Whether the new spline spaces contain the old ones.
        error: Largest change of any edge function on its new grid, measured.
    """

    kan: Any
    exact: bool
    error: float


def refine(kan: Any, grid: int | Sequence[int]) -> Refinement:
    """The same KAN with ``grid`` intervals in every layer (or one number a layer).

    Exact inside the grid where every new number is a multiple of the old; otherwise each edge is
    the least-squares spline, and `Refinement.error` says how good.  Outside the grid, where edges
    fade over k cells, a finer grid fades faster: see `DeepKAN.coverage`.

    Raises:
        BadSetting: If a number of intervals is not positive.

    >>> from pikanid.approximators.kan import build_kan
    >>> result = refine(build_kan([1, 3, 1], grid=10), 20)
    >>> result.exact, result.error < 1e-12, result.kan.grid
    (True, True, 20)
    """
    state = to_state(kan)
    depth = len(state.layers)
    grids = [grid] * depth if isinstance(grid, (int, np.integer)) else list(grid)
    if len(grids) != depth or any(g < 1 for g in grids):
        raise errors.BadSetting(errors.bad_value("grid", grid, f"one positive number or {depth}"))
    layers: list[LayerState] = []
    worst, exact = 0.0, True
    for layer, wanted in zip(state.layers, grids, strict=True):
        coefs, knots = [], []
        for old, coef in zip(layer.grid, layer.coef, strict=True):
            new = _refined_knots(old, state.k, int(wanted))
            matrix, contained = change_of_knots(old, new, state.k)
            points = np.linspace(new[state.k], new[-state.k - 1], 4 * (old.size + new.size))
            change = _curve(points, new, coef @ matrix.T, state.k) - _curve(
                points, old, coef, state.k)
            worst, exact = max(worst, float(np.abs(change).max())), exact and contained
            coefs.append(coef @ matrix.T)
            knots.append(new)
        layers.append(replace(layer, grid=np.array(knots), coef=np.array(coefs)))
    return Refinement(restored(replace(state, layers=tuple(layers)), type(kan)), exact, worst)


def regrid(kan: Any, ranges: Sequence[Sequence[float]], grid: int | None = None) -> Refinement:
    """The KAN on uniform grids over other ranges, one (start, stop) a layer.

    For hidden layers whose values have left their grid (`DeepKAN.coverage`).  Every edge, faded
    parts included, is refitted by least squares.

    Args:
        kan: A pykan model on uniform grids.
        ranges: New (start, stop) of every layer of edges.
        grid: New number of intervals; unless given, the spacing is kept where that is finer.

    Raises:
        BadSetting: If there is not one proper range for every layer.
    """
    state = to_state(kan)
    if len(ranges) != len(state.layers) or any(a >= b for a, b in ranges):
        raise errors.BadSetting(errors.bad_value("ranges", ranges, "one (start, stop) a layer"))
    k = state.k
    layers, worst = [], 0.0
    for layer, (low, high) in zip(state.layers, ranges, strict=True):
        intervals = layer.grid.shape[1] - 2 * k - 1
        step = (layer.grid[:, -k - 1] - layer.grid[:, k]) / intervals
        number = grid or max(intervals, int(np.ceil((high - low) / step.max() - 1e-9)))
        new = uniform_extended_knots(low, high, number, k)
        points = np.linspace(low, high, 8 * (number + k))
        design = _design(points, new, k)
        coefs = []
        for row, (knots, coef) in enumerate(zip(layer.grid, layer.coef, strict=True)):
            first, bases = local_bases(points[:, None], knots[[k]], step[[row]], intervals, k, 0)
            active = coef[:, first + np.arange(k + 1)]  # (subnodes, points, k + 1)
            curve = np.einsum("spr,pr->ps", active, bases[:, 0, 0])
            found, *_ = np.linalg.lstsq(design, curve, rcond=None)
            worst = max(worst, float(np.abs(design @ found - curve).max()))
            coefs.append(found.T)
        knots = np.tile(new, (layer.grid.shape[0], 1))
        layers.append(replace(layer, grid=knots, coef=np.array(coefs)))
    return Refinement(restored(replace(state, layers=tuple(layers)), type(kan)), False, worst)


def change_of_knots(old: Array, new: Array, degree: int) -> tuple[Array, bool]:
    """Matrix (n_new, n_old) from old to new coefficients, and whether it is exact.

    Both knot sequences carry ``degree`` knots beyond each end of the same interval.  A coefficient
    is the blossom of the polynomial in a cell of its function's support, at the function's inner
    knots (Ramshaw; the Oslo algorithm in one step).

    >>> old, new = uniform_extended_knots(0, 1, 2, 1), uniform_extended_knots(0, 1, 4, 1)
    >>> change_of_knots(old, new, 1)[0]
    array([[1. , 0. , 0. ],
           [0.5, 0.5, 0. ],
           [0. , 1. , 0. ],
           [0. , 0.5, 0.5],
           [0. , 0. , 1. ]])
    """
    k = degree
    old_inner, new_inner = old[k : old.size - k], new[k : new.size - k]
    near = np.abs(new_inner[:, None] - old_inner).min(axis=0)
    if near.max() > 1e-9 * (old_inner[-1] - old_inner[0]):
        return _least_squares(old, new, k), False
    n_old, n_new = old.size - k - 1, new.size - k - 1
    j = np.arange(n_new)
    cell = np.clip(j + k // 2, k, k + new_inner.size - 2)
    middle = 0.5 * (new[cell] + new[cell + 1])
    last = k + np.clip(np.searchsorted(old_inner, middle, "right") - 1, 0, old_inner.size - 2)
    weights = np.broadcast_to(np.eye(k + 1), (n_new, k + 1, k + 1)).copy()
    for r in range(1, k + 1):
        at = new[j + r]  # one inner knot a step: the blossom's arguments
        for a in range(k, r - 1, -1):
            i = last - k + a
            share = ((at - old[i]) / (old[i + k - r + 1] - old[i]))[:, None]
            weights[:, a] = (1.0 - share) * weights[:, a - 1] + share * weights[:, a]
    matrix = np.zeros((n_new, n_old))
    matrix[j[:, None], (last - k)[:, None] + np.arange(k + 1)] = weights[:, k]
    return matrix, True


def _refined_knots(old: Array, k: int, intervals: int) -> Array:
    """pykan's way: new grid points where the old numbering has them, ends continued evenly."""
    inner = old[k : old.size - k]
    count = inner.size - 1
    new = np.interp(np.linspace(0.0, count, intervals + 1), np.arange(count + 1), inner)
    extended = uniform_extended_knots(float(inner[0]), float(inner[-1]), intervals, k)
    extended[k : extended.size - k] = new
    return extended


def _least_squares(old: Array, new: Array, k: int) -> Array:
    """Best approximation in L2, by Gauss points between all knots of both."""
    knots = np.union1d(old[k : old.size - k], new[k : new.size - k])
    nodes, weights = np.polynomial.legendre.leggauss(k + 1)
    half = 0.5 * np.diff(knots)[:, None]
    points = (knots[:-1, None] + half * (nodes + 1.0)).ravel()
    root = np.sqrt(half * weights).ravel()[:, None]
    found, *_ = np.linalg.lstsq(root * _design(points, new, k), root * _design(points, old, k),
                                rcond=None)
    return np.asarray(found, dtype=float)


def _design(points: Array, knots: Array, k: int) -> Array:
    first, values = spline_rows(points, knots, k)
    matrix = np.zeros((points.size, knots.size - k - 1))
    matrix[np.arange(points.size)[:, None], first[:, None] + np.arange(k + 1)] = values
    return matrix


def _curve(points: Array, knots: Array, coef: Array, k: int) -> Array:
    first, values = spline_rows(np.clip(points, knots[k], knots[-k - 1]), knots, k)
    return np.einsum("spr,pr->sp", coef[:, first[:, None] + np.arange(k + 1)], values)
