"""What must hold for a `Model` to make sense; every violation is a `BadModel` sentence."""

from __future__ import annotations

import functools
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, get_args

import sympy as sp
from sympy.core.function import AppliedUndef

from pikanid import errors
from pikanid.formula.expressions import FUNCTIONS, TIME, check_name
from pikanid.formula.functions import abs_power, clip, log_abs, signed_power
from pikanid.formula.limits import MAX_NAME
from pikanid.model.effect import Effect
from pikanid.model.effect_form import EffectForm
from pikanid.model.lookup import Lookup
from pikanid.model.parts import Hold
from pikanid.storage.entries import Entry, is_integer

# Far more than any model has, and few enough that checking them takes no time.
MOST = {"states": 1000, "inputs": 200, "parameters": 20_000, "outputs": 500, "splines": 200,
        "knots": 10_000}  # limit: numbers of entries in a model
MAX_DEGREE = 20  # limit: of a spline

@dataclass(frozen=True)
class Checked:
    """What need not be checked again in a model that is made from another one.

    Attributes:
        model: The other one, if there is one.
        parts: Its parts and right-hand sides, by their identity: two that are equal need not be of
            one type.
    """

    model: Lookup | None = None
    parts: frozenset[int] = frozenset()

    @classmethod
    def of(cls, model: Lookup) -> Checked:
        """All that a model holds."""
        return cls(model, frozenset(map(id, (
            *model.states, *model.inputs, *model.parameters, *model.outputs, *model.splines,
            *model.effects, *model.equations.values()))))

    def holds(self, part: Any) -> bool:
        """Whether a part was checked by itself."""
        return id(part) in self.parts

    def new(self, items: Iterable[Any]) -> list[Any]:
        """Those of some parts that it does not hold."""
        return [item for item in items if not self.holds(item)]

    def named(self, model: Lookup) -> Checked:
        """What need not be looked up again: nothing, where a name is gone or stands for another
        kind of thing.
        """
        before = self.model
        if before is None or any(not {p.name for p in old} <= {p.name for p in new}
                                 for old, new in ((before.states, model.states),
                                                  (before.inputs, model.inputs),
                                                  (before.parameters, model.parameters),
                                                  (before.splines, model.splines))):
            return Checked()
        return self


def check_types(model: Lookup, checked: Checked) -> None:
    """Raise `BadModel` unless every part of the model is of its type, and of a sensible size.

    Formulas are left to `pikanid.formula.expressions.to_real`.
    """
    entry(model.name, "The model's name").text(longest=MAX_NAME)
    entry(model.equations, "The equations").table(optional=None, most=MOST["states"])
    parts: list[tuple[str, tuple[Any, ...]]] = [
        ("states", model.states), ("inputs", model.inputs), ("parameters", model.parameters),
        ("outputs", model.outputs), ("splines", model.splines)]
    for section, items in parts:
        if len(items) > MOST[section]:
            raise errors.BadModel(errors.too_many_entries(
                f"The model's list of {section}", len(items), MOST[section]))
        what = section.rstrip("s")
        for item in checked.new(items):
            check_name(item.name, what)
            if section != "splines":
                entry(item.unit, f"The unit of {what} '{item.name}'").text()
    for item in checked.new(model.inputs):
        if item.default is not None:
            entry(item.default, f"The default of input '{item.name}'").number()
    for p in checked.new(model.parameters):
        entry(p.value, f"The value of parameter '{p.name}'").number()
        entry(p.description, f"The description of parameter '{p.name}'").text()
        bounds = entry(p.bounds, f"The bounds of parameter '{p.name}'")
        if not isinstance(p.bounds, list | tuple) or len(p.bounds) != 2:
            raise bounds.fail("[lower, upper]")
        for bound in bounds.items():
            bound.number(finite=False)
    for o in checked.new(model.outputs):
        if o.sigma is not None:
            sigma = entry(o.sigma, f"The sigma of output '{o.name}'")
            if sigma.number() <= 0:
                raise sigma.fail("positive (or left out)")
    for effect in checked.new(model.effects):
        if not isinstance(effect, Effect | EffectForm):
            raise errors.BadModel(errors.not_of_kind(
                "An effect of the model", type(effect).__name__, "a pikanid.Effect"))
    for s in checked.new(model.splines):
        degree = entry(s.degree, f"The degree of spline '{s.name}'")
        if not is_integer(s.degree) or not 1 <= s.degree <= MAX_DEGREE:
            raise degree.fail(f"an integer, degree >= 1 and <= {MAX_DEGREE}")
        for knot in entry(s.knots, f"The knots of spline '{s.name}'").items(most=MOST["knots"]):
            knot.number()


def entry(value: Any, where: str) -> Entry:
    """A part of a model to be checked."""
    return Entry(value, where, errors.BadModel)


