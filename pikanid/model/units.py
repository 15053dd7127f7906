"""The units of a model's formulas: factors where two units of one kind meet.

A formula is a relation between quantities.  Where a unit without prefix-free SI form is declared
(``1/h``, ``mm``, ``deg``), the two sides of a sum, the argument of a function, or the two sides of
an equation (a rate is per second, as time runs in seconds) may come out in different units of one
kind.  There the factor between them is put into the formula, as a fixed parameter with a value and
a unit: ``-k*x`` with k in 1/h becomes ``-h_per_s*k*x`` with h_per_s = 1/3600 h/s.  So values,
guesses, bounds and results of every parameter stay in the unit that its author declared, a file
written and read again is the same, and a formula whose units agree stays as it is.

Numbers and names without a unit take the unit of the place where they stand.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable
from fractions import Fraction
from typing import Any

import sympy as sp

from pikanid import errors
from pikanid.formula import units
from pikanid.model.checks import Checked
from pikanid.model.lookup import Lookup
from pikanid.model.parts import Input, Output, Parameter, State
from pikanid.model.shown_rates import showing
from pikanid.model.unit_algebra import SECOND, declared
from pikanid.model.unit_conversion import Conversion


def check(parts: Iterable[State | Input | Parameter | Output]) -> None:
    """Raise BadUnit unless every unit of a model is known."""
    for part in parts:
        if not isinstance(part.unit, str):
            raise errors.BadModel(errors.bad_value(
                f"The unit of '{part.name}'", part.unit, "text in quotes"))
        units.check(part.unit, f"{type(part).__name__.lower()} '{part.name}'")


def coherent(model: Lookup, checked: Checked) -> dict[str, Any]:
    """The fields of a model in which factors between units are missing; none as a rule.

    Args:
        model: To be put into one form.
        checked: What it was made from: formulas that stay have all that they need, as long as no
            name changes its unit.

    Returns:
        Field -> new value: equations, states, inputs, outputs, and the parameters with those that
        hold the factors.

    Raises:
        BadUnit: If units meet that cannot be converted.
    """
    named = _named(model)
    if all(units.is_coherent(part.unit) for part in [*named, *model.outputs]):
        return {}
    conversion = Conversion({p.name: p for p in named})
    same = checked.model is not None and _units(checked.model).items() <= _units(model).items()
    changes = _converted(model, conversion.put, checked if same else Checked())
    if not conversion.used:
        return {}
    return {**changes, "parameters": (*model.parameters, *conversion.added)}


def disagreements(model: Lookup) -> tuple[str, ...]:
    """Formulas of a model in which SI units of different kinds meet, a sentence for each.

    Numbers in them are what they are, whatever their units: the model can be used, but a formula or
    a unit in it is likely to be wrong.  Terms that hold names without a unit, powers that are not
    known, or factors that are numbers tell nothing.

    >>> from pikanid.model import Model
    >>> model = Model.from_dict({
    ...     "states": {"v": {"unit": "m/s"}}, "equations": {"v": "-c*v/m"},
    ...     "parameters": {"c": {"guess": 1.0, "unit": "N"}, "m": {"guess": 2.0, "unit": "kg"}},
    ...     "outputs": {"v": {"expression": "v"}}})
    >>> disagreements(model)
    ("The equation of 'v': '-c*v/m' comes out in 'N*m/(kg*s)' where 'm/s^2' is needed; \
its numbers are used as they are: check the formula and its units.",)
    """
    conversion = Conversion({p.name: p for p in _named(model)})
    _converted(model, conversion.put, Checked())
    return tuple(conversion.disagreements.values())


def _named(model: Lookup) -> list[State | Input | Parameter]:
    return [*model.states, *model.inputs, *model.parameters]


def _units(model: Lookup) -> dict[str, str]:
    return {p.name: p.unit for p in _named(model)}


def _converted(model: Lookup, put: Callable[..., sp.Expr], checked: Checked) -> dict[str, Any]:
    """The fields of a model that hold formulas, each new formula put into the unit of its place."""
    rates = {s.name: declared(s.unit, s.name).times(SECOND, Fraction(-1)) for s in model.states}
    before = checked.model.equations if checked.model else {}
    equations = {
        name: e if before.get(name) == e else put(e, rates[name], f"The equation of '{name}'")
        for name, e in model.equations.items()}
    return {
        "equations": equations,
        "states": tuple(s if checked.holds(s) else dataclasses.replace(s, initial=put(
            s.initial, declared(s.unit), f"The initial value of '{s.name}'", open_=not s.unit))
            for s in model.states),
        "inputs": tuple(i if checked.holds(i) else _input(i, put) for i in model.inputs),
        "outputs": tuple(o if checked.holds(o) else showing(
            dataclasses.replace(o, delay=put(o.delay, SECOND, f"The delay of output '{o.name}'")),
            put(o.formula, declared(o.unit), f"Output '{o.name}'", open_=not o.unit), equations)
            for o in model.outputs)}


def of_formula(model: Lookup, expr: sp.Expr) -> str:
    """The unit in which a formula of a model comes out, "" where it has none."""
    return Conversion({p.name: p for p in _named(model)}).walk(expr, "The formula")[1].text


def of_difference(text: str) -> str:
    """The unit of a difference of two values.

    >>> of_difference("degC"), of_difference("cm"), of_difference("")
    ('delta_degC', 'cm', '')
    """
    return f"delta_{text}" if text and units.begins_elsewhere(text) else text


def _input(item: Input, put: Callable[..., sp.Expr]) -> Input:
    own = declared(item.unit)
    return dataclasses.replace(
        item, delay=put(item.delay, SECOND, f"The delay of input '{item.name}'"),
        backlash=put(item.backlash, own, f"The backlash of input '{item.name}'",
                     open_=not item.unit),
        backlash_start=None if item.backlash_start is None else put(
            item.backlash_start, declared("1"), f"The backlash start of input '{item.name}'"),
        past=None if item.past is None else put(
            item.past, own, f"The past of input '{item.name}'", open_=not item.unit),
        rate_limit=put(item.rate_limit, own.times(SECOND, Fraction(-1)),
                       f"The rate limit of input '{item.name}'", open_=not item.unit))
