"""What every file format is turned into before channels are made of it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from numbers import Real
from typing import Any

import numpy as np

from pikanid import errors
from pikanid.formula import units
from pikanid.recording.channel import Array

_DIGIT_FIRST = re.compile(r"\s*[+-]?[.,]?\d")
_UNIT_IN_HEADER = re.compile(r"[\[(][^\[\]()]+[\])]\s*$")
_BRACKETS = re.compile(r"^[\[(](.*)[\])]$")
_DATE = re.compile(r"\s*\d{1,4}[./-]\d{1,2}[./-]\d{1,4}(?!\d)")
_EMPTY = frozenset(["", "nan", "na", "n/a", "#n/a", "null", "none", "-", "--"])


@dataclass(frozen=True)
class Options:
    """What a reader may be told; a format takes what concerns it.

    Attributes:
        sheet: By name, or number counted from 0; the first if None.
        delimiter: One character; found out if None.
        decimal: ``"."`` or ``","``; found out if None.
        wanted: Names, whole names or patterns of the signals that are asked for; all if empty.
        listed: Whether only names, units, times and numbers of samples are asked for.
    """

    sheet: str | int | None = None
    delimiter: str | None = None
    decimal: str | None = None
    wanted: tuple[str, ...] = ()
    listed: bool = False


@dataclass(frozen=True, eq=False)
class Column:
    """One column of numbers, or why it is none.

    Attributes:
        header: As in the file.
        values: (N,) numbers, NaN where a cell is empty or not a number.
        defect: The sentence to raise when the column is asked for, "" if it is sound.
        text: Whether most of its cells are words, so that it was never meant as a signal.
        unit: Where the format itself carries one (Parquet metadata); None: look in the header.
        time: Header of the column that holds its times, where the file's structure says so.
        sigma, hold: Where the format itself carries them.
        is_clock: Whether it holds times in seconds, whatever its header says.
        path: Its whole name, where the header is the short one of a channel in a group.
        alias: Another whole name, of file and column, where several files are read together.
        began: POSIX time [s] of the zero of a clock that was made of dates.
    """

    header: str
    values: Array
    defect: str = ""
    text: bool = False
    unit: str | None = None
    time: str | None = None
    sigma: float | None = None
    hold: str | None = None
    is_clock: bool = False
    path: str = ""
    alias: str = ""
    began: float | None = None


@dataclass(frozen=True, eq=False)
class Table:
    """The columns of a file.

    Attributes:
        columns: In the order of the file.
        rows: Number of each row as an editor shows it, or None where there are none to see
            (MAT, NPZ), and messages count samples instead.
        shared_time: Whether all columns are rows of one table, sharing one time base.
        began: POSIX time [s] of t = 0, where the file as a whole tells.
        notes: What the reader had to decide.
    """

    columns: tuple[Column, ...]
    rows: Sequence[int] | None = None
    shared_time: bool = True
    began: float | None = None
    notes: tuple[str, ...] = ()

    def place(self, k: int) -> str:
        """How to call the k-th data row in a message."""
        return f"sample {k + 1}" if self.rows is None else f"row {self.rows[k]}"


def from_rows(where: str, rows: Sequence[Sequence[object]], numbers: list[int],
              decimal: str = ".") -> Table:
    """A table from rows of cells, the first of which is the header unless it is all numbers.

    Args:
        where: Name of the file, for messages.
        rows: Cells, either text or numbers; all rows of one length.
        numbers: Row numbers as an editor shows them.
        decimal: Decimal sign of numbers given as text.

    Raises:
        BadRecording: If there is no data row.
    """
    headed = heads(rows[0], decimal)
    headers = [str(cell or "").strip() for cell in rows[0]] if headed else []
    body, shown = (rows[1:], numbers[1:]) if headed else (rows, numbers)
    if not body:
        raise errors.BadRecording(errors.no_rows(where))
    if not headed:
        headers = [str(k + 1) for k in range(len(rows[0]))]
    bare = headed and not any(map(_UNIT_IN_HEADER.search, headers))
    own = _units(body[:2], decimal) if bare else None
    notes: tuple[str, ...] = ()
    if own is not None:
        notes = (f"'{where}', row {shown[0]}: taken for the columns' units.",)
        body, shown = body[1:], shown[1:]
    columns = tuple(from_cells(where, header, cells, shown, decimal) for header,
                    cells in zip(headers, zip(*body, strict=True), strict=True))
    if own is not None:
        columns = tuple(replace(c, unit=unit or c.unit)
                        for c, unit in zip(columns, own, strict=True))
    return Table(columns, shown, notes=notes)


def _units(rows: Sequence[Sequence[object]], decimal: str) -> list[str] | None:
    """The units in the row below the headers, where most of its cells are units and none is a
    number, as some are in the next one.

    >>> _units([["s", "[m/s^2]", "-"], ["0", "1.5", "3"]], ".")
    ['s', 'm/s^2', '']
    >>> _units([["0", "1.5", "on"], ["1", "1.5", "off"]], ".") is None
    True
    """
    if len(rows) < 2 or not all(isinstance(cell, str) or cell is None for cell in rows[0]):
        return None
    texts = [str(cell or "").strip() for cell in rows[0]]
    said = [_BRACKETS.sub(r"\1", text) if text.casefold() not in _EMPTY else "" for text in texts]
    told = [text for text in said if text]
    numbers = [value for cell in rows[1] if (value := _number(cell, decimal)) is not None]
    if any(map(_DIGIT_FIRST.match, told)) or not np.isfinite(numbers).any():
        return None
    return said if told and 2 * sum(map(units.is_unit, told)) > len(told) else None


def heads(row: Sequence[object], decimal: str) -> bool:
    """Whether the first row of a file holds headers: not all of it are numbers or empty.

    >>> heads(["t", "1"], "."), heads(["0", "1,5"], ",")
    (True, False)
    """
    return not all(_number(cell, decimal) is not None for cell in row)


def from_cells(where: str, header: str, cells: Sequence[object], rows: Sequence[int],
               decimal: str = ".") -> Column:
    """One column of numbers from cells of text, numbers, dates or None.

    A column of dates becomes seconds since its first one.
    """
    quick = _quick(cells, decimal)
    if quick is not None:
        return Column(header, quick)
    stamps = _stamps(cells)
    if stamps is not None:
        seconds = np.array([(stamp - stamps[0]).total_seconds() for stamp in stamps])
        return Column(header, seconds, unit="s", is_clock=True, began=posix(stamps[0]))
    parsed = [_number(cell, decimal) for cell in cells]
    bad = [k for k, value in enumerate(parsed) if value is None]
    values = np.array([np.nan if value is None else value for value in parsed])
    if not bad:
        return Column(header, values)
    first = str(cells[bad[0]])
    defect = (errors.not_an_iso_date if _DATE.match(first) else errors.not_a_number)(
        where, rows[bad[0]], header, first)
    words = sum(1 for k in bad if not _DIGIT_FIRST.match(str(cells[k])))
    return Column(header, values, defect, text=words > np.isfinite(values).sum())


def _quick(cells: Sequence[Any], decimal: str) -> Array | None:
    """All cells at once, where all of them are plainly numbers or empty text."""
    try:
        if decimal == ",":
            if any("." in cell for cell in cells):
                return None
            cells = [cell.replace(",", ".") for cell in cells]
        # what is no text ends in the except clause
        values = np.array([float(cell) if cell != "" else np.nan for cell in cells])
    except (ValueError, TypeError, AttributeError, OverflowError):
        return None
    # float() takes "1_000", which no instrument writes.
    if any("_" in cell for cell in cells if isinstance(cell, str)):
        return None
    return values


def _number(cell: object, decimal: str = ".") -> float | None:
    """The number in a cell, NaN if it is empty, None if it is something else."""
    if cell is None:
        return float("nan")
    if isinstance(cell, Real):
        try:
            return float(cell)
        except OverflowError:
            return float("inf")
    if not isinstance(cell, str):
        return None
    text = cell.strip()
    if text.casefold() in _EMPTY:
        return float("nan")
    if decimal == ",":
        if "." in text:
            return None
        text = text.replace(",", ".")
    try:
        return None if "_" in text else float(text)
    except ValueError:
        return None


def _stamps(cells: Sequence[object]) -> list[datetime] | None:
    """The dates in a column, None if it is not one of dates."""
    stamps: list[datetime] = []
    for cell in cells:
        try:
            stamp = datetime.fromisoformat(cell.strip()) if isinstance(cell, str) else cell
        except ValueError:
            return None
        if not isinstance(stamp, datetime):
            return None
        stamps.append(stamp)
    return stamps if len({stamp.tzinfo is None for stamp in stamps}) == 1 else None


def posix(stamp: datetime) -> float:
    """POSIX time [s] of a date; one without a time zone counts as UTC.

    >>> posix(datetime(1970, 1, 2))
    86400.0
    """
    return (stamp if stamp.tzinfo else stamp.replace(tzinfo=UTC)).timestamp()
