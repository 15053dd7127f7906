"""Several files that were recorded together: a wanted channel is found in the one that has it."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from pikanid import errors
from pikanid.recording.reading import loaded
from pikanid.recording.reading.columns import Request, Result, channels
from pikanid.recording.reading.headers import Named, matching, missing, named
from pikanid.recording.reading.table import Options, Table

_CLOCKS = ("t", "time")
TOGETHER = "the files together"


def read(paths: Sequence[str | os.PathLike[str]], request: Request,
         options: Options) -> list[tuple[str, Result]]:
    """The stem of each file's name, and what it holds.

    A channel that several files have is called by file and name, ``camera/theta``.

    Args:
        paths: Of the files; their names without endings must differ.
        request: Columns and units may stand in any file; a name that several have is ambiguous.
        options: Passed on to every reader.

    Raises:
        BadRecording: If a file or a wanted column cannot be used.
    """
    tables: list[tuple[Table, str, str]] = []
    for path in paths:
        # "camera/theta" is what the file called camera has as theta
        here = [text.removeprefix(f"{Path(path).stem}/") for text in options.wanted]
        table, where, stem = loaded(path, replace(options, wanted=(*options.wanted, *here)))
        if stem in [known for _, _, known in tables]:
            raise errors.BadRecording(errors.files_of_one_name(stem))
        tables.append((_placed(table, stem, where), where, stem))
    available = [named(table.columns, where) for table, where, _ in tables]
    own = [_own(request, columns, table) for columns, (table, _, _) in zip(
        available, tables, strict=True)]
    _check_mapping(request, own, available)
    found = []
    for k, (table, where, stem) in enumerate(tables):
        result = channels(table, own[k], where, partly=True)
        found.append((stem, replace(
            result, others=tuple(f"{stem}/{name}" for name in result.others))))
    return _distinct(found, own)


def _placed(table: Table, stem: str, where: str) -> Table:
    """The table with its columns also known by file and name."""
    names = [one.name for one in named(table.columns, where)]
    return replace(table, columns=tuple(
        replace(column, alias=f"{stem}/{column.path or name}")
        for column, name in zip(table.columns, names, strict=True)))


def _own(request: Request, available: list[Named], table: Table) -> Request:
    """What of a request concerns one file."""
    mapped = {key: text for key, text in request.columns.items()
              if matching(str(text), available)}
    has_times = any(column.is_clock for column in table.columns)
    return replace(request, columns=mapped, rate=None if has_times else request.rate,
                   units={key: unit for key, unit in request.units.items() if key in mapped
                          or key in _CLOCKS or key in [one.name for one in available]})


def _check_mapping(request: Request, own: Sequence[Request],
                   available: Sequence[list[Named]]) -> None:
    every = [one for columns in available for one in columns]
    for key, text in request.columns.items():
        files = [k for k, one in enumerate(own) if key in one.columns]
        if not files:
            raise errors.BadRecording(missing(str(text), every, TOGETHER))
        if len(files) > 1 and key not in _CLOCKS:
            raise errors.BadRecording(errors.several_columns(TOGETHER, str(text), [
                one.column.alias for k in files for one in matching(str(text), available[k])]))
    for key in request.units:
        if not any(key in one.units for one in own):
            raise errors.BadRecording(missing(key, every, TOGETHER))


def _distinct(found: Sequence[tuple[str, Result]],
              own: Sequence[Request]) -> list[tuple[str, Result]]:
    """With channels that several files have under the names of both, unless one was asked for."""
    count = Counter(ch.name for _, one in found for ch in one.channels)
    return [(stem, replace(one, channels=tuple(
        ch if count[ch.name] == 1 or ch.name in request.columns
        else replace(ch, name=f"{stem}/{ch.name}")
        for ch in one.channels))) for (stem, one), request in zip(found, own, strict=True)]
