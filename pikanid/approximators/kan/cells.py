"""Uniform B-splines cell by cell: in every grid cell the same k + 1 polynomials."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from pikanid.approximators.kan.plan import Array

Index = NDArray[np.int64]


@lru_cache(maxsize=32)
def cell_polynomials(degree: int, derivatives: int) -> Array:
    """Power coefficients (degree + 1 powers, derivatives + 1, degree + 1 functions) in u ∈ [0, 1].

    Cox-de Boor on integer knots: b_r^k = ((u + k - r) b_{r-1}^{k-1} + (r + 1 - u) b_r^{k-1}) / k
    for the function whose support began k - r cells before.

    >>> cell_polynomials(1, 0)[:, 0]
    array([[ 1.,  0.],
           [-1.,  1.]])
    """
    pieces = np.array([[1.0]])  # (functions, powers)
    for k in range(1, degree + 1):
        higher = np.zeros((k + 1, k + 1))
        for r in range(k + 1):
            if r > 0:
                higher[r, :-1] += (k - r) * pieces[r - 1]
                higher[r, 1:] += pieces[r - 1]
            if r < k:
                higher[r, :-1] += (r + 1) * pieces[r]
                higher[r, 1:] -= pieces[r]
        pieces = higher / k
    table = np.zeros((derivatives + 1, degree + 1, degree + 1))
    for order in range(derivatives + 1):
        table[order, :, : pieces.shape[1]] = pieces
        pieces = pieces[:, 1:] * np.arange(1, pieces.shape[1])
    return np.ascontiguousarray(table.transpose(2, 0, 1))


def local_bases(x: Array, start: Array, step: Array, intervals: int, degree: int,
                derivatives: int) -> tuple[Index, Array]:
    """First active function (M, n) and active values (M, n, derivatives + 1, degree + 1).

    Args:
        x: Arguments (M, n); each column has its own uniform grid.
        start: First grid points (n,).
        step: Spacings (n,).
        intervals: Grid intervals G.
        degree: Spline degree k.
        derivatives: Highest derivative.

    As in pykan, functions fade out over the k cells on either side of the grid and are zero beyond;
    the last grid point belongs to the last cell, so that all its derivatives come from inside.
    """
    # Far away is as good as just outside, and cannot overflow.
    place = np.clip((x - start) / step, -degree - 1.0, intervals + degree + 1.0)
    stop = start + step * intervals
    cell = np.floor(place if np.isfinite(place).all() else np.nan_to_num(place)).astype(np.int64)
    np.copyto(cell, intervals - 1, where=(x <= stop) & (cell >= intervals))
    inside = (cell >= 0) & (cell < intervals)
    u = place - cell
    if not inside.all():
        u = np.clip(u, 0.0, 1.0)
    powers = np.ones((*x.shape, degree + 1))
    for power in range(1, degree + 1):
        np.multiply(powers[..., power - 1], u, out=powers[..., power])
    table = cell_polynomials(degree, derivatives)
    values = (powers.reshape(-1, degree + 1) @ table.reshape(degree + 1, -1)).reshape(
        *x.shape, derivatives + 1, degree + 1)
    values *= (step[:, None] ** -np.arange(derivatives + 1.0))[:, :, None]
    if inside.all():
        return cell, values
    first = np.clip(cell, 0, intervals - 1)
    # Shift what is left of the functions to where the basis exists.
    source = np.arange(degree + 1) + (first - cell)[..., None]
    there = (source >= 0) & (source <= degree)
    source = np.broadcast_to(np.clip(source, 0, degree)[..., None, :], values.shape)
    return first, np.take_along_axis(values, source, axis=-1) * there[..., None, :]
