"""Compiled: jets through a layer of tanh, and their adjoints back through it.

One pass over the memory for all that is elementwise; NumPy would take a dozen over arrays that are
larger than a processor's cache.  Imported only where it is used.
"""

from __future__ import annotations

import numpy as np

from pikanid.storage.jit import cached_jit

_compiled = cached_jit(error_model="numpy", nogil=True)


@_compiled
def forward(sums: np.ndarray, jet: np.ndarray, slope: np.ndarray) -> None:
    """Derivatives of a = tanh s, of which jet[0] holds the values, up to the second.

    sums and jet are (order + 1, n): s and a with their time derivatives; slope (n,) becomes 1 - a².
        ȧ = (1 - a²) ṡ,   ä = (1 - a²) s̈ - 2 a ȧ ṡ
    """
    order = jet.shape[0] - 1
    for i in range(slope.size):
        a = jet[0, i]
        s = 1.0 - a * a
        slope[i] = s
        if order > 0:
            rate = s * sums[1, i]
            jet[1, i] = rate
            if order > 1:
                jet[2, i] = a * rate * sums[1, i] * -2.0 + s * sums[2, i]


@_compiled
def backward(jet: np.ndarray, slope: np.ndarray, adjoint: np.ndarray) -> None:
    """From the adjoint (order + 1, n) of `forward`'s jet to that of its sums, in place.

    See `mlp._TanhJet`.
    """
    order = jet.shape[0] - 1
    for i in range(slope.size):
        s = slope[i]
        value = adjoint[0, i] * s
        if order > 0:
            a, rate, pull = jet[0, i], jet[1, i], adjoint[1, i] * jet[1, i]
            turned = adjoint[1, i] * s
            if order > 1:
                bent = adjoint[2, i] * rate
                pull += adjoint[2, i] * jet[2, i]
                turned += bent * a * -4.0
                adjoint[2, i] *= s
                value += pull * a * -2.0
                value += rate * bent * -2.0
            else:
                value += pull * a * -2.0
            adjoint[1, i] = turned
        adjoint[0, i] = value
