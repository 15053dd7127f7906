"""How much a formula may ask of SymPy, whose time and memory grow faster than its length."""

from __future__ import annotations

import sympy as sp

# A formula beyond these is none that a person or this package has written.
MAX_LENGTH = 20_000  # limit: characters of a formula
MAX_DEPTH = 60  # limit: brackets within brackets
MAX_POWER = 1000  # limit: larger whole exponents would be multiplied out into numbers without end
MAX_NAME = 200  # limit: characters of a name
MAX_BITS = 1100  # limit: of a whole number or of either side of a fraction: beyond any float
MAX_WORK = 4000.0  # limit: for all formulas of a model; a unit takes SymPy one or two milliseconds

_TWICE = ("dead_zone",)  # holds its argument twice
_COMPARED = ("min", "max", "clip")  # every argument with every other
_ASKED = ("abs", "sign", "step", "log", "sqrt")  # for the sign of their argument


class Work:
    """What the formulas of one file may yet cost SymPy, whose time grows faster than their length.

    >>> Work(10).call("max", depth=1), Work(10).call("max", depth=9)
    (True, False)
    """

    def __init__(self, left: float = MAX_WORK):
        self.left = left

    def product(self, factors: int) -> bool:
        """Count a product; whether it may be made."""
        return self._spend(factors**2 / 30)

    def power(self, exponent: sp.Expr) -> bool:
        """Count a power; whether it may be made."""
        return self._spend(1 if exponent.is_Integer else 10)

    def call(self, name: str, depth: int) -> bool:
        """Count a function that stands inside of `depth` others; whether it may be made."""
        if name in _TWICE:
            return self._spend(2.0**depth)
        if name in _COMPARED:
            return self._spend(1 + 2 * depth**2)
        return self._spend((1 + depth) * (3 if name in _ASKED else 1))

    def _spend(self, cost: float) -> bool:
        self.left -= cost
        return self.left >= 0
