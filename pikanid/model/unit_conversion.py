"""A walk through formulas that puts factors where two units of one kind meet."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

import sympy as sp
from sympy.core.function import AppliedUndef

from pikanid import errors
from pikanid.formula.expressions import TIME, symbol, to_text
from pikanid.formula.functions import abs_power, clip, signed_power
from pikanid.model.parts import Parameter
from pikanid.model.shown_rates import DERIVATIVE
from pikanid.model.unit_algebra import (
    BARE,
    ONE,
    SAME,
    SECOND,
    Unit,
    coefficients,
    declared,
    holds_numbers,
    of_other_zero,
    simple,
)

_ALIKE = 1e-3  # numerical: relative difference of a number and a factor that it may stand for
_OF_ANGLES = (sp.sin, sp.cos, sp.tan, sp.sinh, sp.cosh, sp.tanh, sp.exp, sp.log, sp.asin, sp.acos,
              sp.atan)
_OF_ONE_UNIT = (sp.Max, sp.Min, clip)
_SIGNS = (sp.sign, sp.Heaviside)


@dataclass
class Conversion:
    """Walks through formulas, and collects the parameters that hold factors.

    Attributes:
        known: Name -> part of the model.
        added: Parameters put into formulas so far that the model did not have.
        used: Whether any factor was put into a formula.
        disagreements: Place -> what is said of units of different kinds that met there first.
    """

    known: Mapping[str, Any]
    added: list[Parameter] = field(default_factory=list)
    used: bool = False
    disagreements: dict[str, str] = field(default_factory=dict)

    def put(self, expr: sp.Expr, wanted: Unit, where: str, open_: bool = False) -> sp.Expr:
        """The formula with the factors that it needs to come out in `wanted`.

        Args:
            expr: The formula.
            wanted: Unit of the place where it stands.
            where: Its name, for messages.
            open_: Whether the place has no unit of its own.
        """
        found, unit = self.walk(expr, where, wanted)
        if open_:
            return found
        return self.fitted(found, unit, wanted, where, expr)

    def walk(self, expr: sp.Expr, where: str, wanted: Unit = BARE) -> tuple[sp.Expr, Unit]:
        """The formula with factors inside, and the unit in which it comes out.

        The terms of a sum are put into the unit that is `wanted` of it, if they can be.
        """
        if expr.is_Symbol:
            part = self.known.get(expr.name)
            if expr == TIME:
                return expr, SECOND
            return expr, BARE if part is None else declared(part.unit, part.name)
        if expr.is_Atom:
            return expr, BARE
        if isinstance(expr, AppliedUndef):
            first = self.known.get(f"{expr.func.__name__}_0")
            inner, unit = self.walk(expr.args[0], where)
            if expr.func.__name__ == DERIVATIVE:
                return expr, unit.times(SECOND, Fraction(-1))
            return expr.func(inner), declared(first.unit if first else "", expr.func.__name__)
        if expr.is_Add or isinstance(expr, _OF_ONE_UNIT):
            return self.meeting(expr, where, wanted)
        if expr.is_Mul:
            return self.product(expr, where)
        if isinstance(expr, sp.Pow | abs_power | signed_power):
            return self.power(expr, where)
        if isinstance(expr, sp.Abs):
            inner, unit = self.walk(expr.args[0], where)
            return sp.Abs(inner), dataclasses.replace(unit, absolute=Fraction(0))
        if isinstance(expr, sp.atan2):
            (a, b), _ = self.together(expr.args, where, expr)
            return sp.atan2(a, b), ONE
        if isinstance(expr, _SIGNS):
            return expr.func(self.walk(expr.args[0], where)[0], *expr.args[1:]), ONE
        return expr.func(*(self.argument(a, where, expr) for a in expr.args)), ONE

    def argument(self, expr: sp.Expr, where: str, function: sp.Expr) -> sp.Expr:
        """An argument of a function of pure numbers; a number in it may carry a unit."""
        inner, unit = self.walk(expr, where)
        carried = not isinstance(function, _OF_ANGLES) or any(
            not simple(c) for c in coefficients(expr))
        if unit.measure.kind and carried:
            return inner
        return self.fitted(inner, unit, ONE, where, function)

    def meeting(self, expr: sp.Expr, where: str, wanted: Unit) -> tuple[sp.Expr, Unit]:
        """A sum, or the greatest or least of several: all in one unit."""
        parts, unit = self.together(expr.args, where, expr, wanted)
        return expr.func(*parts), unit

    def together(self, args: Iterable[sp.Expr], where: str, whole: sp.Expr, wanted: Unit = BARE
                 ) -> tuple[list[sp.Expr], Unit]:
        """Formulas in one unit, which is that of one of them."""
        walked = [self.walk(a, where) for a in args]
        unknown = frozenset[str]().union(*(u.unknown for _, u in walked))
        own = [unit for _, unit in walked if not unit.bare]
        own = [u for u in own if u.measure.kind] or own
        if not own:
            return [e for e, _ in walked], dataclasses.replace(BARE, unknown=unknown)
        goal = min(own, key=lambda u: (u.measure.kind != wanted.measure.kind,
                                       not u.same_size(wanted), not u.same_size(ONE)))
        bare = [e for e, u in walked if u not in own and e != 0]
        if bare and any(not u.same_size(goal) for u in own):
            raise errors.BadUnit(errors.number_between_units(where, to_text(bare[0])))
        parts = [self.fitted(e, u, goal, where, whole) for e, u in walked]
        absolute = sum((u.absolute for u in own), Fraction(0)) if whole.is_Add else goal.absolute
        return parts, dataclasses.replace(goal, absolute=absolute, unknown=unknown)

    def product(self, expr: sp.Expr, where: str) -> tuple[sp.Expr, Unit]:
        """A product; a temperature times a number keeps its offset."""
        walked = [self.walk(a, where) for a in expr.args]
        total = BARE
        for _, unit in walked:
            total = total.times(unit)
        numbers = [e for e, _ in walked if e.is_number]
        others = [u for e, u in walked if not e.is_number]
        if len(others) == 1 and others[0].absolute:
            share = Fraction(float(sp.prod(numbers))).limit_denominator(1000)
            total = dataclasses.replace(
                others[0], absolute=others[0].absolute * share, unknown=total.unknown)
        return sp.Mul(*(e for e, _ in walked)), total

    def power(self, expr: sp.Expr, where: str) -> tuple[sp.Expr, Unit]:
        """A power: of any unit with a number as its exponent, else of a pure number."""
        (base, unit), (exponent, _) = self.walk(expr.args[0], where), self.walk(expr.args[1], where)
        if exponent.is_number:
            if unit.absolute:
                raise errors.BadUnit(errors.temperatures_meet(where, unit.text, "K"))
            n = Fraction(float(exponent)).limit_denominator(1000)
            return expr.func(base, exponent), dataclasses.replace(BARE.times(unit, n),
                                                                  bare=unit.bare)
        exponent = self.argument(expr.args[1], where, expr)
        if unit.measure.kind:
            # what unit x^n has depends on n: numbers are what they are
            return expr.func(base, exponent), dataclasses.replace(
                BARE, unknown=frozenset([to_text(exponent)]))
        return expr.func(self.fitted(base, unit, ONE, where, expr), exponent), BARE

    def fitted(self, expr: sp.Expr, unit: Unit, wanted: Unit, where: str,
               whole: sp.Expr) -> sp.Expr:
        """A formula in `unit`, expressed in `wanted`."""
        if unit.bare:
            return expr
        if unit.measure.kind != wanted.measure.kind:
            unknown = sorted(unit.unknown | wanted.unknown)
            if not unit.measure.kind and unit.same_size(ONE):
                return expr  # a pure number takes any
            if unit.same_size(wanted):  # without a factor between them units are documentation
                if not (unknown or holds_numbers(expr)):
                    self.disagreements.setdefault(where, errors.units_disagree(
                        where, to_text(expr), unit.text, wanted.text))
                return expr
            raise errors.BadUnit(errors.units_meet(
                where, to_text(expr), unit.text, wanted.text, unknown))
        if of_other_zero(unit, wanted):
            raise errors.BadUnit(errors.temperatures_meet(where, unit.text, wanted.text))
        if unit.same_size(wanted):
            return expr
        return self.factor(unit, wanted, where, whole) * expr

    def factor(self, unit: Unit, wanted: Unit, where: str, whole: sp.Expr) -> sp.Symbol:
        """The parameter that turns numbers in `unit` into numbers in `wanted`."""
        value = unit.measure.scale / wanted.measure.scale
        text = wanted.times(unit, Fraction(-1)).without_radians().text
        for number in coefficients(whole):
            if not simple(number) and any(
                    math.isclose(number / f, k, rel_tol=_ALIKE)
                    for f in (value, 1 / value) for k in (0.25, 0.5, 1.0, 2.0, 4.0)):
                raise errors.BadUnit(errors.converted_twice(where, number, text, value))
        name = text.replace("1/", "per_").replace("/", "_per_")
        name = "".join(c if c.isalnum() else "_" for c in name).strip("_")
        while (held := self.known.get(name)) is not None:
            if isinstance(held, Parameter) and (held.unit, held.free) == (text, False) and (
                    math.isclose(held.value, value, rel_tol=SAME)):
                self.used = True
                return symbol(name)
            name += "_"
        made = Parameter(name, value, text, free=False, description="between units")
        self.used = True
        self.known = {**self.known, name: made}
        self.added = [*self.added, made]
        return symbol(name)
