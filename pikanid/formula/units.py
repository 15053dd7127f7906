"""Physical units: reading unit texts, and converting arrays between them.

Unit texts are read by a small grammar of our own (`pikanid.formula.grammar`); only single names
such as ``mV`` reach pint, so that nothing a file contains is ever evaluated.  Angles
are radians and count as dimensionless, as in the SI: ``1/(s^2*rad^2)`` and ``1/s^2`` convert.

>>> from pikanid.formula import units
>>> units.parse("meter / second**2"), units.parse("1/s^2/rad^2"), units.parse("°")
('m/s^2', '1/(s^2*rad^2)', 'deg')
>>> float(units.convert(180.0, "deg", "rad").round(6))
3.141593
"""

from __future__ import annotations

import difflib
import math
import re
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pikanid import errors
from pikanid.formula.grammar import Powers, powers, written

if TYPE_CHECKING:
    import pint

# Already in normal form: these cost no import of pint (0.4 s).
_PLAIN = frozenset(
    ["", "1", "s", "m", "rad", "deg", "V", "N", "kg", "m/s", "m/s^2", "rad/s", "rad/s^2"])
_COHERENT = frozenset([
    "m", "s", "kg", "A", "K", "mol", "cd", "rad", "sr", "Hz", "N", "Pa", "J", "W", "C", "V", "F",
    "ohm", "Ω", "S", "Wb", "T", "H", "lm", "lx", "Bq", "Gy"])  # fmt: skip
# What people write: of these the nearest is suggested in place of an unknown name.
_COMMON = [
    "second", "minute", "hour", "day", "year", "ms", "min", "rad", "deg", "degree", "radian",
    "turn", "rpm", "hertz", "kHz", "meter", "metre", "mm", "cm", "km", "kg", "gram", "tonne",
    "newton", "kN", "pascal", "kPa", "bar", "joule", "kJ", "watt", "kW", "kWh", "volt", "mV", "kV",
    "ampere", "mA", "coulomb", "farad", "ohm", "siemens", "tesla", "henry", "kelvin", "degC",
    "celsius", "degF", "fahrenheit", "mol", "liter", "litre", "percent"]  # fmt: skip
_OFFSET = frozenset(["degC", "degF"])
_SYMBOLS = {"Ω": "ohm", "°C": "degC", "°F": "degF", "°R": "degR", "°": "deg", "Å": "angstrom"}
_SPOKEN = {"°": "deg", "°C": "degC", "°F": "degF", "%": "percent"}


class Unread(str):
    """The unit text of a file that is no unit: it matters only once its signal is used."""

    __slots__ = ()


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
    return written(powers(text, _symbol))


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


def check(text: str, where: str) -> None:
    """Raise BadUnit unless a unit is known; the usual ones are without an import of pint."""
    if not is_coherent(text) and not is_unit(text):
        raise errors.BadUnit(unknown(text, where))


def unknown(text: str, where: str = "") -> str:
    """The sentence about a unit that is unknown, with the nearest one that is not.

    >>> unknown("Vlt").endswith("Did you mean 'volt'?")
    True
    """
    for name in re.findall(r"[^\W\d_]\w*", text)[:8]:
        if not _symbol(name) and (close := difflib.get_close_matches(name, _COMMON, 1)
                                  or difflib.get_close_matches(name.lower(), _COMMON, 1)):
            text_close = text.replace(name, close[0])
            return errors.unknown_unit(text, where, [text_close] if is_unit(text_close) else close)
    return errors.unknown_unit(text, where)


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


@dataclass(frozen=True)
class Measure:
    """What a unit measures and how large it is.

    Attributes:
        powers: Unit symbols and their exponents, as written.
        kind: Physical dimensions and their exponents, sorted; empty for dimensionless, angles
            included.
        scale: The unit in coherent SI units; the offset of a temperature scale is left out.
        offset: The symbol of a temperature scale that does not begin at absolute zero, else "".
    """

    powers: tuple[tuple[str, Fraction], ...]
    kind: tuple[tuple[str, Fraction], ...]
    scale: float
    offset: str = ""


