"""The grammar of unit texts: products of powers of names, taken apart and written again.

``product = term (("*" | "/" | nothing) term)*`` and ``term = (name | "1" | "(" product ")")
["^" number]``; nothing is ever evaluated.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction

from pikanid import errors

Powers = dict[str, Fraction]

_NOTHING = frozenset(["", "1", "-", "--", "none", "dimensionless", "unitless"])
_TOKEN = re.compile(r"\s*(\*\*|[*/^()·⋅]|[+-]?\d+(?:\.\d+)?|%|°[CF]?|[^\W\d_]\w*)\s*")
_POWER = re.compile(r"[+-]?\d{1,4}(\.\d{1,6})?|[+-]?\d{1,4}/\d{1,4}", re.ASCII)
_SUPERSCRIPTS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
_LONGEST = 80  # limit: characters of a unit
_LARGEST_POWER = 99  # limit: of a unit: none that has a meaning has more


def powers(text: str, symbol: Callable[[str], str]) -> Powers:
    """Units and their exponents, in the order in which they are written.

    Args:
        text: Of the unit.
        symbol: Name -> symbol of the unit, "" where there is no such unit.

    Raises:
        BadUnit: If the text is no product of powers of known units.

    >>> powers("m/s^2", lambda name: name)
    {'m': Fraction(1, 1), 's': Fraction(-2, 1)}
    """
    if text.casefold() in _NOTHING:
        return {}
    reader = _Reader(text, _tokens(text), symbol)
    found, end = reader.product(0)
    if end != len(reader.tokens):
        raise reader.failure()
    return {name: power for name, power in found.items() if power}


def written(found: Powers) -> str:
    """The text of a product of powers, with one fraction bar.

    >>> written({"m": Fraction(1), "s": Fraction(-2), "rad": Fraction(-1)})
    'm/(s^2*rad)'
    """
    above = [_power(name, power) for name, power in found.items() if power > 0]
    below = [_power(name, -power) for name, power in found.items() if power < 0]
    if not below:
        return "*".join(above)
    bottom = below[0] if len(below) == 1 else f"({'*'.join(below)})"
    return f"{'*'.join(above) or '1'}/{bottom}"


def _power(name: str, power: Fraction) -> str:
    if power == 1:
        return name
    if power.denominator == 1:
        return f"{name}^{power}"
    decimal = f"{float(power):.6g}"
    return f"{name}^{decimal}" if Fraction(decimal) == power else f"{name}^({power})"


def _tokens(text: str) -> tuple[str, ...]:
    if len(text) > _LONGEST:
        raise errors.BadUnit(errors.unknown_unit(text))
    # A superscript is a power without its sign: m² is m^2.
    plain = re.sub("[⁰¹²³⁴⁵⁶⁷⁸⁹⁻]+", lambda found: "^" + found[0].translate(_SUPERSCRIPTS),
                   text.strip())
    tokens: list[str] = []
    position = 0
    while position < len(plain):
        found = _TOKEN.match(plain, position)
        if found is None:
            raise errors.BadUnit(errors.unknown_unit(text))
        tokens.append({"**": "^", "·": "*", "⋅": "*"}.get(found[1], found[1]))
        position = found.end()
    return tuple(tokens)


@dataclass(frozen=True)
class _Reader:
    """Recursive descent; each method returns what it read and where it stopped."""

    text: str
    tokens: tuple[str, ...]
    symbol: Callable[[str], str]

    def failure(self) -> errors.BadUnit:
        return errors.BadUnit(errors.unknown_unit(self.text))

    def at(self, position: int) -> str:
        return self.tokens[position] if position < len(self.tokens) else ""

    def product(self, start: int) -> tuple[Powers, int]:
        total, position = self.term(start)
        while self.at(position) not in ("", ")"):
            sign = -1 if self.at(position) == "/" else 1
            position += self.at(position) in ("*", "/")
            found, position = self.term(position)
            for name, power in found.items():
                total[name] = total.get(name, Fraction(0)) + sign * power
        return total, position

    def term(self, position: int) -> tuple[Powers, int]:
        if self.at(position) == "(":
            found, position = self.product(position + 1)
            if self.at(position) != ")":
                raise self.failure()
        else:
            found = {} if self.at(position) == "1" else self.named(self.at(position))
        position += 1
        if self.at(position) == "^":
            exponent, position = self.exponent(position + 1)
            found = {name: power * exponent for name, power in found.items()}
        return found, position

    def named(self, token: str) -> Powers:
        if known := self.symbol(token):
            return {known: Fraction(1)}
        # "m/s2" is common in the headers of instruments.
        if token[-1:] in ("2", "3", "4") and (known := self.symbol(token[:-1])):
            return {known: Fraction(token[-1])}
        raise self.failure()

    def exponent(self, position: int) -> tuple[Fraction, int]:
        """A number, or a number or fraction in parentheses: 2, -2, 0.5, (1/2)."""
        inside, stop = self.at(position), position + 1
        if inside == "(":
            stop = next((k for k in range(position, len(self.tokens)) if self.at(k) == ")"),
                        position)
            inside, stop = "".join(self.tokens[position + 1 : stop]), stop + 1
        if not _POWER.fullmatch(inside):
            raise self.failure()
        top, _, bottom = inside.partition("/")
        if bottom and int(bottom) == 0:
            raise self.failure()
        value = Fraction(top) / Fraction(bottom or 1)
        if abs(value) > _LARGEST_POWER:
            raise self.failure()
        return value, stop
