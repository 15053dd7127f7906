"""The unit in which a formula comes out: what `pikanid.model.units` reckons with."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction

import sympy as sp

from pikanid.formula import units

SAME = 1e-9  # numerical: relative difference of two scales that are one


@dataclass(frozen=True)
class Unit:
    """The unit in which a formula comes out.

    Attributes:
        measure: Kind, size and symbols.
        bare: Whether only numbers and names without a unit are in it: then it takes any unit.
        absolute: How many times a temperature with an offset is in it: 0 in a difference.
        unknown: Names without a unit in it.
    """

    measure: units.Measure
    bare: bool = False
    absolute: Fraction = Fraction(0)
    unknown: frozenset[str] = frozenset()

    @property
    def text(self) -> str:
        """As a user would write it."""
        return units.product(*self.measure.powers)

    def times(self, other: Unit, power: Fraction = Fraction(1)) -> Unit:
        """The unit of self·otherⁿ; an offset is lost in a product."""
        a, b = self.measure, other.measure
        made = units.Measure(_together(a.powers, b.powers, power), _together(a.kind, b.kind, power),
                             a.scale * b.scale ** float(power))
        return Unit(made, self.bare and other.bare, unknown=self.unknown | other.unknown)

    def without_radians(self) -> Unit:
        """Without radians, unless other angles are all that is there."""
        kept = tuple(pair for pair in self.measure.powers if pair[0] != "rad")
        if kept and all(not units.measure(name).kind for name, _ in kept):
            return self
        return dataclasses.replace(self, measure=dataclasses.replace(self.measure, powers=kept))

    def same_size(self, other: Unit) -> bool:
        """Whether numbers in both mean the same, their kinds being the same."""
        return math.isclose(self.measure.scale, other.measure.scale, rel_tol=SAME)


def _together(a: Iterable[tuple[str, Fraction]], b: Iterable[tuple[str, Fraction]],
              power: Fraction) -> tuple[tuple[str, Fraction], ...]:
    total = dict(a)
    for name, exponent in b:
        total[name] = total.get(name, Fraction(0)) + exponent * power
    return tuple(sorted((name, value) for name, value in total.items() if value))


ONE = Unit(units.Measure((), (), 1.0))  # definition: no unit at all
BARE = dataclasses.replace(ONE, bare=True)
SECOND = Unit(units.Measure(
    (("s", Fraction(1)),), (("[time]", Fraction(1)),), 1.0))  # definition: of the SI


def declared(text: str, name: str = "") -> Unit:
    """The unit of a part of a model; one without a unit is remembered by its `name`."""
    if not text:
        return dataclasses.replace(BARE, unknown=frozenset([name] if name else []))
    measure = units.measure(text)
    return Unit(measure, absolute=Fraction(bool(measure.offset)))


def of_other_zero(a: Unit, b: Unit) -> bool:
    """Whether a temperature counted from a zero of its own meets one that is counted otherwise."""
    if not (a.absolute or b.absolute):
        return False
    difference = any(u.text.startswith("delta_") for u in (a, b))
    return not a.same_size(b) or (a.text != b.text and not difference)


def coefficients(expr: sp.Expr) -> list[float]:
    """Sizes of the numbers that stand in a formula, those of one product together."""
    found = []
    for node in sp.preorder_traversal(expr):
        if node.is_Mul:
            found.append(abs(float(sp.prod([a for a in node.args if a.is_number]))))
        elif node.is_number and node.is_Atom:
            found.append(abs(float(node)))
    return [c for c in found if math.isfinite(c) and c > 0]


def holds_numbers(expr: sp.Expr) -> bool:
    """Whether a product in a formula has a number for a factor, which may have a unit.

    >>> x, v = sp.symbols("x v")
    >>> holds_numbers(x**2 - v / x), holds_numbers(sp.tanh(10 * v)), holds_numbers((x - v) / 0.5)
    (False, True, True)
    """
    return any(abs(sp.prod([a for a in node.args if a.is_number])) != 1
               for node in expr.atoms(sp.Mul))


def simple(number: float) -> bool:
    """Whether a number is one that formulas hold by their nature: 2, 1/2, 3/4."""
    return any(math.isclose(number * k, round(number * k), rel_tol=1e-12) and 0 < number * k <= 12
               for k in (1, 2, 3, 4, 6, 8, 12))
