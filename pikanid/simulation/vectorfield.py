"""Right-hand side, outputs and their Jacobians as vectorised NumPy functions.

For strategies that evaluate the model along a whole trajectory at once.  Non-smooth functions take
the value of their side; at a kink, sgn 0 = 0.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import sympy as sp

from pikanid.expressions import TIME, symbol
from pikanid.model import Model
from pikanid.simulation.layout import STEEP
from pikanid.simulation.lowering import LoweredModel, lower_model, spline_value, switch_symbol
from pikanid.simulation.structure import Structure


class VectorField:
    """NumPy functions of a model.

    Arguments of all methods: t (M,), x (M, n), u (M, m), p (P,) = all parameters in model order.

    >>> from pikanid.systems import sloshing
    >>> field = VectorField(sloshing())
    >>> p = np.array([0.045, 0.15, 0.3, 9.81])
    >>> field.rhs(np.zeros(1), np.array([[0.0, 1.0]]), np.zeros((1, 2)), p)
    array([[ 1. , -0.5]])
    """

    def __init__(self, model: Model):
        self.model = model
        self._functions = _functions(Structure(model))

    @property
    def switches(self) -> tuple[sp.Expr, ...]:
        """Formulas whose sign changes are the kinks and jumps of the model."""
        return self._functions.lowered.switches

    def rhs(self, t: np.ndarray, x: np.ndarray, u: np.ndarray, p: np.ndarray) -> np.ndarray:
        """f (M, n)."""
        return self._functions.values["f"](t, x, u, p)

    def rhs_jacobians(self, t: np.ndarray, x: np.ndarray, u: np.ndarray, p: np.ndarray
                      ) -> tuple[np.ndarray, np.ndarray]:
        """∂f/∂x (M, n, n) and ∂f/∂p (M, n, P)."""
        return self._functions.jacobians(t, x, u, p, "f")

    def rhs_linearised(self, t: np.ndarray, x: np.ndarray, u: np.ndarray, p: np.ndarray,
                       rows: Sequence[int], free: Sequence[int] | np.ndarray
                       ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """E `rows` of f (M, E), of ∂f/∂x (M, E, n), and of ∂f/∂p (M, E, b) by the `free` ones."""
        return self._functions.linearised(t, x, u, p, "f", rows, free)

    def outputs(self, t: np.ndarray, x: np.ndarray, u: np.ndarray, p: np.ndarray) -> np.ndarray:
        """y = h (M, q)."""
        return self._functions.values["h"](t, x, u, p)

    def output_jacobians(self, t: np.ndarray, x: np.ndarray, u: np.ndarray, p: np.ndarray
                         ) -> tuple[np.ndarray, np.ndarray]:
        """∂h/∂x (M, q, n) and ∂h/∂p (M, q, P)."""
        return self._functions.jacobians(t, x, u, p, "h")

    def outputs_linearised(self, t: np.ndarray, x: np.ndarray, u: np.ndarray, p: np.ndarray,
                           rows: Sequence[int], free: Sequence[int] | np.ndarray
                           ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """E `rows` of h (M, E), of ∂h/∂x (M, E, n), and of ∂h/∂p (M, E, b) by the `free` ones."""
        return self._functions.linearised(t, x, u, p, "h", rows, free)


class _Functions:
    def __init__(self, model: Model):
        self.model = model
        self.lowered: LoweredModel = lower_model(model)
        self.x = [symbol(n) for n in model.state_names]
        self.u = [symbol(n) for n in model.input_names]
        self.p = [symbol(n) for n in model.parameter_names]
        self.switches = [switch_symbol(k) for k in range(len(self.lowered.switches))]
        exprs = {"f": self.lowered.rhs, "h": self.lowered.outputs}
        self.exprs = exprs
        self.values = {name: self._vector(e) for name, e in exprs.items()}
        self._tables: dict[str, Any] = {}
        self._plans: dict[tuple[str, tuple[int, ...], tuple[int, ...]], Any] = {}

    def arguments(self, t: np.ndarray, x: np.ndarray, u: np.ndarray, p: np.ndarray
                  ) -> list[np.ndarray]:
        """t, states, inputs, parameters and the present signs, each broadcast over M."""
        base: list[np.ndarray] = [np.asarray(t, float), *x.T, *u.T, *p]
        for g in self._sign_functions:
            base.append(np.sign(g(*base)))
        return base

    @functools.cached_property
    def _sign_functions(self) -> list[Callable[..., np.ndarray]]:
        head = [TIME, *self.x, *self.u, *self.p]
        return [self._lambdify([*head, *self.switches[:k]], [g])
                for k, g in enumerate(self.lowered.switches)]

    def _lambdify(self, arguments: Sequence[sp.Symbol], exprs: Sequence[sp.Expr]) -> Any:
        tools = {"positive_power": _positive_power, "power_slope": _power_slope,
                 "log_abs": _log_abs,
                 "spline_value": _Splines(self.model, list(arguments))}
        atoms = sorted(set().union(*(e.atoms(spline_value) for e in exprs)),
                       key=sp.default_sort_key)
        coefficients = {c for a in atoms
                        for c in self.model.splines[int(a.args[0])].coefficient_names}
        swapped = [e.replace(spline_value, self._with_coefficients) for e in exprs] if (
            coefficients) else list(exprs)
        body = swapped[0] if len(swapped) == 1 else swapped
        return sp.lambdify(list(arguments), body, [tools, "numpy"], cse=not coefficients)

    def _with_coefficients(self, index: sp.Expr, order: sp.Expr, z: sp.Expr) -> sp.Expr:
        names = self.model.splines[int(index)].coefficient_names
        return sp.Function("spline_value")(index, order, z, *(symbol(c) for c in names))

    @property
    def all_symbols(self) -> list[sp.Symbol]:
        return [TIME, *self.x, *self.u, *self.p, *self.switches]

    def _vector(self, exprs: Sequence[sp.Expr]) -> Callable[..., np.ndarray]:
        function = self._lambdify(self.all_symbols, [*exprs, sp.Integer(0)])

        def evaluate(t: np.ndarray, x: np.ndarray, u: np.ndarray, p: np.ndarray) -> np.ndarray:
            with np.errstate(all="ignore"):
                columns = function(*self.arguments(t, x, u, p))[:-1]
            return _columns(columns, len(t))

        return evaluate

    def jacobians(self, t: np.ndarray, x: np.ndarray, u: np.ndarray, p: np.ndarray, name: str
                  ) -> tuple[np.ndarray, np.ndarray]:
        rows, free = range(len(self.exprs[name])), range(len(self.p))
        return self.linearised(t, x, u, p, name, rows, free)[1:]

    def linearised(self, t: np.ndarray, x: np.ndarray, u: np.ndarray, p: np.ndarray, name: str,
                   rows: Sequence[int], free: Sequence[int] | np.ndarray
                   ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        plan = self._plan(name, tuple(rows), tuple(np.asarray(free).tolist()))
        function, edges, row_at, column_at, by_state, by_parameter = plan
        count = len(t)
        jx = np.zeros((count, len(row_at), len(self.x)))
        jp = np.zeros((count, len(row_at), len(column_at)))
        with np.errstate(all="ignore"):
            found = function(*self.arguments(t, x, u, p))
        for k, row, column in by_state:
            jx[:, row, column] = found[k]
        for k, row, column in by_parameter:
            jp[:, row, column] = found[k]
        inner = len(found) - 1 - 2 * len(edges)
        for k, (row, index, order) in enumerate(edges):
            z, weight = found[inner + k], found[inner + len(edges) + k]
            if row not in row_at:
                continue
            spline = self.model.splines[index]
            first = self.model.parameter_names.index(spline.coefficient_names[0])
            basis = _basis(spline.knots, spline.degree, np.broadcast_to(z, (count,)), order)
            own = [k for k in range(spline.size) if first + k in column_at]
            jp[:, row_at[row], [column_at[first + k] for k in own]] += np.reshape(
                np.broadcast_to(weight, (count,)), (-1, 1)) * basis[:, own]
        return _columns([found[row] for row in rows], count), jx, jp

    def _plan(self, name: str, rows: tuple[int, ...], free: tuple[int, ...]) -> Any:
        """The functions, where rows and parameters stand, and what is wanted of them.

        That is (entry, row, column) of ∂/∂x and ∂/∂p.
        """
        if (name, rows, free) not in self._plans:
            places, function, edges = self._table(name)
            row_at = {row: k for k, row in enumerate(rows)}
            column_at = {column: k for k, column in enumerate(free)}
            n, values = len(self.x), len(self.exprs[name])
            wanted = [(values + k, row_at[row], column)
                      for k, (row, column) in enumerate(places) if row in row_at]
            self._plans[name, rows, free] = (
                function, edges, row_at, column_at, [entry for entry in wanted if entry[2] < n],
                [(k, row, column_at[column - n]) for k, row, column in wanted
                 if column - n in column_at])
        return self._plans[name, rows, free]

    def _table(self, name: str) -> Any:
        if name not in self._tables:
            places, entries, edges, inner, weights = [], [], [], [], []
            for row, e in enumerate(self.exprs[name]):
                for column, q in enumerate([*self.x, *self.p]):
                    derivative = e.diff(q)
                    if derivative != 0:
                        places.append((row, column))
                        entries.append(derivative)
                for atom in sorted(e.atoms(spline_value), key=sp.default_sort_key):
                    handle = sp.Dummy(real=True)
                    edges.append((row, int(atom.args[0]), int(atom.args[1])))
                    inner.append(atom.args[2])
                    weights.append(e.subs(atom, handle).diff(handle).subs(handle, atom))
            everything = [*self.exprs[name], *entries, *inner, *weights, sp.Integer(0)]
            if len(everything) == 1:
                everything.append(sp.Integer(0))
            self._tables[name] = (
                places, self._lambdify(self.all_symbols, everything), edges)
        return self._tables[name]


class _Splines:
    """NumPy evaluation of a model's spline functions from coefficients passed as arguments."""

    def __init__(self, model: Model, arguments: Sequence[sp.Symbol]):
        self.model = model

    def __call__(self, index: int, order: int, z: np.ndarray, *coefficients: float) -> np.ndarray:
        spline = self.model.splines[int(index)]
        return _basis(spline.knots, spline.degree, np.atleast_1d(z), int(order)) @ np.array(
            coefficients)


