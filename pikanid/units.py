"""Physical units: reading unit texts, and converting arrays between them.

Unit texts are read by a small grammar of our own (names, ``*`` ``/`` ``^`` and parentheses); only
single names such as ``mV`` reach pint, so that nothing a file contains is ever evaluated.  Angles
are radians and count as dimensionless, as in the SI: ``1/(s^2*rad^2)`` and ``1/s^2`` convert.

>>> from pikanid import units
>>> units.parse("meter / second**2"), units.parse("1/s^2/rad^2"), units.parse("°")
('m/s^2', '1/(s^2*rad^2)', 'deg')
>>> float(units.convert(180.0, "deg", "rad").round(6))
3.141593
"""

from __future__ import annotations

import re
from fractions import Fraction
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pikanid import errors

if TYPE_CHECKING:
    import pint

Powers = dict[str, Fraction]

# Already in normal form: these cost no import of pint (0.4 s).
_PLAIN = frozenset(
    ["", "1", "s", "m", "rad", "deg", "V", "N", "kg", "m/s", "m/s^2", "rad/s", "rad/s^2"]
)
_OFFSET = frozenset(["degC", "degF"])
_NOTHING = frozenset(["", "1", "-", "--", "none", "dimensionless", "unitless"])
_SYMBOLS = {"Ω": "ohm", "°C": "degC", "°F": "degF", "°R": "degR", "°": "deg", "Å": "angstrom"}
_SPOKEN = {"°": "deg", "°C": "degC", "°F": "degF", "%": "percent"}
_TOKEN = re.compile(r"\s*(\*\*|[*/^()·⋅]|[+-]?\d+(?:\.\d+)?|%|°[CF]?|[^\W\d_]\w*)\s*")
_SUPERSCRIPTS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
_LONGEST = 80
_LARGEST_POWER = 12


@lru_cache(maxsize=1)
def _registry() -> pint.UnitRegistry:
    import pint

    return pint.UnitRegistry(cache_folder=None)


def parse(text: str) -> str:
    """The normal form of a unit text: SI symbols, one fraction bar, ``^`` for powers.

    Args:
        text: Such as ``"m/s^2"``, ``"m s⁻²"``, ``"1/(s^2*rad^2)"``, ``"mV"``, ``"deg/s"``;
            ``""``, ``"1"`` and ``"-"`` stand for dimensionless.

    Returns:
        The normal form, ``""`` for dimensionless; ``parse(parse(text)) == parse(text)``.

    Raises:
        BadUnit: If the text is not a product of powers of known units.

    >>> parse("kg*m**2*s**-2"), parse("degree"), parse("")
    ('kg*m^2/s^2', 'deg', '')
    """
    stripped = text.strip()
    if stripped in _PLAIN:
        return "" if stripped == "1" else stripped
    return _parse(stripped)


@lru_cache(maxsize=512)
def _parse(text: str) -> str:
    return _written(_powers(text))


def is_unit(text: str) -> bool:
    """Whether `text` can be read as a unit.

    >>> is_unit("mV"), is_unit("filtered")
    (True, False)
    """
    try:
        parse(text)
    except errors.BadUnit:
        return False
    return True


def convertible(source: str, target: str) -> bool:
    """Whether values in `source` can be expressed in `target` (raises BadUnit for unknown units).

    >>> convertible("deg/s", "rad/s"), convertible("m", "s")
    (True, False)
    """
    a, b = parse(source), parse(target)
    return a == b or _unit(a).is_compatible_with(_unit(b))


def convert(values: ArrayLike, source: str, target: str) -> NDArray[np.float64]:
    """Values given in `source`, expressed in `target`.

    Args:
        values: Scalar or array of any shape.
        source: Unit of `values`.
        target: Unit of the result.

    Returns:
        A new float array of the same shape.

    Raises:
        BadUnit: If a unit is unknown or the two are of different kinds.

    >>> convert([1.0, 2.0], "mV", "V")
    array([0.001, 0.002])
    """
    a, b = parse(source), parse(target)
    array = np.array(values, dtype=float)
    if a == b:
        return array
    unit_a, unit_b = _fitting(source, target, _unit(a), _unit(b))
    return np.asarray(_registry().Quantity(array, unit_a).to(unit_b).magnitude, dtype=float)


def factor(source: str, target: str) -> float:
    """By what to multiply a *difference* (a standard deviation, a slope) in `source`.

    The offset of temperature scales does not enter: a σ of 1 degC is a σ of 1 K.

    >>> factor("degC", "K"), factor("mV", "V")
    (1.0, 0.001)
    """
    a, b = parse(source), parse(target)
    if a == b:
        return 1.0
    unit_a, unit_b = _fitting(source, target, _unit(a, delta=True), _unit(b, delta=True))
    return float(_registry().Quantity(1.0, unit_a).to(unit_b).magnitude)


def si(text: str) -> str:
    """The coherent SI unit of the same kind, with radians kept.

    >>> si("deg/s"), si("mm"), si("g")
    ('rad/s', 'm', 'kg')
    """
    quantity = _registry().Quantity(1.0, _unit(parse(text))).to_base_units()
    return parse(str(quantity.units).replace(" ", ""))


def product(*factors: tuple[str, int]) -> str:
    """The unit of a product of powers: what a sensitivity or a covariance is measured in.

    >>> product(("rad", 1), ("m", -1))
    'rad/m'
    """
    total: Powers = {}
    for text, power in factors:
        for name, exponent in _powers(parse(text)).items():
            total[name] = total.get(name, Fraction(0)) + exponent * power
    return _written({name: power for name, power in total.items() if power})


