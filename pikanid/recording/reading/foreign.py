"""Readers that rest on a library for the format: they run apart, since files may be damaged.

Such a reader has ``contents(content, where)``, which makes `Contents`; here it becomes a `Table`.
What the library does on damaged bytes (a loop without end, a crash) ends a process of its own, see
`pikanid.storage.apart`.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from importlib.util import find_spec
from typing import Any

import numpy as np

from pikanid import errors
from pikanid.recording.channel import Array
from pikanid.recording.reading.signals import Clock, Contents, Signal, asked, distinct
from pikanid.recording.reading.table import Column, Options, Table
from pikanid.storage import apart
from pikanid.storage.limits import DAMAGE, MOST_UNPACKED


def table(reader: str, module: str, kind: str, content: bytes, where: str,
          options: Options) -> Table:
    """The table in a file.

    Args:
        reader: The module beside this one that makes `Contents`, called as the extra that brings
            its library.
        module: The library.
        kind: What the file is, in sentences.
        content: Bytes of the file.
        where: Its name, for messages.
        options: Which signals are wanted.

    Raises:
        BadRecording: If the file is damaged, holds no signals, or more than is read at once.
        BadSetting: If the library is not installed.
    """
    if find_spec(module) is None:
        raise errors.BadSetting(errors.not_installed(kind, module, reader))
    try:
        told, arrays = apart.run(f"{__name__}:transferred", content, {
            "reader": reader, "where": where, "wanted": list(options.wanted),
            "listed": options.listed})
    except apart.Ended as end:
        told_of = errors.too_slow if end.late else errors.damaged
        raise errors.BadRecording(told_of(where, kind)) from None
    if "error" in told:
        name, sentence = told["error"]
        raise getattr(errors, name)(sentence)
    columns = tuple(_column(one, arrays) for one in told["columns"])
    if not columns:
        raise errors.BadRecording(errors.no_signals(where))
    return Table(columns, shared_time=False, began=told["began"], notes=tuple(told["notes"]))


def _column(told: dict[str, Any], arrays: Sequence[Array]) -> Column:
    at, count = told.pop("array"), told.pop("count")
    # What was not fetched has a length all the same.
    values = np.broadcast_to(np.nan, (count,)) if at is None else arrays[at]
    return Column(values=values, **told)


def transferred(content: bytes, options: dict[str, Any]) -> tuple[dict[str, Any], list[Array]]:
    """In the other process: the columns of a file, and their values as arrays."""
    try:
        found = import_module(f"pikanid.recording.reading.{options['reader']}").contents(
            content, options["where"])
        return _packed(found, options["where"], options["wanted"], options["listed"])
    except errors.PikanidError as problem:
        return {"error": (type(problem).__name__, str(problem))}, []


def _packed(found: Contents, where: str, wanted: Sequence[str],
            listed: bool) -> tuple[dict[str, Any], list[Array]]:
    named = list(zip(distinct(found.signals), found.signals, strict=True))
    chosen = {path: signal for (path, name), signal in named
              if not wanted or any(asked(text, path, name) for text in wanted)}
    clocks = {id(s.clock): s.clock for s in chosen.values() if s.clock is not None}
    fetched = [*clocks.values(), *(() if listed else chosen.values())]
    if 8 * sum(one.count for one in fetched) > MOST_UNPACKED:
        raise errors.BadRecording(errors.too_much_at_once(
            where, MOST_UNPACKED, [path for (path, _), _ in named]))
    columns: list[dict[str, Any]] = []
    arrays: list[Array] = []
    headers: dict[int, str] = {}
    taken = {name for names, _ in named for name in names}
    for key, clock in clocks.items():
        headers[key] = _free(clock.path, taken)
        columns.append({"header": headers[key], "path": headers[key], "is_clock": True,
                        "unit": "s", "count": clock.count,
                        **_loaded(clock, where, headers[key], arrays)})
    for (path, name), signal in named:
        values: dict[str, Any] = {"array": None, "defect": signal.defect}
        if path in chosen and not listed and not signal.defect:
            values = _loaded(signal, where, path, arrays)
        columns.append({"header": name, "path": path, "unit": signal.unit, "count": signal.count,
                        "time": headers.get(id(signal.clock)), "text": bool(signal.defect),
                        **values})
    return {"columns": columns, "began": found.began, "notes": found.notes}, arrays


def _loaded(source: Signal | Clock, where: str, path: str, arrays: list[Array]) -> dict[str, Any]:
    try:
        values = np.asarray(source.load(), float)
        sound = values.shape == (source.count,)
    except errors.PikanidError:
        sound = False
    except DAMAGE:
        sound = False
    if not sound:
        return {"array": None, "defect": errors.damaged_signal(where, path)}
    arrays.append(values)
    return {"array": len(arrays) - 1, "defect": ""}


def _free(path: str, taken: set[str]) -> str:
    """A header for a clock that no signal has."""
    while path in taken:
        path = f"{path}'"
    taken.add(path)
    return path
