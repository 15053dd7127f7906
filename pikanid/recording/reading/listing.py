"""What a file holds, before anything of it is used: names, units, rates, spans, numbers."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pikanid import errors
from pikanid.formula import units
from pikanid.recording.channel import Channel
from pikanid.recording.reading.columns import Request, TimeBases
from pikanid.recording.reading.door import opened
from pikanid.recording.reading.headers import named
from pikanid.recording.reading.reader import reader
from pikanid.recording.reading.table import Options


@dataclass(frozen=True)
class Listed:
    """One channel of a file.

    Attributes:
        name: By which it is asked for.
        path: Its whole name, where it has one.
        unit: As the project writes it, or as the file has it if it is unknown.
        samples: How many.
        start, stop: First and last time [s]; NaN if it has no times.
        rate: Samples a second, by the median interval; NaN if it has no times.
        uniform: Whether all intervals agree within 0.1 %.
        remark: Why it cannot be used as it stands, "" if it can.
    """

    name: str
    path: str
    unit: str
    samples: int
    start: float
    stop: float
    rate: float
    uniform: bool
    remark: str


@dataclass(frozen=True)
class Listing:
    """The channels of a file, its format, when its t = 0 was (POSIX [s]), and notes on it."""

    name: str
    format: str
    began: float | None
    channels: tuple[Listed, ...]
    notes: tuple[str, ...]


def listing(path: str | os.PathLike[str], sheet: str | int | None = None,
            rate: float | None = None) -> Listing:
    """List the channels of a file of any format.

    Args:
        path: The file.
        sheet: Of a workbook.
        rate: Sampling rate [Hz] of what has no times.

    Raises:
        BadRecording: If the file cannot be read.
        BadSetting: If its format needs what is not installed.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder) / "run.csv"
    ...     _ = file.write_text("t,theta [deg]\\n0,1\\n0.1,2\\n")
    ...     found = listing(file)
    >>> found.channels[0].unit, round(found.channels[0].rate, 6)
    ('deg', 10.0)
    """
    kind, content, _ = opened(path)
    where = Path(path).name
    table = reader(kind)(content, where, Options(sheet, listed=True))
    available = named(table.columns, where)
    bases = TimeBases(table, Request({}, rate, {}), where, available, None)
    clocks = bases.clocks()
    found = []
    for one in available:
        if one in clocks:
            continue
        time, remark = None, one.column.defect
        if not remark:
            time, remark, is_gap = bases.times(one)
            remark = errors.times_to_be_told() if is_gap else remark
        if not remark and isinstance(one.unit, units.Unread):
            remark = errors.unit_to_be_told(one.unit)
        remark = remark.removeprefix(f"'{where}'").lstrip(":, ")
        at = Channel(one.name or "?", np.empty(0), np.empty(0)) if time is None else Channel(
            one.name, time, np.zeros(len(time)))
        found.append(Listed(
            one.name, one.column.path, str(one.unit), len(one.column.values),
            float(at.time[0]) if len(at) else np.nan, float(at.time[-1]) if len(at) else np.nan,
            1 / at.interval, at.uniform, remark))
    return Listing(where, kind.title, bases.began(), tuple(found), table.notes)
