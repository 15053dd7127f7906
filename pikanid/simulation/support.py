"""Small compiled functions that generated models call."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from pikanid.simulation.layout import STEEP, Seen, work_dtype
from pikanid.storage.jit import cached_jit

# generated models find everything they need in this module
__all__ = ["STEEP", "Seen", "work_dtype"]


_Function = TypeVar("_Function", bound=Callable[..., Any])


def kernel(function: _Function) -> _Function:
    """Compile a function that allocates nothing, without numba's reference counting."""
    return cached_jit(error_model="numpy", _nrt=False)(function)


@kernel
def solve_small(matrix: np.ndarray, right: np.ndarray) -> None:
    """Solve in place by Gauss-Jordan elimination; a row without a pivot gives zero."""
    n, columns = right.shape
    for i in range(n):
        best = i
        for r in range(i + 1, n):
            if abs(matrix[r, i]) > abs(matrix[best, i]):
                best = r
        if matrix[best, i] == 0.0:
            continue
        for j in range(n):
            matrix[i, j], matrix[best, j] = matrix[best, j], matrix[i, j]
        for j in range(columns):
            right[i, j], right[best, j] = right[best, j], right[i, j]
        for r in range(n):
            if r != i and matrix[r, i] != 0.0:
                factor = matrix[r, i] / matrix[i, i]
                for j in range(n):
                    matrix[r, j] -= factor * matrix[i, j]
                for j in range(columns):
                    right[r, j] -= factor * right[i, j]
    for i in range(n):
        for j in range(columns):
            right[i, j] = right[i, j] / matrix[i, i] if matrix[i, i] != 0.0 else 0.0


@kernel
def positive_power(base: float, n: float) -> float:
    """baseⁿ for base > 0; at base <= 0 zero (one for n = 0), so that no infinity arises there."""
    if base <= 0.0:
        return 1.0 if n == 0.0 else 0.0
    return base**n


@kernel
def power_slope(base: float, n: float) -> float:
    """n·baseⁿ⁻¹ for base > 0, else zero; zero as well below 1e-6 where n < 1 (see `lowering`)."""
    if base <= 0.0 or (n < 1.0 and base < STEEP):
        return 1.0 if n == 1.0 else 0.0
    return n * base ** (n - 1.0)


@kernel
def log_abs(x: float) -> float:
    """ln|x|, and 0 at x = 0, where it only multiplies |x|ⁿ = 0."""
    return 0.0 if x == 0.0 else math.log(abs(x))


@kernel
def sgn(x: float) -> float:
    """The sign of x as a float."""
    return 1.0 if x > 0.0 else (-1.0 if x < 0.0 else 0.0)


@kernel
def spline_basis(knots: np.ndarray, degree: int, z: float, order: int, out: np.ndarray) -> int:
    """Values at z of the `order`-th derivatives of the degree+1 B-splines that live there.

    Cox-de Boor recursion (de Boor, A Practical Guide to Splines, 2001, ch. X).  Outside the base
    interval the outermost polynomial pieces go on.  Returns the index of the first of them.
    """
    low, high = degree, len(knots) - degree - 2
    while low < high:
        middle = (low + high + 1) // 2
        if knots[middle] <= z:
            low = middle
        else:
            high = middle - 1
    span = low
    out[:] = 0.0
    if order > degree:
        return span - degree
    base = degree - order
    out[base] = 1.0
    for d in range(1, base + 1):
        for r in range(base - d, base + 1):
            i = span - base + r
            value = 0.0
            width = knots[i + d] - knots[i]
            if width > 0.0 and r > base - d:
                value += (z - knots[i]) / width * out[r]
            width = knots[i + d + 1] - knots[i + 1]
            if width > 0.0 and r < base:
                value += (knots[i + d + 1] - z) / width * out[r + 1]
            out[r] = value
    for d in range(base + 1, degree + 1):
        # each pass turns derivatives of degree d-1 splines into one derivative more at degree d
        for r in range(d, -1, -1):
            i = span - d + r
            value = 0.0
            width = knots[i + d] - knots[i]
            if width > 0.0 and r > 0:
                value += d / width * out[r - 1]
            width = knots[i + d + 1] - knots[i + 1]
            if width > 0.0 and r < d:
                value -= d / width * out[r]
            out[r] = value
    return span - degree
