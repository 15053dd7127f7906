"""Are the values of settings such as their fields can have?"""

from __future__ import annotations

from dataclasses import MISSING, fields
from math import isfinite
from typing import Any

from pikanid import errors


def check(settings: Any, group: str = "") -> None:
    """Refuse values that are not of the kind of their field's default, or negative.

    Args:
        settings: A dataclass; the defaults of its fields are numbers, tuples of numbers, or such
            dataclasses.
        group: Before the names of its fields.

    Raises:
        BadSetting: With the name of the field.
    """
    for f in fields(settings):
        value, name = getattr(settings, f.name), f"{group}{f.name}"
        if f.default_factory is not MISSING:
            kind = type(f.default_factory())
            if not isinstance(value, kind):
                raise errors.BadSetting(errors.bad_value(
                    f"The setting {name}", value, f"a {kind.__name__}"))
            check(value, f"{name}.")
        elif not _alike(value, f.default):
            raise errors.BadSetting(errors.bad_value(
                f"The setting {name}", value, _wanted(f.default)))


def _alike(value: Any, default: Any) -> bool:
    if isinstance(default, tuple):
        return isinstance(value, tuple) and len(value) == len(default) and all(
            map(_alike, value, default))
    if isinstance(default, int):
        return type(value) is int and value >= 1
    return isinstance(value, int | float) and not isinstance(value, bool) and (
        isfinite(value) and value >= 0)


def _wanted(default: Any) -> str:
    if isinstance(default, tuple):
        return f"{len(default)} of these: {_wanted(default[0])}"
    return "a whole number, 1 or more" if isinstance(default, int) else "a number, 0 or more"
