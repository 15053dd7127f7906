"""What a KAN is made of, checked before anything is built."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from pikanid import errors

Array = NDArray[np.float64]
Base = Literal["zero", "silu"]
Arity = int | tuple[tuple[int, ...], ...]


@dataclass(frozen=True, eq=False)
class KanPlan:
    """Shape of a KAN: nodes of every layer, spline degree and knots of every layer of edges.

    Attributes:
        width: (number of sums, number of products) of every layer of nodes, inputs first.
        k: Spline degree.
        base: Base function of Eq. (3): "zero" is w_b = 0.
        arity: Factors of a product node: one number, or one tuple a layer.
        knots: One array (inputs of the layer, G + 2k + 1) for every layer of edges.
    """

    width: tuple[tuple[int, int], ...]
    k: int
    base: Base
    arity: Arity
    knots: tuple[Array, ...]

    @property
    def depth(self) -> int:
        """Number of layers of edges."""
        return len(self.width) - 1

    def nodes(self, layer: int) -> int:
        """Nodes of a layer: sums and products."""
        return sum(self.width[layer])

    def subnodes(self, layer: int) -> int:
        """Values that enter a layer's nodes: one for a sum, `arity` for a product."""
        return self.width[layer][0] + sum(self.factors(layer))

    def factors(self, layer: int) -> tuple[int, ...]:
        """Number of factors of every product node of a layer."""
        if isinstance(self.arity, int):
            return (self.arity,) * self.width[layer][1]
        return self.arity[layer]

    def intervals(self, layer: int) -> int:
        """Grid intervals G of a layer of edges."""
        return int(self.knots[layer].shape[1] - 2 * self.k - 1)


@dataclass(frozen=True, eq=False)
class PlannedKan:
    """A pykan model that is not made yet: pykan takes milliseconds, and most fits need its plan."""

    plan: KanPlan
    make: Callable[[], Any]


def uniform_extended_knots(start: float, stop: float, intervals: int, k: int) -> Array:
    """pykan's knots: uniform on [start, stop] and continued by k on each side, (G + 2k + 1,).

    >>> uniform_extended_knots(0.0, 1.0, 2, 1)
    array([-0.5,  0. ,  0.5,  1. ,  1.5])
    """
    step = (stop - start) / intervals
    inner = np.linspace(start, stop, intervals + 1)
    before = start - step * np.arange(k, 0, -1)
    after = stop + step * np.arange(1, k + 1)
    return np.concatenate([before, inner, after])


def plan_kan(width: Sequence[int | Sequence[int]], grid: int | Sequence[int], k: int,
             grid_range: Sequence[float] | Sequence[Sequence[float]], base: Base,
             mult_arity: int | Sequence[Sequence[int]]) -> KanPlan:
    """Check the arguments of `build_kan` and lay uniform knots.

    Raises:
        BadSetting: If an argument cannot make a KAN; the sentence says which.
    """
    layers = tuple(_layer(entry) for entry in width)
    if len(layers) < 2 or layers[0][1] or min(sum(layer) for layer in layers) < 1:
        raise errors.BadSetting(errors.kan_width(list(width)))
    if not isinstance(k, (int, np.integer)) or not 1 <= k <= 9:
        raise errors.BadSetting(errors.bad_value("the spline degree k", k, "1 to 9"))
    if base not in ("zero", "silu"):
        raise errors.BadSetting(errors.bad_value("the base function", base, "'zero' or 'silu'"))
    depth = len(layers) - 1
    grids = [grid] * depth if isinstance(grid, (int, np.integer)) else list(grid)
    if len(grids) != depth or any(g < 1 for g in grids):
        raise errors.BadSetting(errors.bad_value("grid", grid, f"one positive number or {depth}"))
    ranges = np.array(np.broadcast_to(np.asarray(grid_range, dtype=float), (depth, 2)))
    if not np.all(np.isfinite(ranges)) or np.any(ranges[:, 0] >= ranges[:, 1]):
        raise errors.BadSetting(
            errors.bad_value("grid_range", grid_range, "(start, stop) with start < stop"))
    knots = tuple(np.tile(uniform_extended_knots(a, b, int(g), int(k)), (sum(layer), 1)) for layer,
                  g, (a, b) in zip(layers, grids, ranges, strict=False))
    return KanPlan(layers, int(k), base, _arity(mult_arity, layers), knots)


def _layer(entry: int | Sequence[int]) -> tuple[int, int]:
    if isinstance(entry, (int, np.integer)):
        return int(entry), 0
    sums, products = entry
    return int(sums), int(products)


def _arity(given: int | Sequence[Sequence[int]], layers: tuple[tuple[int, int], ...]) -> Arity:
    if isinstance(given, (int, np.integer)):
        if given < 2:
            raise errors.BadSetting(errors.bad_value("mult_arity", given, "at least 2"))
        return int(given)
    arity = tuple(tuple(int(factors) for factors in layer) for layer in given)
    fits = [len(factors) for factors in arity] == [products for _, products in layers]
    if not fits or any(f < 2 for factors in arity for f in factors):
        raise errors.BadSetting(
            errors.bad_value("mult_arity", given, "a number >= 2 for every product node"))
    return arity
