"""The training loss of a KAN: pykan's forward pass, time derivatives and gradients by autograd."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from torch.func import functional_call

from pikanid.approximators.kan import build_kan
from pikanid.validation.equivalence.setting import Array, Setting


class NetworkLoss:
    """Loss of Eq. (2), summed over samples and collocation points, of a shallow pykan model.

    The unknowns are one vector: coefficients (splines then kinks, outputs), row by row, then p.

    Args:
        setting: The case.
        kan: The model; a fresh [1, outputs] KAN with w_b = 0 on [0, T] unless given.
    """

    def __init__(self, setting: Setting, kan: Any | None = None) -> None:
        self.setting = setting
        self.kan = kan or build_kan([1, setting.outputs], grid=setting.grid, k=setting.degree,
                                    grid_range=(0.0, setting.horizon))
        self._data = torch.tensor(setting.data)
        self._excitation = torch.tensor(setting.model.excitation(setting.collocation_times))

    @property
    def knots(self) -> Array:
        """The model's knots (G + 2k + 1,)."""
        return np.array(self.kan.act_fun[0].grid[0].numpy())

    def curve(self, t: Array, unknowns: Any) -> tuple[Any, Any]:
        """Times (M, 1), which record gradients, and outputs (M, outputs)."""
        rows, outputs = self.setting.shape
        splines = self.setting.grid + self.setting.degree
        table = unknowns[: rows * outputs].reshape(rows, outputs)
        times = torch.tensor(t[:, None], requires_grad=True)
        coef = table[:splines].T[None]
        curve = functional_call(self.kan, {"act_fun.0.coef": coef}, (times,))
        row = splines
        for centre in self.setting.kinks:
            for order, scale in ((2, 0.5), (3, 1.0 / 6.0)):
                power = scale * (times - centre).clamp(min=0.0) ** order
                curve = curve + power * table[row]
                row += 1
        return times, curve

    def residuals(self, unknowns: Any) -> Any:
        """[y - x̂(t_i); √λ physics(τ_m)], (N + M,) or, in state form, (N + 2M,)."""
        _, fitted = self.curve(self.setting.data_times, unknowns)
        times, curve = self.curve(self.setting.collocation_times, unknowns)
        rates = [_slope(curve[:, o], times) for o in range(curve.shape[1])]
        parameters = unknowns[self.setting.shape[0] * self.setting.shape[1] :]
        if self.setting.form == "state":
            x, v = curve[:, 0], curve[:, 1]
            force = self.setting.model.torch(x, v, self._excitation, parameters)
            physics = torch.cat([rates[0] - v, rates[1] - force])
        else:
            force = self.setting.model.torch(curve[:, 0], rates[0], self._excitation, parameters)
            physics = _slope(rates[0], times) - force
        return torch.cat([self._data - fitted[:, 0], float(np.sqrt(self.setting.weight)) * physics])

    def value_and_gradient(self, unknowns: Array) -> tuple[float, Array]:
        """Loss and its gradient, both by torch."""
        place = torch.tensor(unknowns, requires_grad=True)
        loss = (self.residuals(place) ** 2).sum()
        (gradient,) = torch.autograd.grad(loss, place)
        return float(loss.detach()), gradient.numpy().copy()

    def residuals_and_jacobian(self, unknowns: Array) -> tuple[Array, Array]:
        """Residuals (R,) and their Jacobian (R, unknowns), both by torch."""
        place = torch.tensor(unknowns, requires_grad=True)
        residuals = self.residuals(place)
        (jacobian,) = torch.autograd.grad(
            residuals, place, torch.eye(len(residuals), dtype=torch.float64), is_grads_batched=True)
        return residuals.detach().numpy().copy(), jacobian.numpy().copy()


def _slope(values: Any, times: Any) -> Any:
    (slope,) = torch.autograd.grad(values.sum(), times, create_graph=True)
    return slope[:, 0]
