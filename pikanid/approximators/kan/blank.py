"""Bare pykan models of a given plan, and the plan of a model."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np

from pikanid.approximators.kan.plan import KanPlan
from pikanid.approximators.kan.quiet import undisturbed
from pikanid.approximators.kan.tensors import read, tensor, write


def blank_kan(plan: KanPlan, kind: type, device: str = "cpu") -> Any:
    """A KAN of this plan whose coefficients are zero and whose edges are all active.

    Args:
        plan: Shape and knots.
        kind: pykan's `MultKAN`, or a class made from it.
        device: Torch device.
    """
    torch = import_module("torch")
    arity = plan.arity if isinstance(plan.arity, int) else [list(row) for row in plan.arity]
    with undisturbed():
        # One interval is enough to construct: pykan's own start is a dense least-squares solve
        # in the default dtype, and both are replaced right below.
        kan = kind(width=[list(layer) for layer in plan.width], grid=1, k=plan.k, mult_arity=arity,
                   base_fun=plan.base, sp_trainable=False, sb_trainable=plan.base != "zero",
                   auto_save=False, device=device).double()
    for layer in range(plan.depth):
        edges, knots = kan.act_fun[layer], plan.knots[layer]
        edges.num = plan.intervals(layer)
        edges.grid = torch.nn.Parameter(tensor(knots, device), requires_grad=False)
        shape = (*edges.mask.shape, knots.shape[1] - plan.k - 1)
        edges.coef = torch.nn.Parameter(tensor(np.zeros(shape), device))
        write(edges.scale_sp, np.full(shape[:2], 1.0 / np.sqrt(shape[0])))
        write(edges.scale_base, np.zeros(shape[:2]))
        # pykan lets the affine map of an unused symbolic edge ask for gradients.
        kan.symbolic_fun[layer].affine.requires_grad_(False)
    grids = [plan.intervals(layer) for layer in range(plan.depth)]
    kan.grid = grids[0] if len(set(grids)) == 1 else grids
    kan.grid_range = [float(plan.knots[0][0, plan.k]), float(plan.knots[0][0, -plan.k - 1])]
    return kan


def plan_of(kan: Any) -> KanPlan:
    """The plan of an existing pykan model, its knots as they are now."""
    arity = kan.mult_arity
    return KanPlan(
        width=tuple((int(sums), int(products)) for sums, products in kan.width),
        k=int(kan.act_fun[0].k), base=kan.base_fun_name,
        arity=int(arity) if kan.mult_homo else tuple(tuple(map(int, row)) for row in arity),
        knots=tuple(read(edges.grid) for edges in kan.act_fun))
