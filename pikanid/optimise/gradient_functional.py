"""Eq. (2) in torch: the same sites, weights and samples as `Functional`, differentiable in z.

z holds the coefficients of every recording (without those that the initial state decides), then θ
in units of its guess, so that all entries are of the order of one.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from pikanid.approximators import Array
from pikanid.approximators.mlp import MLP
from pikanid.approximators.mlp_adjoint import adjoints
from pikanid.objective.functional import Functional, Sites
from pikanid.optimise.gauss_newton import Point
from pikanid.optimise.gradient import traced_slope
from pikanid.optimise.gradient_adjoint import AtOnce, Parts
from pikanid.simulation.torch_field import TorchField


@dataclass(frozen=True, eq=False)
class _Family:
    """A family of residuals: which of the recording's times it uses, and its constants."""

    at: Tensor | None  # positions among the times; None for all of them in order
    t: Tensor
    u: Tensor
    weight: Tensor
    target: Tensor | None
    output: int

    def of(self, jet: Tensor) -> Tensor:
        """The family's times of a jet (order + 1, times)."""
        return jet if self.at is None else jet[:, self.at]


class TorchFunctional:
    """Data and physics part of Eq. (2), each divided by the number of samples.

    Raises:
        TypeError: An approximator is not an `MLP`.
    """

    def __init__(self, functional: Functional, device: str = "cpu"):
        self.functional, self.device = functional, device
        problem = functional.problem
        self.field = TorchField(problem.model)
        self.unit = np.where(problem.guess != 0.0, np.abs(problem.guess), 1.0)
        self.free = [np.setdiff1d(np.arange(part.n_coefficients), part.held)
                     for part in functional.parts]
        sizes = [len(own) for own in self.free]
        self.sizes = [*sizes, problem.guess.size]
        self._unit = self._tensor(self.unit)
        self._scale = self._tensor(1.0 / functional.scale)
        self.times, self.nets, self.data, self.physics = [], [], [], []
        for part in functional.parts:
            times = np.unique(np.concatenate([s.t for s in (*part.data, part.physics)]))
            self.times.append(times)
            self.nets.append(tuple(_network(a).at(times) for a in part.approximators))
            self.data.append([self._family(times, sites) for sites in part.data])
            self.physics.append(self._family(times, part.physics))
        written = [adjoints(own) for own in self.nets]
        self._adjoints = None if None in written else [own for own in written if own is not None]
        self._places = [[None if f.at is None else f.at.cpu().numpy()
                         for f in (*data, physics)]
                        for data, physics in zip(self.data, self.physics, strict=True)]
        self._first = [self._tensor(e.inputs(np.array([e.t0]))[0]) for e in problem.experiments]
        self._fixed = [[float(v) for v in problem.parameters(problem.guess, r)]
                       for r in range(len(problem.experiments))]

    def __call__(self, z: Tensor) -> tuple[Tensor, Tensor]:
        """Data and physics part at z (n,)."""
        if self._adjoints is not None:
            data, physics = AtOnce.apply(self, z)
            return data, physics
        return self.traced(z)

    def slope(self, z: Array, lam: float) -> tuple[float, float, Array]:
        """Data and physics part at z (n,) and the gradient of data + λ·physics."""
        if self._adjoints is None:
            return traced_slope(self.traced, self.device, z, lam)
        parts = self.parts(z)
        return parts.data, parts.physics, self.packed(*parts.gradient(1.0, lam))

    def traced(self, z: Tensor) -> tuple[Tensor, Tensor]:
        """The same by a graph of every formula, on any device and for any order."""
        data, physics = z.new_zeros(()), z.new_zeros(())
        for families in self._residuals(z):
            *seen, equation = families
            for residual in seen:
                data = data + residual.square().sum()
            physics = physics + equation.square().sum()
        return data / self.functional.n_data, physics / self.functional.n_data

    def parts(self, z: Array) -> Parts:
        """Both parts at z (n,) and what their gradients are made from."""
        assert self._adjoints is not None
        return Parts(self.functional, self._adjoints, self._places, self.unpack(z))

    def packed(self, by_coefficients: Sequence[Array], by_theta: Array) -> Array:
        """A gradient by z (n,) of those by coefficients and by θ."""
        own = [g[free] for g, free in zip(by_coefficients, self.free, strict=True)]
        return np.concatenate([*own, by_theta * self.unit])

    def _residuals(self, z: Tensor) -> Iterator[list[Tensor]]:
        """For every recording its weighted residuals: data families, then physics without λ."""
        *pieces, scaled = torch.split(z, self.sizes)
        theta = (scaled * self._unit).unbind()
        chains = self.functional.chains
        for r, own in enumerate(pieces):
            p: list[Tensor | float] = list(self._fixed[r])
            for position, column in zip(*self.functional.problem.columns(r), strict=True):
                p[position] = theta[column]
            jets = self._jets(r, own, p)
            families = []
            for family in self.data[r]:
                x = self._states([family.of(jet) for jet in jets])
                y = self.field.outputs(family.t, x, family.u, p, only=(family.output,))
                assert family.target is not None
                families.append(family.weight * (y - family.target))
            family = self.physics[r]
            there = [family.of(jet) for jet in jets]
            f = self.field.rhs(family.t, self._states(there), family.u, p, only=chains.top)
            tops = torch.stack([jet[m] for jet, m in zip(there, chains.lengths, strict=True)], 1)
            yield [*families, family.weight * self._scale * (tops - f)]

    def pack(self, point: Point) -> Array:
        """z (n,) of coefficients and θ."""
        own = [c[free] for c, free in zip(point.coefficients, self.free, strict=True)]
        return np.concatenate([*own, point.theta / self.unit])

    def unpack(self, z: Array) -> Point:
        """Coefficients and θ of z (n,)."""
        *pieces, scaled = np.split(z, np.cumsum(self.sizes)[:-1])
        theta = scaled * self.unit
        full = []
        for r, (own, free) in enumerate(zip(pieces, self.free, strict=True)):
            c = np.zeros(self.functional.parts[r].n_coefficients)
            c[free] = own
            full.append(self.functional.complete(r, c, theta))
        return Point(tuple(full), theta)

    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds of z (n,): those of θ; the coefficients have none."""
        problem = self.functional.problem
        none = np.full(sum(self.sizes[:-1]), np.inf)
        return (np.concatenate([-none, problem.lower / self.unit]),
                np.concatenate([none, problem.upper / self.unit]))

    def data_rows(self) -> NDArray[np.bool_]:
        """Which rows of `residual` belong to samples."""
        marks = [np.full(sites.weight.size, sites.target is not None)
                 for r in range(len(self.free)) for sites in self.functional.families(r)]
        return np.concatenate(marks)

    def residual(self, z: Array, lam: float) -> Array:
        """Stacked residual [data; √λ·physics] (rows,) at z, recording after recording."""
        rows = []
        with torch.no_grad():
            for *seen, equation in self._residuals(self._tensor(z)):
                rows += [*seen, np.sqrt(lam) * equation]
        return np.concatenate([row.cpu().numpy().ravel() for row in rows])

    def linearised(self, z: Array, lam: float) -> tuple[Array, Array]:
        """Residual (rows,) and its Jacobian (rows, n) by z.

        Dense: a tanh unit acts everywhere, so that nothing of a basis' locality is left.
        """
        point, functional = self.unpack(z), self.functional
        residuals, jacobians = [], []
        first = 0
        for r, c in enumerate(point.coefficients):
            positions = functional.problem.columns(r)[1]
            tables = self._state_jacobians(r, c)
            follows = functional.hold_jacobian(r, point.theta)
            families = functional.families(r)
            for sites, rows in zip(families, functional.rows(r, c, point.theta, lam), strict=True):
                index = np.searchsorted(self.times[r], sites.t)
                count, width = rows.residual.shape
                by_c = np.zeros((count, width, c.size))
                for s, (i, q) in enumerate(zip(functional.chains.root, functional.chains.order,
                                               strict=True)):
                    if rows.by_state is not None:
                        part = functional.parts[r].physics.tops[i].part
                        by_c[:, :, part] += rows.by_state[:, :, s, None] * tables[i][q][
                            index, None]
                if rows.by_top is not None:
                    for i, m in enumerate(functional.chains.lengths):
                        part = functional.parts[r].physics.tops[i].part
                        by_c[:, i, part] += rows.by_top[:, i, None] * tables[i][m][index]
                full = np.zeros((count * width, z.size))
                flat = by_c.reshape(count * width, -1)
                full[:, first:first + self.sizes[r]] = flat[:, self.free[r]]
                by_theta = np.zeros((count * width, point.theta.size))
                if rows.by_theta is not None:
                    by_theta[:, positions] = rows.by_theta.reshape(count * width, -1)
                if follows is not None:
                    by_theta[:, positions] += flat[:, functional.parts[r].held] @ follows
                full[:, -point.theta.size:] = by_theta * self.unit
                residuals.append(rows.residual.ravel())
                jacobians.append(full)
            first += self.sizes[r]
        return np.concatenate(residuals), np.concatenate(jacobians)

    def _jets(self, r: int, own: Tensor, p: Sequence[Tensor | float]) -> list[Tensor]:
        """Value and derivatives (m + 1, times) of every chain of recording r."""
        part, nets = self.functional.parts[r], self.nets[r]
        if part.held.size:
            x0 = self.field.initial(self._first[r], p)
            start = self._tensor(part.hold) @ x0
            whole = own.new_zeros(part.n_coefficients)
            whole = whole.index_put((torch.as_tensor(part.held, device=own.device),), start)
            own = whole.index_put((torch.as_tensor(self.free[r], device=own.device),), own)
        pieces = torch.split(own, [net.net.n_coefficients for net in nets])
        return [net.jet(c) for net, c in zip(nets, pieces, strict=True)]

    def _states(self, jets: Sequence[Tensor]) -> Tensor:
        chains = self.functional.chains
        return torch.stack([jets[i][q] for i, q in zip(chains.root, chains.order, strict=True)], 1)

    def _state_jacobians(self, r: int, c: Array) -> list[list[Array]]:
        """For every chain the Jacobians (times, n) of its derivatives 0 ... m."""
        found = []
        for i, net in enumerate(self.nets[r]):
            own = self._tensor(c[self.functional.parts[r].physics.tops[i].part])
            rows = net.jacobians(own, tuple(range(self.functional.chains.lengths[i] + 1)))
            found.append([row.detach().cpu().numpy() for row in rows])
        return found

    def _family(self, times: Array, sites: Sites) -> _Family:
        index = np.searchsorted(times, sites.t)
        whole = index.size == times.size
        return _Family(
            None if whole else torch.as_tensor(index, device=self.device), self._tensor(sites.t),
            self._tensor(sites.u), self._tensor(sites.weight),
            None if sites.target is None else self._tensor(sites.target.T), sites.output)

    def _tensor(self, values: Array) -> Tensor:
        return torch.tensor(np.asarray(values, float), dtype=torch.float64, device=self.device)


def _network(approximator: object) -> MLP:
    if not isinstance(approximator, MLP):
        raise TypeError(f"gradient descent is for networks, not {type(approximator).__name__}")
    return approximator
