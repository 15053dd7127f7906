"""Files of any supported format as channels; one format a module.

`door` looks at the file itself, a format's module makes a `Table` of it, and `columns` makes
channels of the table.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from pikanid.recording.channel import Channel
from pikanid.recording.reading import csv, mat, npz, parquet, spreadsheet
from pikanid.recording.reading.columns import Request, channels
from pikanid.recording.reading.door import kind_and_content
from pikanid.recording.reading.table import Table

__all__ = ["Found", "read"]


@dataclass(frozen=True)
class Found:
    """What a file holds: channels, notes, unusable columns, and the stem of its name."""

    channels: tuple[Channel, ...]
    notes: tuple[str, ...]
    unreadable: Mapping[str, str]
    stem: str


def read(
    path: str | os.PathLike[str],
    columns: Mapping[str, str | int] | None = None,
    rate: float | None = None,
    sheet: str | int | None = None,
    units: Mapping[str, str] | None = None,
    delimiter: str | None = None,
    decimal: str | None = None,
) -> Found:
    """Read a file; the arguments are those of `Recording.read`.

    Raises:
        BadRecording: If the file or a wanted column cannot be used.
        BadUnit: If a given unit or the time's unit is unknown.
        BadSetting: If an argument cannot work.
    """
    kind, content, stem = kind_and_content(path)
    where = Path(path).name
    table = _table(kind, content, where, sheet, delimiter, decimal)
    result = channels(table, Request(columns or {}, rate, units or {}), where)
    return Found(result.channels, result.notes, result.unreadable, stem)


def _table(
    kind: str,
    content: bytes,
    where: str,
    sheet: str | int | None,
    delimiter: str | None,
    decimal: str | None,
) -> Table:
    if kind == "csv":
        return csv.read(content, where, delimiter, decimal)
    if kind in ("xlsx", "xls"):
        return spreadsheet.read(content, where, kind, sheet)
    if kind == "parquet":
        return parquet.read(content, where)
    return (mat if kind == "mat" else npz).read(content, where)
