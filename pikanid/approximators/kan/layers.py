"""What of a pykan layer does not change while its coefficients are estimated."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from pikanid import errors
from pikanid.approximators.kan.jets import product
from pikanid.approximators.kan.plan import Array, KanPlan
from pikanid.approximators.kan.tensors import read


@dataclass(frozen=True, eq=False)
class Layer:
    """What does not change with the coefficients in one layer of edges and the nodes after it."""

    knots: tuple[Array, Array]  # first grid point, spacing: (inputs,)
    intervals: int
    scale: Array  # mask * scale_sp (inputs, subnodes)
    mask: Array
    subnode: tuple[Array, Array]  # scale, bias (subnodes,)
    node: tuple[Array, Array]  # scale, bias (nodes,)
    groups: tuple[tuple[int, ...], ...]  # subnodes that each node multiplies


def through_nodes(layer: Layer, adjoint: Array, factor: Array) -> Array:
    """From a layer's nodes to the values of its edges' sums: products, affine maps."""
    result = np.zeros((*adjoint.shape[:3], factor.shape[-1]))
    for number, group in enumerate(layer.groups):
        above = adjoint[..., number] * layer.node[0][number]
        for subnode in group:
            others = [factor[..., s][..., None] for s in group if s != subnode]
            result[..., subnode] = product([above, *others])
    return result * layer.subnode[0]


def read_layer(kan: Any, plan: KanPlan, number: int) -> Layer:
    """One layer of a pykan model as arrays, ready to be evaluated."""
    edges, knots, k = kan.act_fun[number], plan.knots[number], plan.k
    if float(kan.symbolic_fun[number].mask.abs().sum()) > 0.0:
        raise errors.BadSetting(errors.kan_symbolic(number))
    intervals = plan.intervals(number)
    start = knots[:, k]
    step = (knots[:, -k - 1] - start) / intervals
    even = start[:, None] + step[:, None] * np.arange(-k, intervals + k + 1)
    if np.any(np.abs(knots - even) > 1e-9 * step[:, None] * (intervals + 2 * k)):
        raise errors.BadSetting(errors.kan_knots(number))
    mask = read(edges.mask)
    sums, _ = plan.width[number + 1]
    groups: list[tuple[int, ...]] = [(subnode,) for subnode in range(sums)]
    at = sums
    for factors in plan.factors(number + 1):
        groups.append(tuple(range(at, at + factors)))
        at += factors
    return Layer((start, step), intervals, mask * read(edges.scale_sp), mask,
                 (read(kan.subnode_scale[number]), read(kan.subnode_bias[number])),
                 (read(kan.node_scale[number]), read(kan.node_bias[number])), tuple(groups))
