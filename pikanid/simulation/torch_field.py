"""Right-hand side and outputs of a model inside torch graphs, for descent along gradients.

The formulas are `VectorField`'s, evaluated by NumPy together with their exact first derivatives,
from which torch goes on: as fast as formulas in torch's own operations, of which it needs none.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from torch import Tensor

from pikanid.model import Model
from pikanid.problem.evaluated import initial_state
from pikanid.simulation.vectorfield import Linearised, VectorField

Parameters = Tensor | Sequence[Tensor | float]


class TorchField:
    """Torch functions of a model; differentiable once.

    Arguments: t (M,), x (M, n), u (M, m), p: all parameters in model order, as a tensor (P,) or as
    a list of numbers and scalar tensors, of which the numbers cost no gradient.

    >>> from pikanid.model.systems import sloshing
    >>> field = TorchField(sloshing())
    >>> p = torch.tensor([0.045, 0.15, 0.3, 9.81], dtype=torch.float64)
    >>> x = torch.tensor([[0.0, 1.0]], dtype=torch.float64)
    >>> field.rhs(torch.zeros(1), x, torch.zeros(1, 2), p)
    tensor([[ 1.0000, -0.5000]], dtype=torch.float64)
    """

    def __init__(self, model: Model):
        self.model, self.field = model, VectorField(model)

    def rhs(self, t: Tensor, x: Tensor, u: Tensor, p: Parameters,
            only: Sequence[int] | None = None) -> Tensor:
        """f (M, n), or the columns of the states `only`."""
        rows = range(len(self.model.states)) if only is None else only
        free, theta, values = _split(p, x)
        return _Formulas.apply(self.field.linearised_rhs(rows, free), values, t, u, x, theta)

    def outputs(self, t: Tensor, x: Tensor, u: Tensor, p: Parameters,
                only: Sequence[int] | None = None) -> Tensor:
        """y = h (M, q), or the columns of the outputs `only`."""
        rows = range(len(self.model.outputs)) if only is None else only
        free, theta, values = _split(p, x)
        return _Formulas.apply(self.field.linearised_outputs(rows, free), values, t, u, x, theta)

    def initial(self, u: Tensor, p: Parameters) -> Tensor:
        """The initial state x0 (n,) for the first inputs u (m,)."""
        free, theta, values = _split(p, u)
        return _Start.apply(self.model, free, values, u, theta)


class _Formulas(torch.autograd.Function):
    """Rows (M, E) of f or h as a function of x (M, n) and of free parameters (b,)."""

    @staticmethod
    def forward(ctx: Any, formulas: Linearised, p: np.ndarray, t: Tensor, u: Tensor, x: Tensor,
                theta: Tensor) -> Tensor:
        with np.errstate(all="ignore"):
            times, states, inputs = (a.detach().cpu().numpy() for a in (t, x, u))
            values, *slopes = formulas(times, states, inputs, p)
        ctx.slopes = [torch.as_tensor(s, device=x.device) for s in slopes]
        return torch.as_tensor(values, device=x.device)

    @staticmethod
    def backward(ctx: Any, *pulls: Tensor) -> tuple[Tensor | None, ...]:
        by_x, by_theta = ctx.slopes
        (pull,) = pulls
        return (None, None, None, None, torch.einsum("me,men->mn", pull, by_x),
                torch.einsum("me,meb->b", pull, by_theta))


class _Start(torch.autograd.Function):
    """The initial state (n,) as a function of free parameters (b,)."""

    @staticmethod
    def forward(ctx: Any, model: Model, free: Sequence[int], p: np.ndarray, u: Tensor,
                theta: Tensor) -> Tensor:
        start, inputs = initial_state(model), u.detach().cpu().numpy()
        ctx.slope = torch.as_tensor(start.jacobian(p, inputs)[:, list(free)], device=u.device)
        return torch.as_tensor(start.value(p, inputs), device=u.device)

    @staticmethod
    def backward(ctx: Any, *pulls: Tensor) -> tuple[Tensor | None, ...]:
        return None, None, None, None, pulls[0] @ ctx.slope


def _split(p: Parameters, like: Tensor) -> tuple[tuple[int, ...], Tensor, np.ndarray]:
    """Which parameters are tensors, these (b,), and the values of all (P,)."""
    entries = p.unbind() if isinstance(p, Tensor) else p
    free = tuple(k for k, entry in enumerate(entries) if isinstance(entry, Tensor))
    theta = torch.stack([torch.as_tensor(entries[k]) for k in free]) if free else like.new_zeros(0)
    values = np.array([float(e) if isinstance(e, float) else np.nan for e in entries])
    values[list(free)] = theta.detach().cpu().numpy()
    return free, theta, values
