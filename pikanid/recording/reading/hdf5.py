"""HDF5 files (h5py), among them netCDF 4: every vector, matrix column and field of a table.

Times come, in this order, from the dimension scale of a data set, from its sampling rate or
interval (attributes), from the field of times of its own table, or from a vector called ``t`` or
``time`` in its group or one around it.  Units are attributes (``units``); what other files hold is
not opened, and objects are not unpickled.
"""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from datetime import datetime
from functools import partial
from typing import Any

import numpy as np

from pikanid.recording.channel import Array
from pikanid.recording.formats import called
from pikanid.recording.reading import foreign
from pikanid.recording.reading.headers import are_times
from pikanid.recording.reading.signals import WIDEST, Clock, Contents, Signal
from pikanid.recording.reading.table import posix

_DEEPEST = 16  # limit: groups within groups
_UNITS = ("units", "unit", "Units", "Unit")
_RATES = ("sampling_rate", "sample_rate", "samplerate", "fs", "Fs", "rate")
_INTERVALS = ("sampling_interval", "sample_interval", "dt", "increment")
_DATED = re.compile(r"(?P<unit>\w+) since (?P<date>.+)")  # as netCDF writes units of times
_SECONDS = {"days": 86400.0, "hours": 3600.0, "minutes": 60.0, "seconds": 1.0,
            "milliseconds": 1e-3, "microseconds": 1e-6,
            "nanoseconds": 1e-9}  # definition: units of time [s]

read = partial(foreign.table, "hdf5", "h5py", called(".h5"))


@dataclass(frozen=True, eq=False)
class _Vector:
    """A vector: a data set, a column of one, or a field of a table."""

    path: str
    node: Any
    count: int
    load: Callable[[], Array]
    unit: str | None

    @property
    def name(self) -> str:
        return self.path.rpartition("/")[2]

    @property
    def group(self) -> str:
        return self.path.rpartition("/")[0]


def contents(content: bytes, where: str) -> Contents:
    """Every vector of the file."""
    import h5py

    file = h5py.File(io.BytesIO(content), "r")
    vectors = [v for path, node in _sets(file, "", 0) for v in _vectors(path, node)]
    clocks = _Clocks(vectors)
    signals = []
    for v in vectors:
        if v.path not in clocks.times:
            signals.append(Signal(v.path, v.name, v.count, v.load, v.unit, clocks.of(v)))
    return Contents(signals, clocks.began)


def _sets(group: Any, path: str, depth: int) -> Iterator[tuple[str, Any]]:
    import h5py

    for name in group if depth < _DEEPEST else ():
        if not isinstance(group.get(name, getlink=True), h5py.HardLink):
            continue  # what other files or other places hold
        node, below = group[name], f"{path}/{name}" if path else name
        if isinstance(node, h5py.Group):
            yield from _sets(node, below, depth + 1)
        elif isinstance(node, h5py.Dataset) and node.external is None and not node.is_virtual:
            yield below, node


def _vectors(path: str, node: Any) -> Iterator[_Vector]:
    shape = tuple(n for n in node.shape or () if n > 1)
    units = next((_text(node.attrs[key]) for key in _UNITS if key in node.attrs), None)
    if node.dtype.names and len(shape) == 1:
        for field in node.dtype.names:
            if node.dtype[field].kind in "fiub" and not node.dtype[field].shape:
                yield _Vector(f"{path}/{field}", node, shape[0], _read(node, field), None)
    elif node.dtype.kind in "fiub" and len(shape) == 1:
        yield _Vector(path, node, shape[0], _read(node), units)
    elif node.dtype.kind in "fiub" and len(shape) == 2 and min(shape) <= WIDEST:
        axis = int(shape[0] < shape[1])  # along which samples follow each other
        for k in range(shape[1 - axis]):
            yield _Vector(f"{path}.{k + 1}", node, shape[axis], _read(node, (), k, 1 - axis), units)


def _read(node: Any, part: Any = (), k: int | None = None, axis: int = 0) -> Callable[[], Array]:
    def load() -> Array:
        values = np.squeeze(np.asarray(node[part]))
        return np.asarray(values if k is None else np.take(values, k, axis), np.float64)

    return load


class _Clocks:
    """The clock of each vector; vectors with the same times share one."""

    def __init__(self, vectors: list[_Vector]) -> None:
        told = are_times([(v.name, v.unit) for v in vectors])
        self.times = {v.path: v for v, is_time in zip(vectors, told, strict=True) if is_time}
        self.by_node = {v.node.name: v for v in vectors}
        self.made: dict[str, Clock] = {}
        self.dates: dict[str, float | None] = {}

    @property
    def began(self) -> float | None:
        """POSIX time of the zero of all clocks, None unless it is known of all, and one."""
        found = {self.dates.get(path) for path in self.made}
        return found.pop() if len(found) == 1 else None

    def of(self, vector: _Vector) -> Clock | None:
        """The clock of a vector."""
        scale = self._scale(vector)
        if scale is not None:
            return self._made(scale)
        step = _interval(vector.node.attrs)
        if step:
            path = f"{vector.path} (times)"
            clock = Clock(path, lambda: step * np.arange(vector.count, dtype=float), vector.count)
            return self.made.setdefault(path, clock)
        parts = vector.group.split("/") if vector.group else []
        for depth in range(len(parts), -1, -1):
            for times in self.times.values():
                if times.group == "/".join(parts[:depth]) and times.count == vector.count:
                    return self._made(times)
        return None

    def _scale(self, vector: _Vector) -> _Vector | None:
        try:
            scales = [scale for axis in vector.node.dims for scale in axis.values()]
        except (RuntimeError, KeyError, TypeError, AttributeError):  # damaged, or none
            return None
        known = [self.by_node.get(scale.name) for scale in scales]
        return next((v for v in known if v is not None and v is not vector
                     and v.count == vector.count), None)

    def _made(self, times: _Vector) -> Clock:
        dated = _DATED.fullmatch(times.unit or "")
        factor = _SECONDS.get(dated["unit"] if dated else "")
        if dated and factor:
            try:
                self.dates[times.path] = posix(datetime.fromisoformat(dated["date"].strip()))
            except ValueError:
                self.dates[times.path] = None
        return self.made.setdefault(times.path, Clock(
            times.path, lambda: _converted(times, factor), times.count))


def _converted(times: _Vector, factor: float | None) -> Array:
    from pikanid.formula import units

    if factor:
        return factor * times.load()
    if times.unit and units.parse(times.unit) != "s":
        return units.convert(times.load(), times.unit, "s")
    return times.load()


def _interval(attributes: Mapping[str, Any]) -> float:
    """The sampling interval [s] that attributes state, 0 if none does."""
    for keys, power in ((_INTERVALS, 1), (_RATES, -1)):
        for key in keys:
            value = np.asarray(attributes.get(key, 0.0))
            if value.dtype.kind in "fiu" and value.size == 1 and 0 < float(value.item()) < np.inf:
                return float(value.item()) ** power
    return 0.0


def _text(value: Any) -> str:
    value = value.item() if isinstance(value, np.ndarray) and value.size == 1 else value
    return (value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)).strip()
