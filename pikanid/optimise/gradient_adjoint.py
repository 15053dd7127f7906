"""The two parts of Eq. (2) and their gradients, adjoint by adjoint, as one step of a torch graph.

What a graph of every formula would find, in a third of the time: the graph of a network of a
thousand weights spends more on its bookkeeping than on its numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from torch import Tensor

from pikanid.approximators import Array
from pikanid.approximators.mlp_adjoint import Adjoint
from pikanid.objective.functional import Functional
from pikanid.objective.rows import Rows
from pikanid.optimise.gauss_newton import Point


class Parts:
    """Data and physics part at a point, and what their gradients are made from.

    Args:
        functional: Eq. (2).
        nets: Of every recording, one a chain, at `places`' times.
        places: For every recording the positions of each family's times; None for all in order.
        point: Where.
    """

    def __init__(self, functional: Functional, nets: Sequence[Sequence[Adjoint]],
                 places: Sequence[Sequence[Array | None]], point: Point):
        self.functional, self.nets, self.places, self.point = functional, nets, places, point
        self.rows: list[list[Rows]] = []
        chains = functional.chains
        self._order = [(i, q) for i, q in zip(chains.root, chains.order, strict=True)]
        self._tops = list(enumerate(chains.lengths))
        self._sizes: list[int] = []
        data = physics = 0.0
        for r, (own, c) in enumerate(zip(nets, point.coefficients, strict=True)):
            jets = [net.jet(c[top.part]) for net, top in zip(
                own, functional.parts[r].physics.tops, strict=True)]
            self._sizes.append(jets[0].shape[1])
            shown = [*([self._order] * (len(places[r]) - 1)), self._order + self._tops]
            values = [np.stack([jets[i][q] if at is None else jets[i][q][at] for i, q in wanted])
                      for at, wanted in zip(places[r], shown, strict=True)]
            self.rows.append(functional.rows_of(r, values, point.theta, 1.0))
            *seen, equation = self.rows[-1]
            data += sum(float(np.sum(rows.residual**2)) for rows in seen)
            physics += float(np.sum(equation.residual**2))
        self.data, self.physics = data / functional.n_data, physics / functional.n_data

    def gradient(self, data: float, physics: float) -> tuple[list[Array], Array]:
        """That of data·(data part) + physics·(physics part), by coefficients and by θ."""
        functional = self.functional
        by_theta = np.zeros(self.point.theta.size)
        by_coefficients = []
        for r, rows in enumerate(self.rows):
            own = self.nets[r]
            adjoints = [np.zeros((m + 1, self._sizes[r])) for m in functional.chains.lengths]
            columns = functional.problem.columns(r)[1]
            for k, (one, at) in enumerate(zip(rows, self.places[r], strict=True)):
                weight = 2.0 * (physics if k == len(rows) - 1 else data) / functional.n_data
                pull = weight * one.residual
                place: Any = slice(None) if at is None else at
                if one.by_state is not None:
                    pulled = np.einsum("me,men->nm", pull, one.by_state)
                    for (i, q), row in zip(self._order, pulled, strict=True):
                        adjoints[i][q][place] += row
                if one.by_top is not None:
                    for i, m in self._tops:
                        adjoints[i][m][place] += pull[:, i] * one.by_top[:, i]
                if one.by_theta is not None:
                    by_theta[columns] += np.einsum("me,meb->b", pull, one.by_theta)
            found = np.concatenate([net.pull(a) for net, a in zip(own, adjoints, strict=True)])
            held = functional.parts[r].held
            follows = functional.hold_jacobian(r, self.point.theta) if held.size else None
            if follows is not None:
                by_theta[columns] += found[held] @ follows
            by_coefficients.append(found)
        return by_coefficients, by_theta


class AtOnce(torch.autograd.Function):
    """(data, physics) as a function of z, once differentiable; `parts` and `pack` do the work."""

    @staticmethod
    def forward(ctx: Any, loss: Any, z: Tensor) -> tuple[Tensor, Tensor]:
        """Both parts, and what the way back needs."""
        ctx.loss, ctx.parts = loss, loss.parts(z.detach().numpy())
        return z.new_tensor(ctx.parts.data), z.new_tensor(ctx.parts.physics)

    @staticmethod
    def backward(ctx: Any, *pulls: Tensor) -> tuple[None, Tensor]:
        """The gradient by z; the parts may be asked for one at a time."""
        data, physics = (0.0 if p is None else float(p) for p in pulls)
        return None, torch.from_numpy(ctx.loss.packed(*ctx.parts.gradient(data, physics)))
