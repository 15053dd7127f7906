"""A multi-layer perceptron of tanh units as a trajectory: x̂(t) = offset + scale·N(τ), |τ| <= 1.

Time derivatives are carried forward through the layers as a jet (value, first, ... derivative): one
pass forwards and one backwards give the gradient of any function of all of them, without nested
differentiation.  With z = (z, z', z'') before a unit and a = tanh z, s = 1 - a²:

    a' = s z',    a'' = s z'' - 2 a z' a'.

Two additions are optional: an initial state that holds exactly, because the network is multiplied
by a gate that is flat at the start, and kinks where an input switches, which no smooth unit can
follow.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from itertools import pairwise
from math import comb, factorial
from typing import Any

import numpy as np
import torch
from numpy.polynomial import Polynomial
from torch import Tensor

from pikanid.approximators import Array
from pikanid.approximators.decaying import Decaying, exponential

KINK_ORDERS = 3  # numerical: a switch shows in the m-th derivative and hardly in the third next


@dataclass(frozen=True)
class MLP:
    """One scalar function of time on [start, stop].

    Coefficients (n,): the initial jet (m,) where `anchored`, kink amplitudes, then weights and
    biases layer by layer.

    Args:
        start, stop: Interval [s] that the network's input scaling maps to [-1, 1].
        order: m, the order of the differential equation: the highest derivative wanted.
        hidden: Units of every hidden layer.
        offset, scale: Of the output, in the unit of the state.
        rate: [1/s] how fast the state moves; sets the widths of the gate and of the kinks.
        anchored: Whether x̂ and its m - 1 derivatives at `start` are coefficients of their own.
        kinks: Times [s] at which the m-th derivative may jump.
        device: Torch device.

    >>> net = MLP(0.0, 5.0, order=2, hidden=(8, 8))
    >>> c = net.initial(seed=0)
    >>> t, h = np.array([1.0]), 1e-5
    >>> slope = (net.values(t + h, c) - net.values(t - h, c)) / (2 * h)
    >>> bool(np.allclose(slope, net.values(t, c, 1), atol=1e-8))
    True
    """

    start: float
    stop: float
    order: int = 1
    hidden: tuple[int, ...] = (32, 32, 32)
    offset: float = 0.0
    scale: float = 1.0
    rate: float = 1.0
    anchored: bool = False
    kinks: tuple[float, ...] = ()
    device: str = field(default="cpu", repr=False)

    @property
    def n_linear(self) -> int:
        """Number of leading coefficients in which the curve is linear."""
        return self.order * self.anchored + KINK_ORDERS * len(self.kinks)

    @cached_property
    def shapes(self) -> tuple[tuple[int, ...], ...]:
        """Shapes of weights and biases, layer by layer."""
        widths = (1, *self.hidden, 1)
        return tuple(shape for a, b in pairwise(widths)
                     for shape in ((a, b), (b,)))

    @property
    def n_coefficients(self) -> int:
        """Number of adjustable coefficients."""
        return self.n_linear + sum(int(np.prod(shape)) for shape in self.shapes)

    def initial(self, seed: int, spread: float = 0.0) -> Array:
        """Starting coefficients: Glorot's uniform weights, biases and linear coefficients zero.

        With `spread` > 0 the first layer is a row of steps all over the interval, up to `spread`
        steep, instead of slopes about its middle (Glorot & Bengio, AISTATS 2010).
        """
        rng = np.random.default_rng(seed)
        pieces = [np.zeros(self.n_linear)]
        for layer, shape in enumerate(self.shapes):
            if len(shape) == 1:
                pieces.append(np.zeros(shape))
                continue
            bound = np.sqrt(6.0 / sum(shape))
            pieces.append(rng.uniform(-bound, bound, shape).ravel())
            if layer == 2 and spread > 0.0:
                width = self.shapes[0][1]
                centres = np.linspace(-1.0, 1.0, width) + rng.uniform(-1.0, 1.0, width) / width
                slopes = rng.uniform(0.5, 1.0, width) * rng.choice([-1.0, 1.0], width) * spread
                pieces[1], pieces[2] = slopes, -slopes * centres
        return np.concatenate(pieces)

    def at(self, t: Array, order: int | None = None) -> MLPAt:
        """The network at fixed times t (M,), ready to be evaluated for many coefficients."""
        t = np.ascontiguousarray(t, dtype=float)
        return _at(self, t.tobytes(), self.order if order is None else order)

    def values(self, t: Array, coefficients: Array, derivative: int = 0) -> Array:
        """The `derivative`-th time derivative at t (M,), shape (M,)."""
        with torch.no_grad():
            jet = self.at(t, derivative).jet(self._tensor(coefficients))
        return jet[derivative].cpu().numpy()

    def jacobian(self, t: Array, coefficients: Array, derivative: int = 0) -> Array:
        """Derivative of `values` with respect to the coefficients, shape (M, n)."""
        table = self.at(t, derivative)
        return table.jacobians(self._tensor(coefficients), (derivative,))[0].cpu().numpy()

    def _tensor(self, values: Array) -> Tensor:
        return torch.tensor(np.asarray(values, float), dtype=torch.float64, device=self.device)


class MLPAt:
    """A network at fixed times (M,): what does not depend on its coefficients, computed once."""

    def __init__(self, net: MLP, t: Array, order: int):
        self.net, self.order = net, order
        half = 0.5 * (net.stop - net.start)
        inputs = np.zeros((order + 1, t.size, 1))
        inputs[0, :, 0] = (t - net.start) / half - 1.0
        if order > 0:
            inputs[1] = 1.0 / half
        self._inputs = net._tensor(inputs)
        linear = np.empty((order + 1, t.size, net.n_linear))
        for column, curve in enumerate(_linear_curves(net)):
            linear[:, :, column] = curve.jet(t, order)
        self._linear = net._tensor(linear)
        self._gate = net._tensor(_gate(net).jet(t, order)) if net.anchored else None
        self._sizes = [net.n_linear, *(int(np.prod(shape)) for shape in net.shapes)]

    def jet(self, c: Tensor) -> Tensor:
        """Value and derivatives (order + 1, M) for coefficients c (n,); differentiable in c."""
        return self._forward(c)[0]

    def _forward(self, c: Tensor, watch: list[tuple[Tensor, Tensor]] | None = None
                 ) -> tuple[Tensor, list[tuple[Tensor, Tensor]]]:
        """The jet, and (inputs, sums) of every layer where `watch` collects them."""
        net = self.net
        linear, *weights = torch.split(c, self._sizes)
        jet = self._inputs
        last = len(net.shapes) // 2 - 1
        for layer in range(last + 1):
            matrix = weights[2 * layer].view(net.shapes[2 * layer])
            sums = torch.matmul(jet, matrix)
            if watch is not None:
                sums = sums.detach().requires_grad_() if not watch else sums
                watch.append((jet, sums))
            bias = weights[2 * layer + 1]
            jet = _activated(sums, bias) if layer < last else sums
        jet = jet.squeeze(-1)
        jet = net.scale * torch.cat([jet[:1] + weights[-1], jet[1:]])
        if self._gate is not None:
            jet = _product(self._gate, jet)
        elif net.offset != 0.0:
            jet = torch.cat([jet[:1] + net.offset, jet[1:]])
        if net.n_linear:
            jet = jet + self._linear @ linear
        return jet, watch or []

    def jacobians(self, c: Tensor, derivatives: tuple[int, ...]) -> list[Tensor]:
        """Derivatives of x̂ and of its time derivatives by the coefficients, (M, n) each.

        A sample depends on its own jets alone, so that one backward pass of the sum over all
        samples yields every row: the row of a weight is the product of its input and its adjoint.
        """
        with torch.enable_grad():
            watched: list[tuple[Tensor, Tensor]] = []
            jet, watched = self._forward(c.detach(), watched)
            rows = []
            for q in derivatives:
                # The bias of the last layer enters after the gate's product with a constant.
                gate = self._gate[q] if self._gate is not None else torch.full_like(
                    jet[0], float(q == 0))
                adjoints = torch.autograd.grad(
                    jet[q].sum(), [sums for _, sums in watched], retain_graph=True,
                    allow_unused=True)
                pieces = [self._linear[q]]
                for (inputs, sums), found in zip(watched, adjoints, strict=True):
                    adjoint = torch.zeros_like(sums) if found is None else found
                    pieces.append(torch.einsum("kmi,kmo->mio", inputs.detach(), adjoint)
                                  .reshape(sums.shape[1], -1))
                    pieces.append(adjoint[0])
                pieces[-1] = self.net.scale * gate[:, None]
                rows.append(torch.cat(pieces, dim=1))
        return rows


@lru_cache(maxsize=64)
def _at(net: MLP, times: bytes, order: int) -> MLPAt:
    """Kept, because an optimiser asks for the same times again and again."""
    return MLPAt(net, np.frombuffer(times), order)


def _activated(sums: Tensor, bias: Tensor) -> Tensor:
    """Jet of tanh(z + bias) from the jet of z (order + 1, M, units)."""
    if sums.shape[0] <= 3:
        return _TanhJet.apply(sums, bias)
    return _tanh_series(sums, bias)


class _TanhJet(torch.autograd.Function):
    """Jets up to the second derivative, with the adjoint written out: a third of autograd's time.

    From a' = s z' and a'' = s z'' - 2 a z' a':
    ∂a'/∂z = -2 a a',  ∂a''/∂z' = -4 a a',  ∂a''/∂z = -2 a a'' - 2 a'².
    """

    @staticmethod
    def forward(ctx: Any, sums: Tensor, bias: Tensor) -> Tensor:
        jet = torch.empty_like(sums)
        a = torch.add(sums[0], bias, out=jet[0]).tanh_()
        s = torch.addcmul(torch.ones_like(a), a, a, value=-1.0)
        if len(sums) > 1:
            rate = torch.mul(s, sums[1], out=jet[1])
        if len(sums) > 2:
            torch.mul(s, sums[2], out=jet[2])
            jet[2].addcmul_(a * sums[1], rate, value=-2.0)
        ctx.save_for_backward(jet, s)
        return jet

    @staticmethod
    def backward(ctx: Any, *grads: Tensor) -> tuple[Tensor, Tensor]:
        jet, s = ctx.saved_tensors
        grad = grads[0]
        back = grad * s
        if len(jet) > 1:
            a, rate = jet[0], jet[1]
            inner = grad[1] * rate
            if len(jet) > 2:
                inner.addcmul_(grad[2], jet[2])
                bent = grad[2] * rate
                back[1].addcmul_(a, bent, value=-4.0)
                back[0].addcmul_(rate, bent, value=-2.0)
            back[0].addcmul_(a, inner, value=-2.0)
        return back, back[0].sum(0)


def _tanh_series(sums: Tensor, bias: Tensor) -> Tensor:
    """Any order, by the Taylor series of a' = (1 - a²) z' (Griewank & Walther, 2008, ch. 13)."""
    z = [sums[0] + bias, *(sums[k] / factorial(k) for k in range(1, len(sums)))]
    a, s = [torch.tanh(z[0])], []
    for k in range(len(z) - 1):
        square = sum((a[i] * a[k - i] for i in range(1, k + 1)), a[0] * a[k])
        s.append(1.0 - square if k == 0 else -square)
        a.append(sum((j * z[j] * s[k + 1 - j] for j in range(2, k + 2)), z[1] * s[k]) / (k + 1))
    return torch.stack([factorial(k) * term for k, term in enumerate(a)])


def _product(left: Tensor, right: Tensor) -> Tensor:
    """Jet of a product by Leibniz' rule."""
    terms = []
    for d in range(len(left)):
        term = left[d] * right[0]
        for e in range(1, d + 1):
            term = term + comb(d, e) * left[d - e] * right[e]
        terms.append(term)
    return torch.stack(terms)


def _gate(net: MLP) -> Decaying:
    """Rises from 0 to 1; it and its m - 1 derivatives are zero at the start."""
    return Decaying(-exponential(net.order), net.rate, net.start, constant=1.0)


def _linear_curves(net: MLP) -> list[Decaying]:
    """One curve a leading coefficient: initial jet, then kinks."""
    curves = []
    for q in range(net.order * net.anchored):
        power = Polynomial([*np.zeros(q), 1.0 / factorial(q)])
        curves.append(Decaying(power * exponential(net.order - q), net.rate, net.start,
                                size=net.rate**-q))
    for centre in net.kinks:
        for q in range(net.order, net.order + KINK_ORDERS):
            power = Polynomial([*np.zeros(q), 1.0 / factorial(q)])
            curves.append(Decaying(power, net.rate, centre, size=net.scale))
    return curves