def _unit(normal: str, delta: bool = False) -> pint.Unit:
    """pint's unit; temperature scales lose their offset in products, or when `delta` asks."""
    registry = _registry()
    powers = _powers(normal)
    scale = not delta and list(powers.values()) == [1]
    unit = registry.Unit("")
    for name, power in powers.items():
        known = name if scale or name not in _OFFSET else f"delta_{name}"
        unit = unit * registry.Unit(known) ** (
            int(power) if power.denominator == 1 else float(power)
        )
    return unit


def _fitting(source: str, target: str, a: pint.Unit, b: pint.Unit) -> tuple[pint.Unit, pint.Unit]:
    # pint takes 1 Hz for 1 rad/s; whether a cycle or a radian is meant makes a factor of 2 pi.
    cycles = any("Hz" in x and "rad" in y for x, y in ((source, target), (target, source)))
    if cycles or not a.is_compatible_with(b):
        raise errors.BadUnit(errors.units_differ(source, target))
    return a, b


def _powers(text: str) -> Powers:
    """Units and their exponents, in the order in which they are written."""
    if text.casefold() in _NOTHING:
        return {}
    if len(text) > _LONGEST:
        raise errors.BadUnit(errors.unknown_unit(text))
    tokens = _tokens(text)
    powers, end = _product(tokens, 0, text)
    if end != len(tokens):
        raise errors.BadUnit(errors.unknown_unit(text))
    return {name: power for name, power in powers.items() if power}


def _tokens(text: str) -> list[str]:
    # A superscript is a power without its sign: m² is m^2.
    plain = re.sub(
        "[⁰¹²³⁴⁵⁶⁷⁸⁹⁻]+", lambda found: "^" + found[0].translate(_SUPERSCRIPTS), text.strip()
    )
    tokens: list[str] = []
    position = 0
    while position < len(plain):
        found = _TOKEN.match(plain, position)
        if found is None:
            raise errors.BadUnit(errors.unknown_unit(text))
        token = found[1]
        tokens.append({"**": "^", "·": "*", "⋅": "*"}.get(token, token))
        position = found.end()
    return tokens


def _product(tokens: list[str], start: int, text: str) -> tuple[Powers, int]:
    """``term (('*' | '/' | nothing) term)*``; a missing sign between two terms multiplies."""
    total, position = _term(tokens, start, text)
    while position < len(tokens) and tokens[position] != ")":
        sign = 1
        if tokens[position] in "*/":
            sign = 1 if tokens[position] == "*" else -1
            position += 1
        powers, position = _term(tokens, position, text)
        for name, power in powers.items():
            total[name] = total.get(name, Fraction(0)) + sign * power
    return total, position


def _term(tokens: list[str], position: int, text: str) -> tuple[Powers, int]:
    """A name, ``1`` or a parenthesis, with an optional power."""
    if position >= len(tokens):
        raise errors.BadUnit(errors.unknown_unit(text))
    token = tokens[position]
    if token == "(":
        powers, position = _product(tokens, position + 1, text)
        if position >= len(tokens) or tokens[position] != ")":
            raise errors.BadUnit(errors.unknown_unit(text))
    elif token == "1":
        powers = {}
    else:
        powers = _named(token, text)
    position += 1
    if position < len(tokens) and tokens[position] == "^":
        exponent, position = _exponent(tokens, position + 1, text)
        powers = {name: power * exponent for name, power in powers.items()}
    return powers, position


def _exponent(tokens: list[str], position: int, text: str) -> tuple[Fraction, int]:
    """A number, or a number or fraction in parentheses: ``2``, ``-2``, ``0.5``, ``(1/2)``."""
    if position < len(tokens) and tokens[position] == "(":
        stop = tokens.index(")", position) if ")" in tokens[position:] else len(tokens)
        inside, position = "".join(tokens[position + 1 : stop]), stop + 1
    else:
        inside, position = "".join(tokens[position : position + 1]), position + 1
    if not re.fullmatch(r"[+-]?\d{1,4}(\.\d{1,6})?|[+-]?\d{1,4}/\d{1,4}", inside, re.ASCII):
        raise errors.BadUnit(errors.unknown_unit(text))
    top, _, bottom = inside.partition("/")
    if bottom and int(bottom) == 0:
        raise errors.BadUnit(errors.unknown_unit(text))
    value = Fraction(top) / Fraction(bottom or 1)
    if abs(value) > _LARGEST_POWER:
        raise errors.BadUnit(errors.unknown_unit(text))
    return value, position


def _named(token: str, text: str) -> Powers:
    symbol = _symbol(token)
    if symbol:
        return {symbol: Fraction(1)}
    # "m/s2" is common in the headers of instruments.
    name, power = token[:-1], token[-1:]
    if power in tuple("234") and (symbol := _symbol(name)):
        return {symbol: Fraction(power)}
    raise errors.BadUnit(errors.unknown_unit(text))


@lru_cache(maxsize=512)
def _symbol(name: str) -> str:
    """The short symbol of one unit name in ASCII, "" where there is no such unit."""
    import pint

    spoken = _SPOKEN.get(name, name)
    if not spoken.isidentifier():
        return ""
    try:
        symbol = str(_registry().get_symbol(spoken))
    except (pint.errors.PintError, AttributeError, KeyError, ValueError):
        return ""
    symbol = _SYMBOLS.get(symbol, symbol.replace("µ", "u").replace("Ω", "ohm"))
    return symbol if symbol.isidentifier() else spoken


def _written(powers: Powers) -> str:
    above = [_power(name, power) for name, power in powers.items() if power > 0]
    below = [_power(name, -power) for name, power in powers.items() if power < 0]
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
