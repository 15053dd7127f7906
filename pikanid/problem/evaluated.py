"""Formulas of parameters alone, as numbers: delays and paths of channels, the initial state."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy as sp

from pikanid.formula.expressions import symbol
from pikanid.model import Input, Model


def _step(x: float, at: float) -> float:
    return at if x == 0 else float(x > 0)


# what NumPy lacks of the formula language, value by value; SymPy solves for where
# a step of its own is, which takes it minutes where the formula is long
TOOLS: Mapping[str, Callable[..., Any]] = {
    "Heaviside": _step,
    "abs_power": lambda x, n: 0.0 if x == 0 else abs(x) ** n,
    "signed_power": lambda x, n: 0.0 if x == 0 else np.sign(x) * abs(x) ** n,
    "log_abs": lambda x: 0.0 if x == 0 else np.log(abs(x)),
    "DiracDelta": lambda x: 0.0,
}  # definition: values at zero


def delays(items: Sequence[Input], model: Model, p: np.ndarray) -> np.ndarray:
    """The delays (m,) [s] of inputs at parameters p (P,)."""
    table = dict(zip(model.parameter_names, p, strict=True))
    return np.array([number(item.delay, table) for item in items])


def delay_jacobian(items: Sequence[Input], model: Model, p: np.ndarray) -> np.ndarray:
    """∂delay/∂p (m, P) of inputs."""
    table = dict(zip(model.parameter_names, p, strict=True))
    return np.array([[number(slope, table) for slope in slopes(item.delay, model.parameter_names)]
                     for item in items]).reshape(len(items), len(p))


def paths(model: Model, p: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Half the play, the greatest rate, where in the play it begins and what was before, of every
    input (m,), at parameters p (P,).

    A rate that is not limited is infinite, what is not given NaN.
    """
    table = dict(zip(model.parameter_names, p, strict=True))

    def given(formula: sp.Expr | None) -> float:
        return np.nan if formula is None else number(formula, table)

    return (np.array([number(i.backlash, table) for i in model.inputs]),
            np.array([number(i.rate_limit, table) if i.rate_limit != 0 else np.inf
                      for i in model.inputs]),
            np.array([given(i.backlash_start) for i in model.inputs]),
            np.array([given(i.past) for i in model.inputs]))


@functools.lru_cache(maxsize=256)
def slopes(expr: sp.Expr, names: tuple[str, ...]) -> tuple[sp.Expr, ...]:
    """Its derivatives by the parameters of these names."""
    return tuple(expr.diff(symbol(n)) for n in names)


def number(expr: sp.Expr, table: Mapping[str, float]) -> float:
    """A formula of parameters alone at their values by name."""
    if expr.is_Symbol:  # most delays are one parameter
        return float(table[expr.name])
    if expr.is_number:
        return float(expr)
    return float(expr.xreplace({symbol(n): sp.Float(v) for n, v in table.items()}))


@dataclass(frozen=True)
class InitialState:
    """The symbolic initial state as functions of p (P,) and the first inputs u0 (m,).

    `driven` says whether u0 enters, `fixed` whether neither does.
    """

    value: Callable[[np.ndarray, np.ndarray], np.ndarray]
    jacobian: Callable[[np.ndarray, np.ndarray], np.ndarray]
    driven: bool
    fixed: bool = False


@functools.lru_cache(maxsize=64)
def initial_state(model: Model) -> InitialState:
    """x0 (n,) and ∂x0/∂p (n, P) as functions."""
    n, p_symbols = len(model.states), [symbol(q) for q in model.parameter_names]
    start = [s.initial for s in model.states]
    if all(e.is_number for e in start):
        x0, zero = np.array([float(e) for e in start]), np.zeros((n, len(p_symbols)))
        return InitialState(lambda p, u: x0, lambda p, u: zero, False, True)
    used = [k for k, q in enumerate(p_symbols) if any(e.has(q) for e in start)]
    value, slopes = _start_functions(tuple(start), tuple(p_symbols[k] for k in used),
                                     model.input_names)

    # without a restoring force there is no balance to start in: the simulation says not finite
    def at(p: np.ndarray, u: np.ndarray) -> np.ndarray:
        with np.errstate(all="ignore"):
            return np.array(value(p[used], u), float)

    def jacobian(p: np.ndarray, u: np.ndarray) -> np.ndarray:
        full = np.zeros((n, len(p_symbols)))
        with np.errstate(all="ignore"):
            full[:, used] = np.array(slopes(p[used], u), float).reshape(n, len(used))
        return full

    driven = any(e.has(symbol(q)) for q in model.input_names for e in start)
    return InitialState(at, jacobian, driven)


# models that differ elsewhere begin alike
@functools.lru_cache(maxsize=64)
def _start_functions(start: tuple[sp.Expr, ...], parameters: tuple[sp.Symbol, ...],
                     inputs: tuple[str, ...]) -> tuple[Callable[..., Any], Callable[..., Any]]:
    arguments = [parameters, [symbol(q) for q in inputs]]
    table = [[e.diff(q) for q in parameters] for e in start]
    return (sp.lambdify(arguments, list(start), [TOOLS, "numpy"], cse=True),
            sp.lambdify(arguments, table, [TOOLS, "numpy"], cse=True))
