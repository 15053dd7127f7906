"""Tables of pandas: the columns are signals, a column or the index holds their times."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from pikanid import errors
from pikanid.recording.reading.headers import TIME_NAMES, are_times, named
from pikanid.recording.reading.table import Column, Table, from_cells

if TYPE_CHECKING:
    import pandas as pd


def read(frame: pd.DataFrame, where: str) -> Table:
    """The table; an index that has a name, or dates, is a column of times.

    Dates count in seconds from the first one.

    Raises:
        BadRecording: If it has no rows, or headers are the same.
    """
    import pandas as pd

    if not len(frame):
        raise errors.BadRecording(errors.no_rows(where))
    columns = [_column(str(name), frame.iloc[:, k], where) for k, name in enumerate(frame.columns)]
    calls = [(n.name, n.unit) for n in named(columns, where)]
    index = frame.index
    if index.name is not None or not isinstance(index, pd.RangeIndex):
        times = _column(str(index.name or "t"), pd.Series(index), where)
        is_called = named([times], where)[0].name.casefold() in TIME_NAMES
        # beside such an index a column T is no time
        calls += [("t", "s")] * (times.is_clock or (is_called and index.name is not None))
        if not any(are_times(calls)[:len(columns)]):
            columns.insert(0, times if is_called else replace(times, header="t"))
    return Table(tuple(columns))


def _column(header: str, series: pd.Series, where: str) -> Column:
    kind = series.dtype.kind
    if kind in "mM":
        clock = (series - series.iloc[0]) if kind == "M" else series
        return Column(header, clock.dt.total_seconds().to_numpy(float), unit="s", is_clock=True)
    if kind in "fiub":
        return Column(header, series.to_numpy(dtype=float, na_value=np.nan))
    return from_cells(where, header, series.tolist(), range(1, len(series) + 1))
