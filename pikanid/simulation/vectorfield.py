"""Right-hand side, outputs and their Jacobians as vectorised NumPy functions.

For strategies that evaluate the model along a whole trajectory at once.  Non-smooth functions take
the value of their side; at a kink, sgn 0 = 0.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import sympy as sp

from pikanid.formula.expressions import TIME, symbol
from pikanid.model import Model
from pikanid.simulation import numpy_functions
from pikanid.simulation.lowering import LoweredModel, lower_model, spline_value, switch_symbol
from pikanid.simulation.structure import Structure
from pikanid.simulation.tape import can_run, tape

if TYPE_CHECKING:
    from pikanid.simulation.native_field import NativeField

# So many rows at a time: what a formula leaves on its way then stays in the processor's cache, and
# takes no fresh memory.
BLOCK = 16384  # limit: rows of 16384 numbers


class VectorField:
    """NumPy functions of a model.

    Arguments of all methods: t (M,), x (M, n), u (M, m), p (P,) = all parameters in model order.

    >>> from pikanid.model.systems import sloshing
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
        return self._functions.values("f")(t, x, u, p)

    def rhs_jacobians(self, t: np.ndarray, x: np.ndarray, u: np.ndarray, p: np.ndarray
                      ) -> tuple[np.ndarray, np.ndarray]:
        """∂f/∂x (M, n, n) and ∂f/∂p (M, n, P)."""
        return self._functions.jacobians(t, x, u, p, "f")

    def rhs_by(self, name: str, t: np.ndarray, x: np.ndarray, u: np.ndarray, p: np.ndarray
               ) -> np.ndarray:
        """∂f/∂p (M, n) by one parameter: of a model that is used once, all take far longer to write
        than to evaluate.
        """
        return self._functions.by_parameter(name)(t, x, u, p)

    def linearised_rhs(self, rows: Sequence[int], free: Sequence[int]) -> Linearised:
        """E `rows` of f with ∂f/∂x and with ∂f/∂p by the `free` ones."""
        return self._functions.linearised("f", tuple(rows), tuple(free))

    def outputs(self, t: np.ndarray, x: np.ndarray, u: np.ndarray, p: np.ndarray) -> np.ndarray:
        """y = h (M, q)."""
        return self._functions.values("h")(t, x, u, p)

    def output_jacobians(self, t: np.ndarray, x: np.ndarray, u: np.ndarray, p: np.ndarray
                         ) -> tuple[np.ndarray, np.ndarray]:
        """∂h/∂x (M, q, n) and ∂h/∂p (M, q, P)."""
        return self._functions.jacobians(t, x, u, p, "h")

    def linearised_outputs(self, rows: Sequence[int], free: Sequence[int]) -> Linearised:
        """E `rows` of h with ∂h/∂x and with ∂h/∂p by the `free` ones."""
        return self._functions.linearised("h", tuple(rows), tuple(free))


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
        self._values: dict[str, Callable[..., np.ndarray]] = {}
        self._tables: dict[str, Any] = {}
        self._slopes: dict[str, Callable[..., np.ndarray]] = {}
        self._plans: dict[tuple[str, tuple[int, ...], tuple[int, ...]], Linearised] = {}

    def arguments(self, t: np.ndarray, x: np.ndarray, u: np.ndarray, p: np.ndarray
                  ) -> list[np.ndarray]:
        """t, states, inputs, parameters and the present signs, each broadcast over M."""
        base: list[np.ndarray] = [t, *x.T, *u.T, *p]
        for g in self._sign_functions:
            base.append(np.sign(g(*base)))
        return base

    @functools.cached_property
    def _sign_functions(self) -> list[Callable[..., np.ndarray]]:
        head = [TIME, *self.x, *self.u, *self.p]
        return [self._lambdify([*head, *self.switches[:k]], [g])
                for k, g in enumerate(self.lowered.switches)]

    def _lambdify(self, arguments: Sequence[sp.Symbol], exprs: Sequence[sp.Expr]) -> Any:
        tools = {"positive_power": numpy_functions.positive_power,
                 "power_slope": numpy_functions.power_slope,
                 "log_abs": numpy_functions.log_abs,
                 "spline_value": numpy_functions.SplineValues(self.model)}
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

    def values(self, name: str) -> Callable[..., np.ndarray]:
        """f or h as a function; written when first asked for, as machine code has no need of it."""
        if name not in self._values:
            self._values[name] = self._vector(self.exprs[name])
        return self._values[name]

    def by_parameter(self, name: str) -> Callable[..., np.ndarray]:
        """∂f/∂p by the parameter of that name as a function."""
        if name not in self._slopes:
            self._slopes[name] = self._vector([e.diff(symbol(name)) for e in self.exprs["f"]])
        return self._slopes[name]

    def _vector(self, exprs: Sequence[sp.Expr]) -> Callable[..., np.ndarray]:
        signed = any(e.has(*self.switches) for e in exprs) if self.switches else False
        symbols = self.all_symbols if signed else [TIME, *self.x, *self.u, *self.p]
        function = self._lambdify(symbols, [*exprs, sp.Integer(0)])

        def evaluate(t: np.ndarray, x: np.ndarray, u: np.ndarray, p: np.ndarray) -> np.ndarray:
            with np.errstate(all="ignore"):
                given = self.arguments(t, x, u, p) if signed else [t, *x.T, *u.T, *p]
                found = function(*given)[:-1]
            return numpy_functions.columns(found, len(t))

        return evaluate

    def jacobians(self, t: np.ndarray, x: np.ndarray, u: np.ndarray, p: np.ndarray,
                  name: Literal["f", "h"]) -> tuple[np.ndarray, np.ndarray]:
        rows, free = range(len(self.exprs[name])), range(len(self.p))
        with np.errstate(all="ignore"):
            return self.linearised(name, tuple(rows), tuple(free))(t, x, u, p)[1:]

    def linearised(self, name: Literal["f", "h"], rows: tuple[int, ...], free: tuple[int, ...]
                   ) -> Linearised:
        if (name, rows, free) not in self._plans:
            self._plans[name, rows, free] = Linearised(self, name, rows, free)
        return self._plans[name, rows, free]

    def table(self, name: str) -> Any:
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


