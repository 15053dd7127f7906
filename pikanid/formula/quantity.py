"""Numbers with a unit behind them, as people write them: ``"0.1deg"``, ``"45 mm"``."""

from __future__ import annotations

import math
import re

from pikanid import errors
from pikanid.formula import units

_QUANTITY = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*", re.DOTALL)


def parts(text: str) -> tuple[str, str] | None:
    """Number and unit of a text, as they are written; None where it does not begin with a number.

    >>> parts("-45 mm"), parts("1e3"), parts("mm")
    (('-45', 'mm'), ('1e3', ''), None)
    """
    match = _QUANTITY.fullmatch(text)
    return None if match is None else (match[1], match[2])


def quantity(text: str, unit: str, where: str, difference: bool = False) -> float:
    """A number in `unit`; a unit written behind it is converted, none means `unit` itself.

    Args:
        text: Such as ``"0.1deg"``, ``"45 mm"``, ``"0.3/h"``, ``"1e-3"``.
        unit: Wanted.
        where: Named in messages.
        difference: Whether it is a difference, as a standard deviation is: a sigma of 1 degC is
            one of 1 K.

    Raises:
        BadSetting: If the text does not start with a finite number.
        BadUnit: If its unit is unknown or of another kind.

    >>> quantity("45 mm", "m", "l_theta")
    0.045
    """
    found = parts(text)
    if found is None or not math.isfinite(float(found[0])):
        raise errors.BadSetting(errors.not_a_quantity(text, where))
    value, given = float(found[0]), found[1]
    if not given:
        return value
    given = f"1{given}" if given.startswith("/") else given
    units.check(given, where)
    if not units.convertible(given, unit):
        raise errors.BadUnit(errors.units_differ(given, unit, where))
    if difference:
        return value * units.factor(given, unit)
    return float(units.convert(value, given, unit))
