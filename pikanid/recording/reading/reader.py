"""The reader of a format: imported when it is needed."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module

from pikanid.recording.formats import Format
from pikanid.recording.reading.table import Options, Table


def reader(found: Format) -> Callable[[bytes, str, Options], Table]:
    """What makes a `Table` of the bytes of a file of this format.

    >>> from pikanid.recording.formats import by_ending
    >>> reader(by_ending("run.csv"))(b"t,y\\n0,1", "run.csv", Options()).columns[1].header
    'y'
    """
    read: Callable[[bytes, str, Options], Table] = import_module(
        f"pikanid.recording.reading.{found.file}").read
    return read
