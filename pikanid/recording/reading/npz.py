"""NPZ archives of plain arrays; pickled objects are refused."""

from __future__ import annotations

from pikanid import errors
from pikanid.recording.reading.arrays import columns
from pikanid.recording.reading.table import Options, Table
from pikanid.storage.limits import archived


def read(content: bytes, where: str, options: Options) -> Table:
    """The vectors in an archive, each a column; matrices give a column per row or column.

    Raises:
        BadRecording: If the archive is damaged, or holds objects or no vectors.
    """
    found = columns(archived(
        content, lambda why: errors.BadRecording(errors.cannot_unpack(where, why))))
    if not found:
        raise errors.BadRecording(errors.no_vectors(where))
    return Table(found, shared_time=False)
