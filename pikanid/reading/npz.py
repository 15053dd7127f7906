"""NPZ archives of plain arrays; pickled objects are refused."""

from __future__ import annotations

import io

import numpy as np

from pikanid import errors
from pikanid.reading.arrays import columns
from pikanid.reading.door import FOREIGN_FAILURES, NAMES
from pikanid.reading.table import Table


def read(content: bytes, where: str) -> Table:
    """The vectors in an archive, each a column; matrices give a column per row or column.

    Raises:
        BadRecording: If the archive is damaged, or holds objects or no vectors.
    """
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
    except FOREIGN_FAILURES:
        raise errors.BadRecording(errors.damaged(where, NAMES["npz"])) from None
    found = columns(arrays)
    if not found:
        raise errors.BadRecording(errors.no_vectors(where))
    return Table(found, shared_time=False)
