"""Jets (q, q', q'') along a path: truncated Taylor arithmetic in derivatives.

The change of an output's jet with the jet of a value z on the way is again a jet a, multiplied by
Leibniz' rule:  δy = a δz,  δy' = a' δz + a δz',  δy'' = a'' δz + 2 a' δz' + a δz''.  The derivative
is the first axis.
"""

from __future__ import annotations

import numpy as np

from pikanid.approximators.kan.plan import Array

BINOMIAL = ((1,), (1, 1), (1, 2, 1))  # definition: Pascal's triangle, row by row


def chain(outer: Array, inner: Array) -> Array:
    """Jet of f(z(s)) from the derivatives of f (d, M, n, ...) and the jet of z (d, M, n)."""
    extra = (None,) * (outer.ndim - inner.ndim)
    jet = np.empty(outer.shape)
    jet[0] = outer[0]
    if len(jet) > 1:
        rate = inner[1][(..., *extra)]
        jet[1] = outer[1] * rate
    if len(jet) > 2:
        jet[2] = outer[2] * rate**2 + outer[1] * inner[2][(..., *extra)]
    return jet


def product(jets: list[Array]) -> Array:
    """Jet of a product by Leibniz' rule."""
    result = jets[0]
    for jet in jets[1:]:
        result = np.stack(
            [
                sum(BINOMIAL[d][e] * result[e] * jet[d - e] for e in range(d + 1))
                for d in range(len(jet))
            ]
        )
    return result


def matrix_product(left: Array, right: Array) -> Array:
    """Jet of a matrix product (d, M, a, b) (d, M, b, c)."""
    return np.stack(
        [
            sum(BINOMIAL[d][e] * np.matmul(left[e], right[d - e]) for e in range(d + 1))
            for d in range(len(left))
        ]
    )
