"""Parquet files; those written here carry units, sigma and hold with each column."""

from __future__ import annotations

import io
from typing import Any

import numpy as np

from pikanid import errors
from pikanid.recording.reading.door import FOREIGN_FAILURES, NAMES
from pikanid.recording.reading.table import Column, Table, from_cells
from pikanid.storage.limits import MOST_UNPACKED


def read(content: bytes, where: str) -> Table:
    """The table in a Parquet file.

    Raises:
        BadRecording: If the file is damaged or has no rows.
    """
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError:
        raise errors.BadSetting(errors.extra_missing(".parquet", "pyarrow", "parquet")) from None
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
    except (*FOREIGN_FAILURES, pa.ArrowException):
        raise errors.BadRecording(errors.damaged(where, NAMES["parquet"])) from None
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
    return Column(
        column.header,
        column.values,
        column.defect,
        column.text,
        unit=meta.get("unit", column.unit),
        sigma=float(meta["sigma"]) if "sigma" in meta else None,
        hold=meta.get("hold"),
        is_clock=column.is_clock,
    )
