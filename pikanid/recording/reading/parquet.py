"""Parquet files, read and written; those written here carry units, sigma and hold."""

from __future__ import annotations

import io
from collections.abc import Mapping
from typing import Any

import numpy as np

from pikanid import errors
from pikanid.recording.channel import Channel
from pikanid.recording.formats import called
from pikanid.recording.reading.flat import columns as flat
from pikanid.recording.reading.table import Column, Options, Table, from_cells
from pikanid.storage.limits import DAMAGE, MOST_UNPACKED


def read(content: bytes, where: str, options: Options) -> Table:
    """The table in a Parquet file.

    Raises:
        BadRecording: If the file is damaged or has no rows.
    """
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError:
        raise errors.BadSetting(errors.not_installed(".parquet", "pyarrow", "parquet")) from None
    try:
        about = pq.read_metadata(io.BytesIO(content))
        # runs of one value take no bytes of the file
        if 8 * about.num_rows * about.num_columns > MOST_UNPACKED:
            raise errors.BadRecording(errors.cannot_unpack(
                where, errors.detail_unpacks(MOST_UNPACKED)))
        table = pq.read_table(io.BytesIO(content), use_threads=False)
        rows = range(1, table.num_rows + 1)
        columns = tuple(
            _column(where, table.schema.field(k), table.column(k), rows)
            for k in range(table.num_columns)
        )
    except (*DAMAGE, pa.ArrowException):
        raise errors.BadRecording(errors.damaged(where, called(".parquet"))) from None
    if not columns or not len(rows):
        raise errors.BadRecording(errors.no_rows(where))
    return Table(columns, rows)


def _column(where: str, field: Any, data: Any, rows: range) -> Column:
    import pyarrow as pa

    meta = {key.decode(): value.decode() for key, value in (field.metadata or {}).items()}
    if pa.types.is_timestamp(field.type) or pa.types.is_date(field.type):
        stamps = data.to_numpy().astype("datetime64[ns]")
        nanoseconds = (stamps - stamps[0]).astype("timedelta64[ns]").astype(float)
        nanoseconds[np.isnat(stamps)] = np.nan
        return Column(field.name, 1e-9 * nanoseconds, unit="s", is_clock=True)
    number = pa.types.is_floating(field.type) or pa.types.is_integer(field.type)
    cells = data.to_numpy().astype(float) if number else data.to_pylist()
    column = Column(field.name, cells) if number else from_cells(where, field.name, cells, rows)
    return Column(column.header, column.values, column.defect, column.text,
                  unit=meta.get("unit", column.unit),
                  sigma=float(meta["sigma"]) if "sigma" in meta else None, hold=meta.get("hold"),
                  is_clock=column.is_clock)


def content(channels: Mapping[str, Channel], ending: str) -> bytes:
    """What a file holds; each column carries its unit, a scalar sigma and its hold."""
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError:
        raise errors.BadSetting(errors.not_installed(".parquet", "pyarrow", "parquet")) from None
    columns = list(flat(channels))
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
