"""Jets of a network and their adjoint, written out in NumPy: a third of what a torch graph takes.

Layers are the same as in `mlp`; the first one is an outer product, since its input is time alone.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch

from pikanid.approximators import Array
from pikanid.approximators.mlp import MLPAt

HIGHEST = 2  # definition: order of the derivatives that are written out here


class Adjoint:
    """Of a network on the CPU at fixed times (M,), for one thread: memory is used again.

    Args:
        at: The network at these times, of an order up to `HIGHEST`.
    """

    def __init__(self, at: MLPAt):
        self.at = at
        self._time = at._inputs[0, :, 0].numpy()
        self._rate = float(at._inputs[1, 0, 0]) if at.order else 0.0
        self._linear = at._linear.numpy()
        self._gate = None if at._gate is None else at._gate.numpy()
        self._ends = np.cumsum(at._sizes)[:-1]
        size = (at.order + 1, self._time.size)
        self._jets = [np.empty((*size, width)) for width in at.net.hidden]
        self._sums = [np.empty((*size, width)) for width in at.net.hidden]
        self._backs = [np.empty((*size, width)) for width in at.net.hidden]
        self._slopes = [np.empty((size[1], width)) for width in at.net.hidden]
        self._sums[0][2:] = 0.0  # the first layer's: time has no second derivative
        self._weights: list[Array] = []

    def jet(self, c: Array) -> Array:
        """Value and derivatives (order + 1, M) for coefficients c (n,)."""
        from pikanid.approximators.mlp_layers import forward

        net = self.at.net
        linear, *self._weights = np.split(c, self._ends)
        last = len(net.hidden)
        for layer in range(last):
            matrix, bias = self._layer(layer)
            sums, jet, s = self._sums[layer], self._jets[layer], self._slopes[layer]
            if layer == 0:
                np.multiply.outer(self._time, matrix[0], out=sums[0])
                sums[1:2] = self._rate * matrix[0]
            else:
                np.matmul(self._flat(self._jets[layer - 1]), matrix, out=self._flat(sums))
            np.add(sums[0], bias, out=jet[0])
            torch.from_numpy(jet[0]).tanh_()  # twice as fast as NumPy's
            forward(self._planes(sums), self._planes(jet), s.ravel())
        out = (self._jets[-1] @ self._layer(last)[0])[:, :, 0]
        out[0] += self._weights[-1]
        out *= net.scale
        if self._gate is not None:
            out = _product(self._gate, out)
        elif net.offset != 0.0:
            out[0] += net.offset
        return out + self._linear @ linear if net.n_linear else out

    def pull(self, adjoint: Array) -> Array:
        """The gradient (n,) by c of Σ adjoint·jet, adjoint (order + 1, M), at the last `jet`."""
        from pikanid.approximators.mlp_layers import backward

        net = self.at.net
        grads: list[Array] = [np.einsum("kmn,km->n", self._linear, adjoint)]
        if self._gate is not None:
            adjoint = _product_adjoint(self._gate, adjoint)
        adjoint = net.scale * adjoint
        last = len(net.hidden)
        found = [np.array([adjoint[0].sum()])]
        found.append(self._flat(self._jets[-1]).T @ adjoint.ravel())
        back = self._backs[-1]
        np.multiply.outer(adjoint, self._layer(last)[0][:, 0], out=back)
        for layer in reversed(range(last)):
            back = self._backs[layer]
            backward(self._planes(self._jets[layer]), self._slopes[layer].ravel(),
                     self._planes(back))
            found.append(back[0].sum(0))
            if layer == 0:
                by_matrix = self._time @ back[0]
                if len(back) > 1:
                    by_matrix = by_matrix + self._rate * back[1].sum(0)
                found.append(by_matrix)
                break
            found.append((self._flat(self._jets[layer - 1]).T @ self._flat(back)).ravel())
            np.matmul(self._flat(back), self._layer(layer)[0].T,
                      out=self._flat(self._backs[layer - 1]))
        return np.concatenate([*grads, *reversed(found)])

    def _layer(self, layer: int) -> tuple[Array, Array]:
        shapes = self.at.net.shapes
        return (self._weights[2 * layer].reshape(shapes[2 * layer]), self._weights[2 * layer + 1])

    @staticmethod
    def _flat(jets: Array) -> Array:
        return jets.reshape(-1, jets.shape[-1])

    @staticmethod
    def _planes(jets: Array) -> Array:
        return jets.reshape(len(jets), -1)


def _product(gate: Array, jet: Array) -> Array:
    """Jet of a product, up to the second derivative."""
    return np.stack([
        gate[0] * jet[0],
        *([gate[0] * jet[1] + gate[1] * jet[0]] if len(jet) > 1 else []),
        *([gate[0] * jet[2] + 2.0 * gate[1] * jet[1] + gate[2] * jet[0]] if len(jet) > 2 else [])])


def _product_adjoint(gate: Array, adjoint: Array) -> Array:
    """Adjoint of the second factor's jet."""
    found = gate[0] * adjoint
    if len(adjoint) > 1:
        found[0] += gate[1] * adjoint[1]
    if len(adjoint) > 2:
        found[0] += gate[2] * adjoint[2]
        found[1] += 2.0 * gate[1] * adjoint[2]
    return found


def adjoints(tables: Sequence[MLPAt]) -> list[Adjoint] | None:
    """Of every network, or None where one is on a GPU or of too high an order."""
    if any(t.order > HIGHEST or t.net.device != "cpu" for t in tables):
        return None
    return [Adjoint(t) for t in tables]
