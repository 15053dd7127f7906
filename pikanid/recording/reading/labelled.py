"""Arrays of xarray: variables are signals, a coordinate along one dimension holds their times."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from pikanid import errors
from pikanid.recording.reading.headers import are_times
from pikanid.recording.reading.signals import WIDEST
from pikanid.recording.reading.table import Column, Table, posix


def read(given: Any, where: str) -> Table:
    """The table in a Dataset or a DataArray.

    Of two dimensions one is time: that whose coordinate is called so or holds dates, else the
    first; along the other each label makes a signal, ``theta[left]``.  Dates count in seconds from
    the earliest one; ``units``, ``sigma`` and ``hold`` are attributes.

    Raises:
        BadRecording: If no variable has times.
    """
    data = given.to_dataset(name=str(given.name or "y")) if hasattr(given, "to_dataset") else given
    first = _first_date(data)
    clocks: dict[str, Column] = {}
    columns: list[Column] = []
    for name, variable in data.data_vars.items():
        along = _time(variable)
        if along is None or variable.ndim > 2 or variable.dtype.kind not in "fiub":
            continue
        clock = clocks.setdefault(along, _clock(data.coords[along], along, first))
        columns += _signals(str(name), variable, along, clock.header)
    if not columns:
        raise errors.BadRecording(errors.no_labelled_times(where))
    began = None if first is None else posix(first.astype("datetime64[us]").item())
    return Table((*clocks.values(), *columns), shared_time=False, began=began)


def _time(variable: Any) -> str | None:
    """The dimension that is time; None where there is none with a coordinate."""
    known = [str(d) for d in variable.dims if d in variable.coords]
    dated = [d for d in known if variable.coords[d].dtype.kind in "mM"]
    told = are_times([(d, variable.coords[d].attrs.get("units")) for d in known])
    timed = [d for d, is_time in zip(known, told, strict=True) if is_time]
    return next(iter([*dated, *timed, *known]), None)


def _first_date(data: Any) -> np.datetime64 | None:
    """The earliest date along any dimension."""
    dates = [data.coords[d].values.min() for d in data.dims
             if d in data.coords and data.coords[d].dtype.kind == "M" and data.coords[d].size]
    return min(dates, default=None)


def _clock(coordinate: Any, name: str, first: np.datetime64 | None) -> Column:
    values = np.asarray(coordinate.values)
    if values.dtype.kind in "mM":
        since = values - first if values.dtype.kind == "M" else values
        seconds = np.where(np.isnat(values), np.nan, since / np.timedelta64(1, "s"))
        return Column(f"time along {name}", seconds, unit="s", is_clock=True, path=name)
    number = values.astype(float) if values.dtype.kind in "fiub" else np.full(len(values), np.nan)
    return Column(f"time along {name}", number, unit=str(coordinate.attrs.get("units", "s")),
                  path=name)


def _signals(name: str, variable: Any, along: str, clock: str) -> Iterator[Column]:
    about = variable.attrs
    sigma = about.get("sigma")
    more = {"unit": str(about["units"]) if "units" in about else None, "time": clock,
            "sigma": None if sigma is None else float(sigma), "hold": about.get("hold")}
    others = [d for d in variable.dims if d != along]
    if not others:
        yield Column(name, np.asarray(variable.values, float), path=name, **more)
        return
    labels = (variable.coords[others[0]].values if others[0] in variable.coords
              else range(variable.sizes[others[0]]))
    for k, label in list(enumerate(labels))[:WIDEST]:
        header = f"{name}[{label}]"
        values = np.asarray(variable.isel({others[0]: k}).values, float)
        yield Column(header, values, path=header, **more)
