"""Right-hand side and outputs of a model as torch functions, for descent along gradients.

Generated from the same lowered formulas as `VectorField`, whose values they repeat; derivatives
come from autograd.  A switch s = sgn g is constant between its jumps, where its gradient is zero.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import sympy as sp
import torch
from torch import Tensor

from pikanid.formula.expressions import TIME, symbol
from pikanid.model import Model, Spline
from pikanid.simulation.lowering import lower_model, spline_value, switch_symbol
from pikanid.simulation.structure import Structure

# Below this a base counts as zero where a power's slope would grow without bound (`power_slope`).
STEEP = 1e-9


class TorchField:
    """Torch functions of a model.

    Arguments: t (M,), x (M, n), u (M, m), p: all parameters in model order, as a tensor (P,) or as
    a list of numbers and scalar tensors, of which the numbers cost no gradient.

    >>> from pikanid.model.systems import sloshing
    >>> field = TorchField(sloshing())
    >>> p = torch.tensor([0.045, 0.15, 0.3, 9.81], dtype=torch.float64)
    >>> x = torch.tensor([[0.0, 1.0]], dtype=torch.float64)
    >>> field.rhs(torch.zeros(1), x, torch.zeros(1, 2), p)
    tensor([[ 1.0000, -0.5000]], dtype=torch.float64)
    """

    def __init__(self, model: Model):
        self.model = model
        self._functions = _functions(Structure(model))

    def rhs(self, t: Tensor, x: Tensor, u: Tensor, p: Tensor | Sequence[Tensor | float],
            only: Sequence[int] | None = None) -> Tensor:
        """f (M, n), or the columns of the states `only`."""
        states = tuple(range(len(self.model.states))) if only is None else tuple(only)
        return self._functions.evaluate("f", states, t, x, u, p)

    def outputs(self, t: Tensor, x: Tensor, u: Tensor, p: Tensor | Sequence[Tensor | float],
                only: Sequence[int] | None = None) -> Tensor:
        """y = h (M, q), or the columns of the outputs `only`."""
        wanted = tuple(range(len(self.model.outputs))) if only is None else tuple(only)
        return self._functions.evaluate("h", wanted, t, x, u, p)

    def initial(self, u: Tensor, p: Tensor | Sequence[Tensor | float]) -> Tensor:
        """The initial state x0 (n,) for the first inputs u (m,)."""
        start = tuple(state.initial for state in self.model.states)
        function = _initial(self.model.input_names, self.model.parameter_names, start)
        columns = function(*u.unbind(), *_entries(p))
        return torch.stack([torch.as_tensor(c, dtype=torch.float64, device=u.device)
                            for c in columns])


class _Functions:
    def __init__(self, model: Model):
        self.model = model
        self.lowered = lower_model(model)
        names = [*model.state_names, *model.input_names, *model.parameter_names]
        self.head = [TIME, *(symbol(name) for name in names)]
        self.switches = [switch_symbol(k) for k in range(len(self.lowered.switches))]
        self.tools = {**_TOOLS, "spline_value": _Splines(model)}
        self._compiled: dict[tuple[str, tuple[int, ...]], Callable[..., Any]] = {}

    def evaluate(self, name: str, rows: tuple[int, ...], t: Tensor, x: Tensor, u: Tensor,
                 p: Tensor | Sequence[Tensor | float]) -> Tensor:
        arguments: list[Any] = [t, *x.unbind(1), *u.unbind(1), *_entries(p)]
        needed = self.lowered.n_dynamic if name == "f" else len(self.switches)
        for g in self._signs[:needed]:
            arguments.append(torch.sign(torch.as_tensor(g(*arguments)).detach()))
        key = (name, rows)
        if key not in self._compiled:
            exprs = self.lowered.rhs if name == "f" else self.lowered.outputs
            self._compiled[key] = self._lambdify(
                [*self.head, *self.switches[:needed]], [exprs[row] for row in rows])
        columns = self._compiled[key](*arguments)
        return torch.stack([_column(c, x) for c in columns], dim=1)

    @functools.cached_property
    def _signs(self) -> list[Callable[..., Any]]:
        return [_first(self._lambdify([*self.head, *self.switches[:k]], [g]))
                for k, g in enumerate(self.lowered.switches)]

    def _lambdify(self, arguments: Sequence[sp.Symbol], exprs: Sequence[sp.Expr]) -> Any:
        swapped = [e.replace(spline_value, self._with_coefficients) for e in exprs]
        return _lambdify(arguments, swapped, self.tools)

    def _with_coefficients(self, index: sp.Expr, order: sp.Expr, z: sp.Expr) -> sp.Expr:
        names = self.model.splines[int(index)].coefficient_names
        return sp.Function("spline_value")(index, z, *(symbol(c) for c in names))


class _Splines:
    """Torch evaluation of a model's spline functions from coefficients passed as arguments."""

    def __init__(self, model: Model):
        self.pieces = [_pieces(spline) for spline in model.splines]
        self.degrees = [spline.degree for spline in model.splines]

    def __call__(self, index: int, z: Tensor, *coefficients: Tensor | float) -> Tensor:
        left, polynomials = (torch.as_tensor(a, dtype=z.dtype, device=z.device)
                             for a in self.pieces[int(index)])
        degree = self.degrees[int(index)]
        c = torch.stack([torch.as_tensor(value, dtype=z.dtype, device=z.device)
                         for value in coefficients])
        table = torch.einsum("ipb,ib->ip", polynomials, c.unfold(0, degree + 1, 1))
        with torch.no_grad():  # outside the base interval the outermost pieces go on
            piece = torch.clamp(torch.searchsorted(left, z.contiguous(), right=True) - 1, min=0)
        own, s = table[piece], z - left[piece]
        value = own[..., degree]
        for power in range(degree - 1, -1, -1):
            value = value * s + own[..., power]
        return value


