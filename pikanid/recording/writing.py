"""Recordings to files: CSV (gzipped where the name ends in .gz) and Parquet, written atomically.

The first channel's times are the column ``t``.  A channel on another time base brings its own
times as ``t:name``, and a sigma that differs from sample to sample is the column ``sigma:name``;
shorter columns end in empty cells.  Reading the file gives the channels back exactly; only a
scalar sigma and the hold need Parquet to survive.
"""

from __future__ import annotations

import gzip
import os
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from pikanid import errors
from pikanid.recording.channel import Array, Channel
from pikanid.storage.outputs import atomically


def write(channels: Mapping[str, Channel], path: str | os.PathLike[str]) -> None:
    """Write channels to a ``.csv``, ``.csv.gz``, ``.tsv`` or ``.parquet`` file.

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
    if lower.endswith((".csv", ".csv.gz", ".tsv", ".tsv.gz")):
        text = _csv(channels, "\t" if ".tsv" in lower else ",").encode()
        # No time stamp inside: the same recording gives the same bytes.
        return gzip.compress(text, mtime=0) if lower.endswith(".gz") else text
    if lower.endswith((".parquet", ".pq")):
        return _parquet(channels)
    known = [".csv", ".csv.gz", ".tsv", ".tsv.gz", ".parquet"]
    raise errors.BadRecording(errors.unknown_ending(name, known))


def _columns(channels: Mapping[str, Channel]) -> Iterator[tuple[str, str, Array, Channel | None]]:
    """(name, unit, values, the channel if these are its values) of every column of the file."""
    time = next(iter(channels.values())).time
    yield "t", "s", time, None
    for name, ch in channels.items():
        if not np.array_equal(ch.time, time):
            yield f"t:{name}", "s", ch.time, None
        yield name, ch.unit, ch.values, ch
        if isinstance(ch.sigma, np.ndarray):
            yield f"sigma:{name}", ch.unit, ch.sigma, None


def _csv(channels: Mapping[str, Channel], delimiter: str) -> str:
    import csv
    import io

    columns = list(_columns(channels))
    length = max(len(values) for _, _, values, _ in columns)
    cells = [
        ["" if value != value else repr(value) for value in values.tolist()]
        + [""] * (length - len(values))
        for _, _, values, _ in columns
    ]
    text = io.StringIO()
    writer = csv.writer(text, delimiter=delimiter, lineterminator="\n")
    writer.writerow([f"{name} [{unit}]" if unit else name for name, unit, _, _ in columns])
    writer.writerows(zip(*cells, strict=True))
    return text.getvalue()


def _parquet(channels: Mapping[str, Channel]) -> bytes:
    import io

    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError:
        raise errors.BadSetting(errors.extra_missing(".parquet", "pyarrow", "parquet")) from None
    columns = list(_columns(channels))
    length = max(len(values) for _, _, values, _ in columns)
    fields, arrays = [], []
    for name, unit, values, ch in columns:
        meta = {"unit": unit}
        if ch is not None and isinstance(ch.sigma, float):
            meta["sigma"] = repr(ch.sigma)
        if ch is not None and ch.hold is not None:
            meta["hold"] = ch.hold
        fields.append(pa.field(name, pa.float64(), metadata=meta))
        arrays.append(pa.array(np.pad(values, (0, length - len(values)), constant_values=np.nan)))
    buffer = io.BytesIO()
    pq.write_table(pa.Table.from_arrays(arrays, schema=pa.schema(fields)), buffer)
    return buffer.getvalue()
