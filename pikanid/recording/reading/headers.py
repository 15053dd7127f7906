"""Column headers: the name, the unit in brackets, and finding what a caller asks for."""

from __future__ import annotations

import difflib
import re
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

from pikanid import errors
from pikanid.formula import units
from pikanid.recording.reading.table import Column

# "theta [deg]" or "theta (deg)"; the unit itself may hold one pair of parentheses.
_HEADER = re.compile(
    r"(?P<name>.*\S)\s*(?:\[(?P<square>[^\[\]]*)\]|\((?P<round>(?:[^()]|\([^()]*\))*)\))")


@dataclass(frozen=True, eq=False)
class Named:
    """A column under the name that its channel has unless the caller maps it."""

    name: str
    unit: str
    column: Column


def named(columns: Iterable[Column], where: str) -> list[Named]:
    """Columns with their headers taken apart.

    Where two headers differ in their units only, the whole header is the name.

    Raises:
        BadRecording: If two headers are the same.
    """
    split = [(*_split(column.header, k + 1), column) for k, column in enumerate(columns)]
    whole = Counter(column.header for *_, column in split if column.header)
    for header, count in whole.items():
        if count > 1:
            raise errors.BadRecording(errors.header_twice(where, header))
    bare = Counter(name for name, *_ in split)
    return [
        Named(name if bare[name] == 1 else column.header,
              unit if column.unit is None else _normal(column.unit), column)
        for name, unit, column in split
    ]


def find(wanted: str, available: list[Named], where: str) -> Named:
    """The column with this header, written with or without its unit.

    Raises:
        BadRecording: If there is none; the message lists those that there are.
    """
    for found in available:
        if wanted in (found.column.header, found.name):
            return found
    headers = [found.column.header or found.name for found in available]
    close = difflib.get_close_matches(wanted, headers, n=1, cutoff=0.5)
    raise errors.BadRecording(errors.missing_channel(where, wanted, headers, close))


def _split(header: str, number: int) -> tuple[str, str]:
    match = _HEADER.fullmatch(header.strip())
    if match is None:
        return header.strip() or f"column {number}", ""
    unit = (match["square"] if match["square"] is not None else match["round"]).strip()
    return match["name"].strip(), _normal(unit)


def _normal(unit: str) -> str:
    # An unknown unit matters only once the channel is used: the model may not need it.
    return units.parse(unit) if units.is_unit(unit) else units.Unread(unit)
