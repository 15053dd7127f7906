"""A pykan model of width [n, 1] from given edges: a sum of splines, steps at zero, an offset."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from pikanid.approximators.kan.build import build_kan, read, write
from pikanid.approximators.kan.plan import Array

K = 3


def additive_kan(limits: Sequence[tuple[float, float]], intervals: int,
                 coefficients: Sequence[Array], steps: Sequence[float], offset: float) -> Any:
    """The function offset + Σ_j spline_j(x_j) + J_j sign(x_j) as a `MultKAN` in float64.

    Args:
        limits: Ends of the grid of every input.
        intervals: Of every grid.
        coefficients: Of cubic B-splines on uniform knots that go on beyond the grid, (G + 3,) each.
        steps: J_j; where it is not zero pykan's symbolic `sgn` works beside the spline.
        offset: Bias of the output.

    >>> import torch
    >>> kan = additive_kan([(-1.0, 1.0)], 4, [np.ones(7)], [0.5], 2.0)
    >>> kan(torch.tensor([[-0.3], [0.3]], dtype=torch.float64))[:, 0].tolist()
    [2.5, 3.5]
    """
    n = len(limits)
    kan = build_kan([n, 1], grid=intervals, k=K, grid_range=limits[0])
    places = np.arange(-K, intervals + K + 1) / intervals
    edges = kan.act_fun[0]
    write(edges.grid, np.array([low + (high - low) * places for low, high in limits]))
    scale = read(edges.scale_sp)
    write(edges.coef, np.array([np.asarray(c)[None] / s for c, s in zip(coefficients, scale[:, :1],
                                                                     strict=True)]))
    for j, step in enumerate(steps):
        if step != 0.0:
            kan.fix_symbolic(0, j, 0, "sgn", fit_params_bool=False, verbose=False,
                             log_history=False)
            kan.symbolic_fun[0].affine.data[0, j] = kan.symbolic_fun[0].affine.new_tensor(
                [1.0, 0.0, step, 0.0])
            kan.set_mode(0, j, 0, mode="ns")
    write(kan.subnode_bias[0], np.full(tuple(kan.subnode_bias[0].shape), offset))
    middle = [[0.5 * (low + high) for low, high in limits]]
    spread = np.random.default_rng(0).uniform(-0.5, 0.5, (500, n)) * np.ptp(limits, axis=1)
    kan.cache_data = edges.grid.new_tensor(np.array(middle) + spread)
    return kan