def _columns(values: Sequence[Any], count: int) -> np.ndarray:
    """Arrays (M,) and constants side by side (M, len(values))."""
    out = np.empty((count, len(values)), dtype=np.result_type(float, *values))
    for k, value in enumerate(values):
        out[:, k] = value
    return out


def _basis(knots: Sequence[float], degree: int, z: np.ndarray, order: int) -> np.ndarray:
    from scipy.interpolate import BSpline

    size = len(knots) - degree - 1
    spline = BSpline(np.asarray(knots, float), np.eye(size), degree, extrapolate=True)
    return spline(z, nu=order)


def _positive_power(base: np.ndarray, n: np.ndarray) -> np.ndarray:
    with np.errstate(all="ignore"):
        return np.where(np.asarray(base) > 0, np.power(np.maximum(base, 0.0), n),
                        np.where(np.asarray(n) == 0, 1.0, 0.0))


def _power_slope(base: np.ndarray, n: np.ndarray) -> np.ndarray:
    with np.errstate(all="ignore"):
        steep = (np.asarray(n) < 1) & (np.asarray(base) < STEEP)
        return np.where(steep, 0.0, n * _positive_power(base, np.asarray(n) - 1))


def _log_abs(x: np.ndarray) -> np.ndarray:
    with np.errstate(all="ignore"):
        return np.where(np.asarray(x) == 0, 0.0, np.log(np.abs(x)))


@functools.lru_cache(maxsize=32)
def _functions(structure: Structure) -> _Functions:
    return _Functions(structure.model)
