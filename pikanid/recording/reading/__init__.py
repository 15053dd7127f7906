"""Files of any format as channels; one format a module, listed in `pikanid.recording.formats`.

`door` looks at the file itself, a format's module makes a `Table` of it, and `columns` makes
channels of the table.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

from pikanid.recording.channel import Channel
from pikanid.recording.formats import Format
from pikanid.recording.reading.columns import Request, channels
from pikanid.recording.reading.door import opened
from pikanid.recording.reading.table import Options, Table

__all__ = ["Found", "read"]


@dataclass(frozen=True)
class Found:
    """What a file holds: channels, notes, unusable columns, when t = 0 was, its name's stem."""

    channels: tuple[Channel, ...]
    notes: tuple[str, ...]
    unreadable: Mapping[str, str]
    began: float | None
    stem: str


def read(path: str | os.PathLike[str], columns: Mapping[str, str | int] | None = None,
         rate: float | None = None, sheet: str | int | None = None,
         units: Mapping[str, str] | None = None, delimiter: str | None = None,
         decimal: str | None = None, also: Iterable[str] = ()) -> Found:
    """Read a file; the arguments are those of `Recording.read`.

    Raises:
        BadRecording: If the file or a wanted column cannot be used.
        BadUnit: If a given unit or the time's unit is unknown.
        BadSetting: If an argument cannot work.
    """
    found, content, stem = opened(path)
    where = Path(path).name
    request = Request(columns or {}, rate, units or {}, tuple(also))
    table = _reader(found)(content, where, Options(sheet, delimiter, decimal, request.wanted))
    result = channels(table, request, where)
    return Found(result.channels, result.notes, result.unreadable, result.began, stem)


def _reader(found: Format) -> Callable[[bytes, str, Options], Table]:
    read: Callable[[bytes, str, Options], Table] = import_module(
        f"pikanid.recording.reading.{found.file}").read
    return read