@lru_cache(maxsize=512)
def measure(text: str) -> Measure:
    """Take a unit apart.

    Raises:
        BadUnit: If it is unknown, or logarithmic, so that it has no size (``dBm``).

    >>> measure("1/h").scale * 3600, measure("mg/l").kind == measure("kg/m^3").kind
    (1.0, True)
    """
    normal = parse(text)
    found = powers(normal, _symbol)
    registry = _registry()
    unit = _unit(normal, delta=True)
    one, two = (float(registry.Quantity(k, unit).to_base_units().magnitude) for k in (1.0, 2.0))
    if not math.isclose(two, 2 * one):
        raise errors.BadUnit(errors.unit_without_size(text))
    kind = {str(name): Fraction(float(power.real)).limit_denominator(1000)
            for name, power in unit.dimensionality.items() if power}
    return Measure(tuple(found.items()), tuple(sorted(kind.items())), one,
                   normal if normal in _OFFSET else "")


@lru_cache(maxsize=512)
def is_coherent(text: str) -> bool:
    """Whether a unit is a product of SI units without prefixes, so that formulas need no factor.

    It is found without pint, which takes 0.4 s to import.

    >>> is_coherent("N*s/m"), is_coherent("1/h"), is_coherent("mm")
    (True, False, False)
    """
    try:
        powers(text.strip(), lambda name: name if name in _COHERENT else "")
    except errors.BadUnit:
        return False
    return True


def begins_elsewhere(text: str) -> bool:
    """Whether it is a temperature scale whose zero is not that of its differences.

    >>> begins_elsewhere("degC"), begins_elsewhere("K"), begins_elsewhere("W/degC")
    (True, False, False)
    """
    found = powers(parse(text), _symbol)
    return len(found) == 1 and any(found.get(name) == 1 for name in _OFFSET)


def absolute_zero(text: str) -> float:
    """The lowest temperature on a scale; zero in every other unit.

    >>> absolute_zero("degC"), absolute_zero("K"), absolute_zero("m")
    (-273.15, 0.0, 0.0)
    """
    return float(convert(0.0, "K", text)) if begins_elsewhere(text) else 0.0


def product(*factors: tuple[str, int | Fraction]) -> str:
    """The unit of a product of powers: what a sensitivity or a covariance is measured in.

    >>> product(("rad", 1), ("m", -1))
    'rad/m'
    """
    total: Powers = {}
    for text, power in factors:
        for name, exponent in powers(parse(text), _symbol).items():
            total[name] = total.get(name, Fraction(0)) + exponent * power
    return written({name: power for name, power in total.items() if power})


def _unit(normal: str, delta: bool = False) -> pint.Unit:
    """pint's unit; temperature scales lose their offset in products, or when `delta` asks."""
    registry = _registry()
    found = powers(normal, _symbol)
    scale = not delta and list(found.values()) == [1]
    unit = registry.Unit("")
    for name, power in found.items():
        known = name if scale or name not in _OFFSET else f"delta_{name}"
        unit = unit * registry.Unit(known) ** (
            int(power) if power.denominator == 1 else float(power)
        )
    return unit


def _fitting(source: str, target: str, a: pint.Unit, b: pint.Unit) -> tuple[pint.Unit, pint.Unit]:
    # pint takes 1 Hz for 1 rad/s; whether a cycle or a radian is meant makes a factor of 2 pi.
    cycles = any(
        "Hz" in x and "rad" in y and "Hz" not in y and not re.search("rad|deg|turn", x) for x,
        y in ((source, target), (target, source)))
    if cycles or not a.is_compatible_with(b):
        raise errors.BadUnit(errors.units_differ(source, target))
    return a, b


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
