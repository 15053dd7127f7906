"""SymPy formulas of the formula language as NumPy functions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
import sympy as sp

Array = np.ndarray
Compiled = Callable[..., list[Array]]


def _abs_power(x: Array, n: Array) -> Array:
    with np.errstate(divide="ignore"):
        return np.abs(x) ** np.asarray(n, float)


def _signed_power(x: Array, n: Array) -> Array:
    return np.sign(x) * _abs_power(x, n)


def _log_abs(x: Array) -> Array:
    size = np.abs(x)
    return np.log(np.where(size > 0.0, size, 1.0))


def _clip(x: Array, low: Array, high: Array) -> Array:
    return np.minimum(np.maximum(x, low), high)


def _step(x: Array, middle: float = 0.5) -> Array:
    return np.heaviside(x, middle)


def _nowhere(x: Array, *_: Any) -> Array:
    """The derivative of a step, which no sample meets."""
    return np.zeros(np.shape(x))


_FUNCTIONS: dict[str, Any] = {
    "abs_power": _abs_power, "signed_power": _signed_power, "log_abs": _log_abs, "clip": _clip,
    "Heaviside": _step, "DiracDelta": _nowhere,
}


@lru_cache(maxsize=2048)
def compiled(arguments: tuple[sp.Symbol, ...], exprs: tuple[sp.Expr, ...]) -> Compiled:
    """Formulas as one function of arrays that broadcast; values outside a domain are NaN or inf.

    >>> x = sp.Symbol("x", real=True)
    >>> [v.tolist() for v in compiled((x,), (x**2, sp.Integer(3)))(np.array([1.0, 2.0]))]
    [[1.0, 4.0], [3.0, 3.0]]
    """
    function = sp.lambdify(list(arguments), list(exprs), [_FUNCTIONS, "numpy"], cse=True)

    def call(*values: Array) -> list[Array]:
        shape = np.broadcast_shapes(*(np.shape(v) for v in values))
        with np.errstate(all="ignore"):
            found = function(*values)
        return [np.broadcast_to(np.asarray(f, float), shape) for f in found]

    return call


def slopes(exprs: Sequence[sp.Expr], of: Sequence[sp.Symbol]) -> tuple[sp.Expr, ...]:
    """Every derivative, formula by formula."""
    return tuple(expr.diff(s) for expr in exprs for s in of)
