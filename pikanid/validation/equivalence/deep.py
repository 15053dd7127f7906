"""The paper's remark on deeper KANs: their local steps are iPDA steps.

At an iterate α the curve moves, to first order, within the span of the tangent functions
Φ_j(t) = ∂x̂(t; α)/∂α_j.  The Gauss-Newton step of the network's loss is the iPDA step, Eq. (5) with
Φ for B, started at the present curve.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from torch.func import functional_call

from pikanid.approximators.kan import DeepKAN, build_kan
from pikanid.validation.equivalence.agreement import GRADIENTS, difference
from pikanid.validation.equivalence.report import Check
from pikanid.validation.equivalence.setting import Array, Setting

_WIDTHS: tuple[list[Any], ...] = (
    [1, 3, 1], [1, 4, 2, 1], [1, [2, 1], 1])  # definition: networks that are compared
# Both systems are solved with the same small damping: the tangent functions of a deep KAN are
# dependent, and without it the step itself would not be unique.
_DAMPING = 1e-6  # numerical: without it the step itself would not be unique


def tangent_step(seed: int = 0, *, quick: bool = False) -> tuple[Check, ...]:
    """Gauss-Newton on the network (torch) against iPDA in the tangent basis (NumPy).

    `quick` takes the systems in turn, one for each width.
    """
    rows = []
    for s, system in enumerate(("sloshing", "duffing")):
        for width in _WIDTHS[s::2] if quick else _WIDTHS:
            setting = Setting(system, "second-order", 4, 8, weight=1e-2, samples=41, seed=seed)
            kan = build_kan(
                width, grid=setting.grid, k=setting.degree,
                grid_range=[(0.0, setting.horizon), *([(-2.0, 2.0)] * (len(width) - 2))], seed=seed,
                noise=4.0, start="waves")
            parameters = np.array(setting.model.truth) * 1.1
            r_a, j_a = _network(setting, kan, parameters)
            r_b, j_b = _ipda(setting, DeepKAN(kan), parameters)
            step_a, step_b = _step(r_a, j_a), _step(r_b, j_b)
            count = parameters.size
            text = f"{width}, {setting.describe()}"
            name = "deep KAN: Gauss-Newton = iPDA in the tangent basis"
            for quantity, a, b in (
                ("residuals", r_a, r_b),
                ("Jacobian", j_a, j_b),
                ("step of the residuals", j_a @ step_a, j_b @ step_b),
                ("step in p", step_a[-count:], step_b[-count:]),
            ):
                rows.append(Check(name, text, quantity, difference(a, b), GRADIENTS))
    return tuple(rows)


def _step(residuals: Array, jacobian: Array) -> Array:
    scale = np.abs(jacobian).max()
    system = np.vstack([jacobian, np.sqrt(_DAMPING) * scale * np.eye(jacobian.shape[1])])
    right = np.concatenate([-residuals, np.zeros(jacobian.shape[1])])
    return np.linalg.lstsq(system, right, rcond=None)[0]


def _network(setting: Setting, kan: Any, parameters: Array) -> tuple[Array, Array]:
    """Residuals and Jacobian in all coefficients and p, by torch alone."""
    names = [f"act_fun.{layer}.coef" for layer in range(kan.depth)]
    shapes = [edges.coef.shape for edges in kan.act_fun]
    flat = [edges.coef.detach().reshape(-1) for edges in kan.act_fun]
    unknowns = torch.cat([*flat, torch.tensor(parameters)]).requires_grad_(True)
    sizes = [part.numel() for part in flat]
    parts = torch.split(unknowns, [*sizes, parameters.size])
    state = {n: v.reshape(s) for n, v, s in zip(names, parts, shapes, strict=False)}
    fitted = functional_call(kan, state, (torch.tensor(setting.data_times[:, None]),))[:, 0]
    times = torch.tensor(setting.collocation_times[:, None], requires_grad=True)
    x = functional_call(kan, state, (times,))
    (v,) = torch.autograd.grad(x.sum(), times, create_graph=True)
    (a,) = torch.autograd.grad(v.sum(), times, create_graph=True)
    u = torch.tensor(setting.model.excitation(setting.collocation_times))
    physics = a[:, 0] - setting.model.torch(x[:, 0], v[:, 0], u, parts[-1])
    data = torch.tensor(setting.data)
    residuals = torch.cat([data - fitted, float(np.sqrt(setting.weight)) * physics])
    rows = [torch.autograd.grad(r, unknowns, retain_graph=True)[0] for r in residuals]
    return residuals.detach().numpy(), torch.stack(rows).numpy()


def _ipda(setting: Setting, deep: DeepKAN, parameters: Array) -> tuple[Array, Array]:
    """Eq. (5), linearised at the present curve, with the tangent functions for a basis."""
    coefficients = deep.coefficients
    now = deep.evaluate(setting.data_times, coefficients, order=0, jacobian=True)
    jet = deep.evaluate(setting.collocation_times, coefficients, jacobian=True)
    x, v, a = (value[:, 0] for value in jet.values)
    basis, rates, accelerations = (table[:, 0] for table in jet.jacobians)
    u = setting.model.excitation(setting.collocation_times)
    force = setting.model.acceleration(x, v, u, parameters)
    by_x, by_v, by_p = setting.model.slopes(x, v, u, parameters)
    root = np.sqrt(setting.weight)
    linear = accelerations - by_x[:, None] * basis - by_v[:, None] * rates
    none = np.zeros((setting.samples, parameters.size))
    residuals = np.concatenate([setting.data - now.values[0][:, 0], root * (a - force)])
    jacobian = np.vstack(
        [np.hstack([-now.jacobians[0][:, 0], none]), root * np.hstack([linear, -by_p])])
    return residuals, jacobian
