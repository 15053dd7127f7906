"""A pykan model from given edges: a sum of splines of inputs and of products of inputs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from pikanid.approximators.kan.build import build_kan
from pikanid.approximators.kan.plan import Array, uniform_extended_knots
from pikanid.approximators.kan.tensors import read, write

K = 3


def additive_kan(limits: Sequence[tuple[float, float]], intervals: int,
                 coefficients: Sequence[Array], steps: Sequence[float], offset: float,
                 factors: Sequence[Sequence[int]] | None = None) -> Any:
    """The function offset + Σ_j spline_j(z_j) + J_j sign(z_j) as a `MultKAN` in float64.

    Without `factors` z_j is input j and the width is [n, 1].  With them z_j is the product of the
    named inputs, made by multiplication nodes: width [inputs, [sums, products], 1], whose first
    layer passes inputs on unchanged (pykan's symbolic `x`).

    Args:
        limits: Ends of the grid of every edge.
        intervals: Of every grid.
        coefficients: Of cubic B-splines on uniform knots that go on beyond the grid, (G + 3,) each.
        steps: J_j; where it is not zero pykan's symbolic `sgn` works beside the spline.
        offset: Bias of the output.
        factors: Indices of the inputs of every edge; single ones come first.

    >>> import torch
    >>> kan = additive_kan([(-1.0, 1.0)], 4, [np.ones(7)], [0.5], 2.0)
    >>> kan(torch.tensor([[-0.3], [0.3]], dtype=torch.float64))[:, 0].tolist()
    [2.5, 3.5]
    """
    n = len(limits)
    if factors is None or all(list(f) == [j] for j, f in enumerate(factors)):
        kan, layer, inputs = build_kan([n, 1], intervals, K), 0, n
    else:
        sums, inputs = sum(len(f) == 1 for f in factors), 1 + max(k for f in factors for k in f)
        arity = [[], [len(f) for f in factors[sums:]], []]
        kan = build_kan([inputs, [sums, n - sums], 1], [1, intervals], K, mult_arity=arity, noise=0)
        layer = 1
        for node, source in enumerate(k for f in factors for k in f):
            _symbolic(kan, 0, source, node, "x", 1.0)
    edges = kan.act_fun[layer]
    write(edges.grid, np.array([uniform_extended_knots(a, b, intervals, K) for a, b in limits]))
    scale = read(edges.scale_sp)
    write(edges.coef, np.array([np.asarray(c)[None] / s
                                for c, s in zip(coefficients, scale[:, :1], strict=True)]))
    for j, step in enumerate(steps):
        if step != 0.0:
            _symbolic(kan, layer, j, 0, "sgn", step)
            kan.set_mode(layer, j, 0, mode="ns")
    bias = kan.subnode_bias[layer]
    write(bias, np.full(tuple(bias.shape), offset))
    if layer == 0:
        low, high = np.array(limits).T
        batch = np.random.default_rng(0).uniform(low, high, (500, n))
    else:
        batch = np.random.default_rng(0).uniform(-1.0, 1.0, (500, inputs))
    kan.cache_data = edges.grid.new_tensor(batch)
    return kan


def _symbolic(kan: Any, layer: int, source: int, target: int, name: str, size: float) -> None:
    kan.fix_symbolic(layer, source, target, name, fit_params_bool=False, verbose=False,
                     log_history=False)
    affine = kan.symbolic_fun[layer].affine
    affine.data[target, source] = affine.new_tensor([1.0, 0.0, size, 0.0])
