"""LabVIEW's measurement files (TDMS, npTDMS), channel by channel.

A channel with a waveform's increment has its own times (``wf_start_offset + k*wf_increment``),
counted from the earliest ``wf_start_time`` of the file; without, the channel of times in its group.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np

from pikanid import errors
from pikanid.recording.channel import Array
from pikanid.recording.formats import called
from pikanid.recording.reading import foreign
from pikanid.recording.reading.headers import are_times
from pikanid.recording.reading.signals import Clock, Contents, Signal

_UNITS = ("unit_string", "NI_UnitDescription", "unit", "Unit")

read = partial(foreign.table, "tdms", "nptdms", called(".tdms"))


def contents(content: bytes, where: str) -> Contents:
    """Every channel of every group."""
    from nptdms import TdmsFile

    file = TdmsFile.open(io.BytesIO(content))
    every = [channel for group in file.groups() for channel in group.channels()]
    started = {id(c): c.properties["wf_start_time"] for c in every
               if _increment(c.properties) and _is_date(c.properties.get("wf_start_time"))}
    first = min(started.values(), default=None)
    shared: dict[tuple[float, ...], Clock] = {}
    told = are_times([(c.name, _unit(c.properties)) for c in every])
    timed = {c.group_name: c for c, is_time in [*zip(every, told, strict=True)][::-1] if is_time}
    signals, began = [], None if first is None else _posix(first)
    for c in every:
        path = f"{c.group_name}/{c.name}"
        late = 0.0 if id(c) not in started else _posix(started[id(c)]) - _posix(first)
        clock = _of_waveform(c, late, shared)
        if clock is None and (times := timed.get(c.group_name)) is not None:
            if times is c:
                continue
            clock = Clock(f"{c.group_name}/{times.name}", _seconds(times), len(times))
            clock = shared.setdefault((hash(times.path),), clock)
        is_number = c.dtype.kind in "fiub"
        signals.append(Signal(path, c.name, len(c), _values(c), _unit(c.properties), clock,
                              "" if is_number else errors.no_number_signal(where, path)))
    short = file.file_status.channel_statuses or {}
    is_cut = any(one.read_length < one.expected_length for one in short.values())
    return Contents(signals, began, (errors.note_cut_off(where),) if is_cut else ())


def _of_waveform(channel: Any, late: float, shared: dict[tuple[float, ...], Clock]) -> Clock | None:
    step = _increment(channel.properties)
    if not step:
        return None
    count = len(channel)
    start = late + float(channel.properties.get("wf_start_offset", 0.0))
    name = f"{channel.group_name}/{channel.name} (times)"

    def load() -> Array:
        return np.asarray(start + step * np.arange(count), np.float64)

    # The waveforms of one task are on one clock.
    return shared.setdefault((start, step, count), Clock(name, load, count))


def _increment(properties: Mapping[str, Any]) -> float:
    try:
        step = float(properties.get("wf_increment", 0.0))
    except (TypeError, ValueError):
        return 0.0
    return step if 0 < step < np.inf else 0.0


def _is_date(value: Any) -> bool:
    return isinstance(value, np.datetime64) and not np.isnat(value)


def _posix(stamp: Any) -> float:
    return float((stamp - np.datetime64(0, "s")) / np.timedelta64(1, "s"))


def _seconds(channel: Any) -> Callable[[], Array]:
    def load() -> Array:
        values = np.asarray(channel[:])
        if values.dtype.kind == "M":
            return (values - values[0]) / np.timedelta64(1, "s")
        return values.astype(float)

    return load


def _values(channel: Any) -> Callable[[], Array]:
    return lambda: np.asarray(channel[:], float)


def _unit(properties: Mapping[str, Any]) -> str | None:
    return next((str(properties[key]).strip() for key in _UNITS if properties.get(key)), None)