def validate(model: Lookup, checked: Checked) -> None:
    """Raise `BadModel` unless names, symbols, values and bounds of the model are consistent."""
    if not model.states:
        raise errors.BadModel(errors.no_states())
    if not model.outputs:
        raise errors.BadModel(errors.no_outputs())
    _check_names(model)
    checked = checked.named(model)
    everything = model.symbols | {TIME.name}
    constants = set(model.parameter_names)
    start = constants | set(model.input_names)
    for name, expr in model.equations.items():
        if not checked.holds(expr):
            _check_symbols(expr, everything, f"The equation of '{name}'", model)
    for output in checked.new(model.outputs):
        _check_symbols(output.expression, everything, f"Output '{output.name}'", model)
        _check_symbols(output.delay, constants | {TIME.name},
                       f"The delay of output '{output.name}'", model)
    for state in checked.new(model.states):
        _check_symbols(state.initial, start, f"The initial value of '{state.name}'", model)
        if splines := state.initial.atoms(AppliedUndef):
            raise errors.BadModel(errors.spline_at_start(state.name, str(splines.pop())))
    for item in checked.new(model.inputs):
        for what, formula in item.formulas.items():
            _check_symbols(formula, constants, f"The {what.replace('_', ' ')} of input "
                           f"'{item.name}'", model)
        if item.backlash_start is not None and item.backlash == 0:
            raise errors.BadModel(errors.start_without_backlash(item.name))
        if item.hold not in get_args(Hold):
            raise errors.BadModel(errors.bad_value(
                f"The hold of input '{item.name}'", item.hold, "'zero', 'first' or 'cubic'"))
    for p in checked.new(model.parameters):
        if not p.bounds[0] < p.bounds[1] or (p.free and not p.bounds[0] <= p.value <= p.bounds[1]):
            raise errors.BadModel(errors.bad_bounds(p.name, p.value, p.bounds))
        if p.scope not in ("shared", "recording"):
            raise errors.BadModel(errors.bad_value(
                f"The scope of parameter '{p.name}'", p.scope, "'shared' or 'recording'"))


def _check_names(model: Lookup) -> None:
    seen: dict[str, str] = {}
    groups: list[tuple[str, Iterable[Any]]] = [
        ("state", model.states), ("input", model.inputs),
        ("parameter", model.parameters), ("spline", model.splines)]
    for what, items in groups:
        for item in items:
            if item.name in seen:
                raise errors.BadModel(errors.duplicate_name(item.name, seen[item.name], what))
            seen[item.name] = what
    outputs: set[str] = set()
    for name in model.output_names:
        # an output may share the name of the state that it measures
        if name in outputs:
            raise errors.BadModel(errors.duplicate_name(name, "output", "output"))
        if seen.get(name) in ("input", "spline"):
            raise errors.BadModel(errors.duplicate_name(name, seen[name], "output"))
        outputs.add(name)
    for spline in model.splines:
        if spline.size < 1 or any(b < a for a, b in pairwise(spline.knots)):
            raise errors.BadModel(errors.bad_value(
                f"Spline '{spline.name}'", f"degree {spline.degree}, {len(spline.knots)} knots",
                "of degree >= 1 with at least degree + 2 finite, non-decreasing knots"))


_NODES = (sp.Add, sp.Mul, sp.Pow, sp.Symbol, sp.Rational, sp.Float, sp.exp, type(sp.pi), type(sp.E),
          sp.sin, sp.cos, sp.tan, sp.asin, sp.acos, sp.atan, sp.atan2, sp.sinh, sp.cosh, sp.tanh,
          sp.log, sp.Abs, sp.sign, sp.Heaviside, sp.Min, sp.Max, clip, abs_power, signed_power,
          log_abs, sp.core.function.AppliedUndef)


def _check_symbols(expr: sp.Expr, known: Iterable[str], where: str, model: Lookup) -> None:
    names, functions, forbidden = _content(expr)
    unknown = sorted(names - set(known))
    unknown += sorted(functions - {s.name for s in model.splines})
    if unknown:
        raise errors.BadModel(errors.foreign_symbols(unknown, where))
    if forbidden:
        raise errors.BadModel(errors.formula_forbidden(
            forbidden, where[0].lower() + where[1:], sorted(FUNCTIONS)))


# a model is made from another by many small steps, each of which checks all formulas again
@functools.lru_cache(maxsize=4096)
def _content(expr: sp.Expr) -> tuple[frozenset[str], frozenset[str], str]:
    """Names of symbols, names of splines, and the first node that no formula may hold, if any."""
    forbidden = next((str(node) for node in sp.preorder_traversal(expr)
                      if not isinstance(node, _NODES)), "")
    return (frozenset(s.name for s in expr.free_symbols),
            frozenset(f.func.__name__ for f in expr.atoms(sp.core.function.AppliedUndef)),
            forbidden)
