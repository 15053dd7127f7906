"""A KAN without the nodes and edges that hardly matter."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pikanid.approximators.kan.plan import Array
from pikanid.approximators.kan.quiet import undisturbed
from pikanid.approximators.kan.state import KanState, LayerState, restored, to_state
from pikanid.approximators.kan.tensors import read


@dataclass(frozen=True, eq=False)
class Scores:
    """pykan's attribution: how much of the outputs' spread passes through a node or an edge.

    Attributes:
        nodes: One array (nodes,) for every layer of nodes.
        edges: One array (subnodes, inputs) for every layer of edges.
    """

    nodes: tuple[Array, ...]
    edges: tuple[Array, ...]


def scores(kan: Any, x: Array | None = None) -> Scores:
    """Attribution scores on inputs (M, inputs), or on those that the model saw last."""
    import torch

    saving = kan.save_act
    with undisturbed(double=True), torch.no_grad():
        batch = kan.cache_data if x is None else torch.from_numpy(np.array(x, float))
        kan.save_act = True
        kan(batch.reshape(len(batch), -1))
        kan.attribute()
        kan.save_act = saving
    return Scores(tuple(read(score) for score in kan.node_scores),
                  tuple(read(score) for score in kan.edge_scores))


def prune(kan: Any, x: Array | None = None, *, node_threshold: float = 1e-2,
          edge_threshold: float = 3e-2) -> Any:
    """A new model without hidden nodes, then with masks on edges, that score below a threshold.

    The best node of a hidden layer always stays; the model given is left as it is.

    Args:
        kan: A pykan model.
        x: Inputs (M, inputs) to score on; those seen last unless given.
        node_threshold: For hidden nodes, with everything attached to them.
        edge_threshold: For edges, which remain in place with mask 0.

    >>> from pikanid.approximators.kan import build_kan
    >>> kan = build_kan([1, 4, 1], start="waves")
    >>> kan.act_fun[1].coef.data[2:] = 0.0
    >>> prune(kan).width
    [[1, 0], [2, 0], [1, 0]]
    """
    found = scores(kan, x)
    kept: list[NDArray[np.int64]] = [np.arange(found.nodes[0].size)]
    for score in found.nodes[1:-1]:
        good = np.flatnonzero(score > node_threshold)
        kept.append(good if good.size else np.array([int(np.argmax(score))]))
    kept.append(np.arange(found.nodes[-1].size))
    smaller = restored(_subset(to_state(kan), kept), type(kan))
    weak = scores(smaller, x).edges
    state = to_state(smaller)
    layers = tuple(
        replace(layer, mask=np.where(score.transpose() > edge_threshold, layer.mask, 0.0))
        for layer, score in zip(state.layers, weak, strict=True)
    )
    return restored(replace(state, layers=layers), type(kan))


def _subset(state: KanState, kept: list[NDArray[np.int64]]) -> KanState:
    """The state with only these nodes of every layer, and the subnodes that they need."""
    plan = state.plan
    width, arity, subnodes = [], [], []
    for number, nodes in enumerate(kept):
        sums = plan.width[number][0]
        starts = sums + np.concatenate([[0], np.cumsum(plan.factors(number))]).astype(int)
        products = nodes[nodes >= sums] - sums
        width.append((int(np.sum(nodes < sums)), products.size))
        arity.append(tuple(plan.factors(number)[p] for p in products))
        used = [nodes[nodes < sums], *(np.arange(starts[p], starts[p + 1]) for p in products)]
        subnodes.append(np.concatenate(used).astype(np.int64))
    layers = tuple(_cut(layer, nodes, sub, after) for layer, (nodes, after),
                   sub in zip(state.layers, pairwise(kept), subnodes[1:], strict=True))
    factors = state.arity if isinstance(state.arity, int) else tuple(arity)
    return replace(state, width=tuple(width), arity=factors, layers=layers)


def _cut(layer: LayerState, inputs: NDArray[np.int64], subnodes: NDArray[np.int64],
         nodes: NDArray[np.int64]) -> LayerState:
    edges, crossed = np.ix_(inputs, subnodes), np.ix_(subnodes, inputs)
    return LayerState(
        grid=layer.grid[inputs], coef=layer.coef[edges], scale_base=layer.scale_base[edges],
        scale_sp=layer.scale_sp[edges], mask=layer.mask[edges], node_scale=layer.node_scale[nodes],
        node_bias=layer.node_bias[nodes], subnode_scale=layer.subnode_scale[subnodes],
        subnode_bias=layer.subnode_bias[subnodes], symbolic_mask=layer.symbolic_mask[crossed],
        symbolic_affine=layer.symbolic_affine[crossed],
        symbols=tuple(tuple(layer.symbols[j][i] for i in inputs) for j in subnodes))
