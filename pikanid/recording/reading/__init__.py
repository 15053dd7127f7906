"""Files of any format as channels; one format a module, listed in `pikanid.recording.formats`.

`door` looks at the file itself, a format's module makes a `Table` of it, and `columns` makes
channels of the table.
"""

from __future__ import annotations

import os
from pathlib import Path

from pikanid.recording.reading.columns import Request, Result, channels
from pikanid.recording.reading.door import opened
from pikanid.recording.reading.reader import reader
from pikanid.recording.reading.table import Options, Table

__all__ = ["loaded", "read"]


def read(path: str | os.PathLike[str], request: Request, options: Options) -> tuple[str, Result]:
    """The stem of a file's name, and what it holds.

    Args:
        path: Of the file.
        request: Which of its columns are wanted.
        options: For the reader of its format.

    Raises:
        BadRecording: If the file or a wanted column cannot be used.
        BadUnit: If a given unit or the time's unit is unknown.
        BadSetting: If an argument cannot work.
    """
    table, where, stem = loaded(path, options)
    return stem, channels(table, request, where)


def loaded(path: str | os.PathLike[str], options: Options) -> tuple[Table, str, str]:
    """The table in a file, the file's name, and the stem of it.

    Raises:
        BadRecording: If the file cannot be used.
        BadSetting: If an option cannot work.
    """
    found, content, stem = opened(path)
    where = Path(path).name
    return reader(found)(content, where, options), where, stem