def _pieces(spline: Spline) -> tuple[np.ndarray, np.ndarray]:
    """Left ends (I,) and, for each piece, powers by active basis functions (I, k + 1, k + 1)."""
    from scipy.interpolate import BSpline

    k, knots = spline.degree, np.asarray(spline.knots, float)
    left = knots[k:-k - 1]
    basis = BSpline(knots, np.eye(spline.size), k, extrapolate=True)
    middle = 0.5 * (left + knots[k + 1:knots.size - k])
    found = np.zeros((left.size, k + 1, k + 1))
    for i in range(left.size):
        # Taylor about the middle of the piece, which is inside whatever the knots' multiplicity,
        # then moved to its left end.
        taylor = np.array([basis(middle[i], nu=q)[i:i + k + 1] / math.factorial(q)
                           for q in range(k + 1)])
        shift = left[i] - middle[i]
        for q in range(k + 1):
            for power in range(q, k + 1):
                found[i, q] += math.comb(power, q) * shift ** (power - q) * taylor[power]
    return left, found


def _lambdify(arguments: Sequence[sp.Symbol], exprs: Sequence[sp.Expr], tools: dict[str, Any]
              ) -> Any:
    return sp.lambdify(list(arguments), list(exprs), [tools], cse=True)


def _first(function: Callable[..., Any]) -> Callable[..., Any]:
    return lambda *arguments: function(*arguments)[0]


def _entries(p: Tensor | Sequence[Tensor | float]) -> Sequence[Tensor | float]:
    return p.unbind() if isinstance(p, Tensor) else p


def _column(value: Any, like: Tensor) -> Tensor:
    """A formula's value as a column (M,), also where it is a plain number."""
    column = torch.as_tensor(value, dtype=like.dtype, device=like.device)
    return column.expand(like.shape[0])


def _either(for_tensors: Callable[[Tensor], Tensor], for_numbers: Callable[[float], float]
            ) -> Callable[[Any], Any]:
    """A function of tensors or of plain numbers, of which formulas have both."""
    return lambda x: for_tensors(x) if isinstance(x, Tensor) else for_numbers(x)


def _positive_power(base: Tensor, n: Tensor | float) -> Tensor:
    """bⁿ for b >= 0; no gradient where it would be infinite."""
    base = torch.as_tensor(base)
    power = torch.as_tensor(n, dtype=base.dtype, device=base.device)
    zero = (power == 0).to(base.dtype).expand_as(base)
    steep = (power < 1) & (base < STEEP)
    inner = torch.where((base > 0) & ~steep, base, torch.ones_like(base))
    flat = torch.where(base > 0, base, torch.ones_like(base)).detach() ** power.detach()
    return torch.where(base > 0, torch.where(steep, flat, inner**power), zero)


def _log_abs(x: Tensor) -> Tensor:
    x = torch.as_tensor(x)
    safe = torch.where(x == 0, torch.ones_like(x), x)
    return torch.log(torch.abs(safe))


_TOOLS: dict[str, Any] = {
    **{name: _either(getattr(torch, name), getattr(math, name)) for name in (
        "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log", "sqrt")},
    "atan2": lambda y, x: torch.atan2(*torch.broadcast_tensors(
        torch.as_tensor(y), torch.as_tensor(x))),
    "positive_power": _positive_power, "log_abs": _log_abs, "pi": math.pi, "E": math.e,
}


@functools.lru_cache(maxsize=32)
def _functions(structure: Structure) -> _Functions:
    return _Functions(structure.model)


@functools.lru_cache(maxsize=32)
def _initial(inputs: tuple[str, ...], parameters: tuple[str, ...], start: tuple[sp.Expr, ...]
             ) -> Any:
    return _lambdify([symbol(name) for name in (*inputs, *parameters)], start, _TOOLS)