class Linearised:
    """Some rows of f or h and their derivatives by the states and by some parameters.

    `state` is the one that a single row shows as it is; None for any other formula, or several.
    Smooth models run from machine code, `native`, which others have none of.  NumPy's warnings are
    for the caller to silence: once for all that is evaluated.
    """

    def __init__(self, functions: _Functions, name: Literal["f", "h"], rows: tuple[int, ...],
                 free: tuple[int, ...]):
        only = functions.exprs[name][rows[0]] if len(rows) == 1 else None
        self.state = functions.x.index(only) if only in functions.x else None
        self.native: NativeField | None = None
        if can_run(functions.model) and not functions.lowered.switches:
            from pikanid.simulation.native_field import NativeField

            self.native = NativeField(tape(Structure(functions.model)), name, rows, free)
            return
        places, self._function, self._edges = functions.table(name)
        self._functions, self._rows = functions, rows
        self._row_at = {row: k for k, row in enumerate(rows)}
        self._column_at = {column: k for k, column in enumerate(free)}
        self._size, self._n, self._b = len(rows), len(functions.x), len(free)
        values = len(functions.exprs[name])
        # (entry, row, column) of ∂/∂x and ∂/∂p
        wanted = [(values + k, self._row_at[row], column)
                  for k, (row, column) in enumerate(places) if row in self._row_at]
        self._by_state = [entry for entry in wanted if entry[2] < self._n]
        self._by_parameter = [(k, row, self._column_at[column - self._n])
                              for k, row, column in wanted if column - self._n in self._column_at]

    def __call__(self, t: np.ndarray, x: np.ndarray, u: np.ndarray, p: np.ndarray
                 ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Values (M, E), ∂/∂x (M, E, n) and ∂/∂p (M, E, b)."""
        if self.native is not None:
            return self.native(t, x, u, p)
        shape = (*t.shape, self._size)
        values = np.empty(shape)
        jx, jp = np.zeros((*shape, self._n)), np.zeros((*shape, self._b))
        for begin in range(0, len(t), BLOCK):
            own = slice(begin, begin + BLOCK)
            self._fill(self._function(*self._functions.arguments(t[own], x[own], u[own], p)),
                       values[own], jx[own], jp[own])
        return values, jx, jp

    def _fill(self, found: Sequence[Any], values: np.ndarray, jx: np.ndarray, jp: np.ndarray
              ) -> None:
        for k, row in enumerate(self._rows):
            values[:, k] = found[row]
        for k, row, column in self._by_state:
            jx[:, row, column] = found[k]
        for k, row, column in self._by_parameter:
            jp[:, row, column] = found[k]
        if self._edges:
            self._add_edges(found, jp)

    def _add_edges(self, found: Sequence[Any], jp: np.ndarray) -> None:
        """∂/∂p by the coefficients of spline functions."""
        model, count = self._functions.model, len(jp)
        inner = len(found) - 1 - 2 * len(self._edges)
        for k, (row, index, order) in enumerate(self._edges):
            z, weight = found[inner + k], found[inner + len(self._edges) + k]
            if row not in self._row_at:
                continue
            spline = model.splines[index]
            first = model.parameter_names.index(spline.coefficient_names[0])
            basis = numpy_functions.basis(
                spline.knots, spline.degree, np.broadcast_to(z, (count,)), order)
            own = [k for k in range(spline.size) if first + k in self._column_at]
            jp[:, self._row_at[row], [self._column_at[first + k] for k in own]] += np.reshape(
                np.broadcast_to(weight, (count,)), (-1, 1)) * basis[:, own]


@functools.lru_cache(maxsize=256)
def _functions(structure: Structure) -> _Functions:
    return _Functions(structure.model)
