"""What must hold for a `Model` to make sense; every violation is a `BadModel` sentence."""

from __future__ import annotations

import difflib
import functools
import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import sympy as sp
from sympy.core.function import AppliedUndef

from pikanid import errors
from pikanid.expression_functions import abs_power, clip, log_abs, signed_power
from pikanid.expressions import TIME, check_name

if TYPE_CHECKING:
    from pikanid.model import Model


def find(items: Iterable[Any], name: str, what: str) -> Any:
    """The item of that name; a `BadModel` that lists the names if there is none."""
    names = []
    for item in items:
        if item.name == name:
            return item
        names.append(item.name)
    close = difflib.get_close_matches(name, names, 1)
    raise errors.BadModel(errors.not_in_model(what, name, names, close))


def validate(model: Model) -> None:
    """Raise `BadModel` unless names, symbols, values and bounds of the model are consistent."""
    if not model.states:
        raise errors.BadModel(errors.no_states())
    if not model.outputs:
        raise errors.BadModel(errors.no_outputs())
    _check_names(model)
    everything = model.symbols | {TIME.name}
    constants = set(model.parameter_names)
    start = constants | set(model.input_names)
    for name, expr in model.equations.items():
        _check_symbols(expr, everything, f"The equation of '{name}'", model)
    for output in model.outputs:
        _check_symbols(output.expression, everything, f"Output '{output.name}'", model)
        _check_symbols(output.delay, constants, f"The delay of output '{output.name}'", model)
    for state in model.states:
        _check_symbols(state.initial, start, f"The initial value of '{state.name}'", model)
        if splines := state.initial.atoms(AppliedUndef):
            raise errors.BadModel(errors.spline_at_start(state.name, str(splines.pop())))
    for item in model.inputs:
        for what, formula in (("delay", item.delay), ("backlash", item.backlash),
                              ("rate limit", item.rate_limit)):
            _check_symbols(formula, constants, f"The {what} of input '{item.name}'", model)
        if item.hold not in ("zero", "first"):
            raise errors.BadModel(errors.bad_value(
                f"The hold of input '{item.name}'", item.hold, "'zero' or 'first'"))
    for p in model.parameters:
        if not math.isfinite(p.value):
            raise errors.BadModel(errors.bad_value(
                f"The value of parameter '{p.name}'", p.value, "a finite number"))
        if not p.bounds[0] < p.bounds[1] or (p.free and not p.bounds[0] <= p.value <= p.bounds[1]):
            raise errors.BadModel(errors.bad_bounds(p.name, p.value, p.bounds))
        if p.scope not in ("shared", "recording"):
            raise errors.BadModel(errors.bad_value(
                f"The scope of parameter '{p.name}'", p.scope, "'shared' or 'recording'"))


def _check_names(model: Model) -> None:
    seen: dict[str, str] = {}
    groups: list[tuple[str, Iterable[Any]]] = [
        ("state", model.states), ("input", model.inputs),
        ("parameter", model.parameters), ("spline", model.splines)]
    for what, items in groups:
        for item in items:
            check_name(item.name, what)
            if item.name in seen:
                raise errors.BadModel(errors.duplicate_name(item.name, seen[item.name], what))
            seen[item.name] = what
    outputs = [o.name for o in model.outputs]
    for name in outputs:
        check_name(name, "output")  # an output may share the name of the state that it measures
        if outputs.count(name) > 1:
            raise errors.BadModel(errors.duplicate_name(name, "output", "output"))
        if seen.get(name) in ("input", "spline"):
            raise errors.BadModel(errors.duplicate_name(name, seen[name], "output"))
    for spline in model.splines:
        if spline.degree < 1 or spline.size < 1 or not all(map(math.isfinite, spline.knots)) or any(
                b < a for a, b in zip(spline.knots, spline.knots[1:], strict=False)):
            raise errors.BadModel(errors.bad_value(
                f"Spline '{spline.name}'", f"degree {spline.degree}, {len(spline.knots)} knots",
                "of degree >= 1 with at least degree + 2 finite, non-decreasing knots"))


_NODES = (sp.Add, sp.Mul, sp.Pow, sp.Symbol, sp.Rational, sp.Float, sp.exp, type(sp.pi), type(sp.E),
          sp.sin, sp.cos, sp.tan, sp.asin, sp.acos, sp.atan, sp.atan2, sp.sinh, sp.cosh, sp.tanh,
          sp.log, sp.Abs, sp.sign, sp.Heaviside, sp.Min, sp.Max, clip, abs_power, signed_power,
          log_abs, sp.core.function.AppliedUndef)


def _check_symbols(expr: sp.Expr, known: Iterable[str], where: str, model: Model) -> None:
    names, functions, forbidden = _content(expr)
    unknown = sorted(names - set(known))
    unknown += sorted(functions - {s.name for s in model.splines})
    if unknown:
        raise errors.BadModel(errors.foreign_symbols(unknown, where))
    if forbidden:
        raise errors.BadModel(errors.formula_forbidden(forbidden, where[0].lower() + where[1:]))


# a model is made from another by many small steps, each of which checks all formulas again
@functools.lru_cache(maxsize=4096)
def _content(expr: sp.Expr) -> tuple[frozenset[str], frozenset[str], str]:
    """Names of symbols, names of splines, and the first node that no formula may hold, if any."""
    forbidden = next((str(node) for node in sp.preorder_traversal(expr)
                      if not isinstance(node, _NODES)), "")
    return (frozenset(s.name for s in expr.free_symbols),
            frozenset(f.func.__name__ for f in expr.atoms(sp.core.function.AppliedUndef)),
            forbidden)
