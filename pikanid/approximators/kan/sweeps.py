"""What deep KANs hand out along a path, and what their two sweeps leave for each other."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pikanid.approximators.kan.jets import BINOMIAL
from pikanid.approximators.kan.plan import Array


@dataclass(frozen=True, eq=False)
class KanJet:
    """Outputs along a path and how they change with the coefficients.

    Attributes:
        values: value, first and second derivative, each (M, outputs).
        jacobians: their derivatives by the coefficients, each (M, outputs, n_coefficients); empty
            where they were not asked for.
        inputs: derivative of the values by the inputs (M, outputs, inputs), with the Jacobians.
    """

    values: tuple[Array, ...]
    jacobians: tuple[Array, ...] = ()
    inputs: Array | None = None


@dataclass(frozen=True, eq=False)
class LocalJet:
    """The Jacobians of a one-input, one-output KAN along time, its first layer kept local.

    Attributes:
        first: first active spline of the first layer (M,).
        near: derivatives by its active coefficients, each (M, (k + 1)·S): spline after spline, in
            each the S subnodes.
        far: derivatives by all other coefficients (scale_base of the first layer, then the later
            layers), each (M, n_far).
    """

    first: NDArray[np.int64]
    near: tuple[Array, ...]
    far: tuple[Array, ...]


@dataclass(eq=False)
class Sweep:
    """What the backward sweep needs of the forward one, for one layer."""

    first: NDArray[np.int64]
    local: Array  # jets of the active basis functions (d, M, inputs, k + 1)
    base: Array | None  # jets of the base function (d, M, inputs)
    slope: Array  # jets of the edges' slopes (d, M, inputs, subnodes)
    factor: Array  # jets of the subnodes (d, M, subnodes)


def edge_parts(adjoint: Array, sweep: Sweep) -> Iterator[Array]:
    """A jet (M, o, subnodes) times one (M, inputs, k+1): (M, inputs, k+1, o, subnodes)."""
    for d in range(len(adjoint)):
        yield sum(
            BINOMIAL[d][e] * adjoint[e][:, None, None] * sweep.local[d - e][..., None, None]
            for e in range(d + 1)
        )
