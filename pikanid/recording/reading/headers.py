"""Column headers: the name, the unit in brackets, and finding what a caller asks for."""

from __future__ import annotations

import difflib
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pikanid import errors
from pikanid.formula import units
from pikanid.recording.reading.signals import fits, is_part
from pikanid.recording.reading.table import Column

# "theta [deg]" or "theta (deg)"; the unit itself may hold one pair of parentheses.
_HEADER = re.compile(
    r"(?P<name>.*\S)\s*(?:\[(?P<square>[^\[\]]*)\]|\((?P<round>(?:[^()]|\([^()]*\))*)\))")

EPOCHS = {"ms": 1e3, "us": 1e6, "ns": 1e9}  # definition: counts a second
YEARS = (3.15e8, 4.1e9)  # limit: seconds from 1970 to 1980 and 2100
TIME_NAMES = ("t", "time", "times", "timestamp", "timestamps", "zeit")

# What test benches write and units are not called, or where it would be read as another one: "Grad"
# as a thousand million radians, "Nm" as something that is no torque.
_BENCH = {"Nm": "N*m", "mNm": "mN*m", "kNm": "kN*m", "Ncm": "N*cm", "Nms": "N*m*s", "U/min": "rpm",
          "RPM": "rpm", "Rpm": "rpm", "Grad": "deg", "Deg": "deg", "Degrees": "deg",
          "Deg C": "degC", "deg C": "degC", "DegC": "degC", "Celsius": "degC", "Volt": "V",
          "Volts": "V", "Amp": "A", "Amps": "A", "Ampere": "A", "Newton": "N", "Meter": "m",
          "Ohm": "ohm", "Ohms": "ohm", "Sec": "s", "Seconds": "s", "Hertz": "Hz", "none": ""}


@dataclass(frozen=True, eq=False)
class Named:
    """A column under the name that its channel has unless the caller maps it.

    `counted` are times without a unit that can only be counted since 1970, in `unit`.
    """

    name: str
    unit: str
    column: Column
    counted: bool = False


def named(columns: Iterable[Column], where: str) -> list[Named]:
    """Columns with their headers taken apart.

    Where two headers differ in their units only, the whole header is the name.

    Raises:
        BadRecording: If two headers are the same.
    """
    split = [(*_split(column, k + 1), column) for k, column in enumerate(columns)]
    whole = Counter(column.header for *_, column in split if column.header)
    for header, count in whole.items():
        if count > 1:
            raise errors.BadRecording(errors.header_twice(where, header))
    bare = Counter(name for name, *_ in split)
    return [_counted(Named(name if bare[name] == 1 else column.header,
                           unit if column.unit is None else _normal(column.unit), column))
            for name, unit, column in split]


def _counted(found: Named) -> Named:
    """The column; times without a unit that as seconds would lie thousands of years ahead, and as
    another count between 1980 and 2100, have that one.
    """
    if found.unit or found.column.is_clock or not are_times([(found.name, None)])[0]:
        return found
    values = found.column.values[np.isfinite(found.column.values)][:1]
    for unit, count in EPOCHS.items():
        if np.all((values / count > YEARS[0]) & (values / count < YEARS[1])) and len(values):
            return replace(found, unit=unit, counted=True)
    return found


def are_times(calls: Sequence[tuple[str, str | None]]) -> list[bool]:
    """Which names, each with its unit, say that they are times.

    One in capitals says so only where its unit, if it has any, is one of time, and where it is not
    there in small letters, too; ``T``, which may be a temperature, only beside no other.

    >>> are_times([("T", "degC"), ("y", "mm")]), are_times([("T", None), ("y", "mm")])
    ([False, False], [True, False])
    >>> are_times([("T", None), ("Time", "s")]), are_times([("t", "s"), ("Time", "K")])
    ([False, True], [True, False])
    """
    told = {name for name, _ in calls if name.casefold() in TIME_NAMES}

    def is_time(name: str, unit: str | None) -> bool:
        rivals = told if name == "T" else {name.casefold()} & told
        return name in told and (name == name.casefold() or not (rivals - {name} or _no_time(unit)))

    return [is_time(*call) for call in calls]


def _no_time(unit: str | None) -> bool:
    known = _normal(unit or "s")
    return units.is_unit(known) and not units.convertible(known, "s")


def find(wanted: str, available: list[Named], where: str) -> Named:
    """The column with this header, with or without its unit, or the one that a pattern fits.

    Raises:
        BadRecording: If there is none, or several; the message lists those that there are.
    """
    known = matching(wanted, available)
    if len(known) > 1:
        raise errors.BadRecording(errors.several_columns(
            where, wanted, [found.column.path or found.column.header for found in known]))
    if not known:
        raise errors.BadRecording(missing(wanted, available, where))
    return known[0]


def matching(wanted: str, available: list[Named]) -> list[Named]:
    """The column that is called so; where none is, those that the pattern fits, or else those of
    whose path it is a part; clocks that a file keeps beside its signals are found by name only.
    """
    calls = [(found.column.header, found.name, found.column.path, found.column.alias)
             for found in available]
    exact = [found for found, names in zip(available, calls, strict=True) if wanted in names]
    signals = [(found, names) for found, names in zip(available, calls, strict=True)
               if not _is_beside(found)]
    return (exact[:1] or [found for found, names in signals if fits(wanted, *names)]
            or [found for found, names in signals
                if found.column.path and is_part(wanted, found.column.path)])


def missing(wanted: str, available: list[Named], where: str) -> str:
    """The sentence that says which columns there are."""
    headers = [found.column.header or found.name for found in available if not _is_beside(found)]
    close = difflib.get_close_matches(wanted, headers, n=1, cutoff=0.5)
    return errors.missing_channel(where, wanted, headers, close)


def _is_beside(found: Named) -> bool:
    return found.column.is_clock and bool(found.column.path)


def _split(column: Column, number: int) -> tuple[str, str]:
    header = column.header.strip()
    match = _HEADER.fullmatch(header)
    if match is None:
        return header or f"column {number}", ""
    unit = (match["square"] if match["square"] is not None else match["round"]).strip()
    # "force[0]" is an element of an array where names are more than the heads of a table
    if column.path and (column.unit is not None or unit.isdecimal() or not units.is_unit(unit)):
        return header, ""
    return match["name"].strip(), _normal(unit)


def _normal(unit: str) -> str:
    """The unit of a header; an unknown one matters only once its channel is used, if at all."""
    text = _BENCH.get(unit.strip(), unit)
    if not units.is_unit(text):
        text = re.sub(r"(?<=[A-Za-z])(-?\d+)", r"^\1", text)  # "m s-2", as CF conventions have it
    return units.parse(text) if units.is_unit(text) else units.Unread(unit)
