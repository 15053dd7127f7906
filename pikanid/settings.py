"""What settings can hold: the annotation of a field says its range, and `check` keeps to it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, fields, is_dataclass
from functools import cache
from math import inf
from sys import float_info
from typing import Annotated, Any, TypeVar, get_args, get_origin, get_type_hints

from pikanid import errors


@dataclass(frozen=True)
class Range:
    """Finite numbers between two bounds.

    Attributes:
        low, high: The bounds.
        whole: Whether they are whole numbers.
        inside: Whether the bounds themselves are left out.
    """

    low: float = -inf
    high: float = inf
    whole: bool = False
    inside: bool = False

    def __contains__(self, value: object) -> bool:
        if isinstance(value, bool) or not isinstance(value, int if self.whole else int | float):
            return False
        bounds = self.low < value < self.high if self.inside else self.low <= value <= self.high
        return abs(value) <= float_info.max and bounds

    def __str__(self) -> str:
        number = "a whole number" if self.whole else "a number"
        if self.inside:
            return f"{number} between {self.low:g} and {self.high:g}"
        if self.high < inf:
            return f"{number} from {self.low:g} to {self.high:g}"
        return f"{number}, {self.low:g} or more" if self.low > -inf else number


Kind = TypeVar("Kind")
ASCENDING = "ascending"  # of a tuple
Rate = Annotated[float, Range(0, 1, inside=True)]  # a probability; none is sure
Share = Annotated[float, Range(0, 1)]
Amount = Annotated[float, Range(0)]
Factor = Annotated[float, Range(1)]
Signed = Annotated[float, Range()]
Count = Annotated[int, Range(1, whole=True)]


class Checked:
    """Base of settings: frozen dataclasses whose fields keep to the ranges they are annotated with.

    Raises:
        BadSetting: If a value is none that its field can have.
    """

    def __post_init__(self) -> None:
        check(self)


def check(settings: Any, group: str = "", values: Mapping[str, Any] | None = None) -> None:
    """Refuse values that the annotations of their fields do not allow.

    Args:
        settings: A dataclass; its fields are annotated with a range, with a tuple of ranges (which
            may be `ASCENDING`), or are such dataclasses; others are not looked at.
        group: Before the names of its fields.
        values: Of some fields, in place of what it holds.

    Raises:
        BadSetting: With the name of the field.
    """
    hints = get_type_hints(type(settings), include_extras=True)
    given = {f.name: getattr(settings, f.name) for f in fields(settings)}
    for field, value in (given if values is None else values).items():
        hint, name = hints[field], f"{group}{field}"
        if isinstance(hint, type) and is_dataclass(hint):
            if type(value) is not hint:  # one of a narrower kind would have fields unknown here
                raise _refused(name, value, f"a {hint.__name__}")
            check(value, f"{name}.")
        elif (ranges := ranges_of(hint)) is not None:
            _check_numbers(name, value, ranges, ASCENDING in getattr(hint, "__metadata__", ()))


def of_kind(settings: Any, kind: type[Kind]) -> Kind:
    """The settings, if they are of that kind.

    Raises:
        BadSetting: If they are anything else.
    """
    if not isinstance(settings, kind):
        raise errors.BadSetting(errors.not_of_kind(
            "'settings'", type(settings).__name__, kind.__name__))
    return settings


def ranges_of(hint: Any) -> Range | tuple[Range, ...] | None:
    """The range that an annotation gives, those of a tuple's entries, or None."""
    if get_origin(hint) is not Annotated:
        if get_origin(hint) is not tuple:
            return None
        found = [ranges_of(entry) for entry in get_args(hint)]
        return tuple(r for r in found if isinstance(r, Range)) or None
    inner, *marks = get_args(hint)
    return next((m for m in marks if isinstance(m, Range)), None) or ranges_of(inner)


def _check_numbers(name: str, value: Any, ranges: Range | tuple[Range, ...],
                   ascending: bool) -> None:
    if isinstance(ranges, Range):
        if value not in ranges:
            raise _refused(name, value, str(ranges))
        return
    if not isinstance(value, tuple) or len(value) != len(ranges) or any(
            v not in r for v, r in zip(value, ranges, strict=True)):
        raise _refused(name, value, f"{len(ranges)} of these: {ranges[0]}")
    if ascending and list(value) != sorted(value):
        raise _refused(name, value, "the smaller one first")


def _refused(name: str, value: Any, wanted: str) -> errors.BadSetting:
    return errors.BadSetting(errors.bad_value(f"The setting {name}", value, wanted))


def items(settings: Any) -> Iterator[tuple[str, Any]]:
    """Name, as "search.faint", and value of every field of a dataclass, in their order."""
    for f in fields(settings):
        value = getattr(settings, f.name)
        if is_dataclass(value):
            yield from ((f"{f.name}.{inner}", own) for inner, own in items(value))
        else:
            yield f.name, value


def changed(settings: Any) -> dict[str, Any]:
    """The fields that differ from the defaults of their dataclass, by name as in `items`."""
    kind: Any = type(settings)
    usual = _usual(kind)
    if settings == usual:
        return {}
    known = dict(items(usual))
    return {name: value for name, value in items(settings) if value != known[name]}


@cache
def _usual(kind: Callable[[], Any]) -> Any:
    return kind()


def told(settings: Any) -> str:
    """The same in words, for a report."""
    words = ", ".join(f"{name} = {_number(value)}" for name, value in changed(settings).items())
    return f"Settings: {words}; all others defaults." if words else "Settings: defaults."


def _number(value: Any) -> str:
    if isinstance(value, tuple):
        return "(" + ", ".join(map(_number, value)) + ")"
    return f"{value:g}" if isinstance(value, int | float) else str(value)
