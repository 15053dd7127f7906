"""Recordings to files of the formats that can be written, atomically.

The first channel's times are the column ``t``.  A channel on another time base brings its own
times as ``t:name``, and a sigma that differs from sample to sample is the column ``sigma:name``;
shorter columns end in empty cells.  Reading the file gives the channels back exactly; only a
scalar sigma and the hold need Parquet to survive.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path

from pikanid import errors
from pikanid.recording.channel import Channel
from pikanid.recording.formats import FORMATS, written_endings
from pikanid.storage.outputs import atomically


def write(channels: Mapping[str, Channel], path: str | os.PathLike[str]) -> None:
    """Write channels to a file; the ending of its name says in which format.

    Raises:
        BadRecording: If the file name ends otherwise or the place cannot be written to.

    >>> import tempfile
    >>> from pikanid.recording import Recording
    >>> rec = Recording.from_arrays([0.0, 0.1], {"theta": [0.5, 1.0]}, {"theta": "deg"})
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write(rec.channels, Path(folder) / "run.csv")
    ...     print((Path(folder) / "run.csv").read_text())
    t [s],theta [deg]
    0.0,0.5
    0.1,1.0
    """
    atomically(path, content(channels, Path(path).name))


def content(channels: Mapping[str, Channel], name: str) -> bytes:
    """What a file of that name holds.

    Raises:
        BadRecording: If the file name has no known ending.
    """
    lower = name.lower()
    for found in FORMATS:
        # the longest that fits
        for ending in sorted(found.written, key=len, reverse=True):
            if lower.endswith(ending):
                writer = import_module(f"pikanid.recording.reading.{found.file}")
                made: bytes = writer.content(channels, ending)
                return made
    raise errors.BadRecording(errors.unknown_ending(name, written_endings()))
