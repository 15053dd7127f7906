"""Delimited text: delimiter, decimal sign and encoding are found out.

Lines starting with ``#`` are comments.  Row numbers in messages are line numbers of the file.

Long files of plain numbers are parsed by pandas, which gives the same numbers; whatever is not
plain (a word, a date, a quoted cell, a short row) is read cell by cell, with a message that names
the cell.
"""

from __future__ import annotations

import csv
import gzip
import io
import re
from collections import Counter
from collections.abc import Mapping
from typing import Any

import numpy as np

from pikanid import errors
from pikanid.recording.channel import Channel
from pikanid.recording.reading.flat import columns as flat
from pikanid.recording.reading.table import Column, Options, Table, from_rows, heads

_DELIMITERS = ("\t", ";", ",", "|", " ")
_COMMA_NUMBER = re.compile(r"\s*[+-]?\d*,\d+(?:[eE][+-]?\d+)?\s*")
_POINT_NUMBER = re.compile(r"\s*[+-]?\d*\.\d*(?:[eE][+-]?\d+)?\s*")
_SAMPLE = 200  # limit: lines looked at to find out the delimiter
_LONG = 5000  # limit: lines from which on an import of pandas (0.4 s) pays
# Of ASCII, without tabs and ends of lines.
_CONTROLS = bytes((*range(9), 11, *range(14, 32), 127))  # definition: control characters


def read(content: bytes, where: str, options: Options) -> Table:
    """The table in a text file.

    Args:
        content: Bytes of the file.
        where: Its name, for messages.
        options: Delimiter and decimal sign.

    Raises:
        BadRecording: If it is not text, holds no rows, or a row is shorter or longer than the
            header.
        BadSetting: If `delimiter` or `decimal` cannot be one.
    """
    delimiter, decimal = options.delimiter, options.decimal
    if delimiter is not None and (len(delimiter) != 1 or delimiter in '"\r\n'):
        raise errors.BadSetting(errors.bad_delimiter(delimiter))
    if decimal not in (None, ".", ",") or (decimal is not None and decimal == delimiter):
        raise errors.BadSetting(errors.bad_decimal(decimal or ""))
    lines, numbers = _lines(_text(content, where))
    if lines and (told := re.fullmatch(r"sep=(.)", lines[0])):  # a hint that Excel writes
        delimiter = delimiter or told[1]
        lines, numbers = lines[1:], numbers[1:]
    if not lines:
        raise errors.BadRecording(errors.no_rows(where))
    delimiter = delimiter or _delimiter(lines[:_SAMPLE], where)
    if len(lines) > _LONG and (quick := _plain(lines, numbers, delimiter, decimal, where)):
        return quick
    rows, numbers = _split(lines, numbers, delimiter, where)
    rows, numbers = _squared(rows, numbers, where)
    if not rows:
        raise errors.BadRecording(errors.no_rows(where))
    return from_rows(where, rows, numbers, decimal or _decimal(rows, delimiter))


def _plain(lines: list[str], numbers: list[int], delimiter: str, decimal: str | None,
           where: str) -> Table | None:
    """The table of a file of numbers below one header line, parsed by pandas; None if it is not.

    The numbers are those of Python's ``float``, bit for bit.
    """
    import pandas as pd

    lines = _tidy(lines, delimiter)
    first, _ = _split(lines[:_SAMPLE], numbers[:_SAMPLE], delimiter, where)
    width = len(first[0])
    decimal = decimal or _decimal(first, delimiter)
    text = "\n".join(lines)
    # pandas fills up short rows and cuts long ones at the beginning
    if '"' in text or not first[0][-1].strip() or (
            len(first) < 2 or len(first[1]) != width
            or text.count(delimiter) != (width - 1) * len(lines)):
        return None
    headed = heads(first[0], decimal)
    # from 3.1 on pandas rounds correctly by itself, and warns of the option
    version = tuple(int(part) for part in pd.__version__.split(".")[:2])
    exact: dict[str, Any] = {} if version >= (3, 1) else {"float_precision": "round_trip"}
    try:
        frame = pd.read_csv(
            io.StringIO(text), sep=delimiter, header=None, skiprows=int(headed), dtype=np.float64,
            names=range(width), index_col=False, decimal=decimal, quoting=csv.QUOTE_NONE,
            keep_default_na=False, na_values=[""], engine="c", skip_blank_lines=False,
            low_memory=False, **exact)
    except (ValueError, OverflowError, pd.errors.ParserError):
        return None
    values = frame.to_numpy()
    if len(values) != len(lines) - headed or np.isnan(values).all(axis=1).any():
        return None
    headers = [cell.strip() for cell in first[0]] if headed else [str(k + 1) for k in range(width)]
    return Table(tuple(Column(header, column) for header, column in zip(
        headers, np.ascontiguousarray(values.T), strict=True)), numbers[headed:])


def _text(content: bytes, where: str) -> str:
    encoding = "utf-16" if content[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"
    try:
        text = content.decode(encoding)
    except UnicodeDecodeError:
        text = content.decode("cp1252", errors="replace")
    # Letters beyond ASCII are fine in headers; control characters never are.
    plain = text.encode() if encoding == "utf-16" else content
    if "\ufffd" in text or len(plain.translate(None, _CONTROLS)) != len(plain):
        raise errors.BadRecording(errors.binary_junk(where))
    return text


def _lines(text: str) -> tuple[list[str], list[int]]:
    every = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    kept = [k for k, line in enumerate(every) if line.strip() and not line.startswith("#")]
    return [every[k] for k in kept], [k + 1 for k in kept]


def _delimiter(lines: list[str], where: str) -> str:
    """The sign that cuts (nearly) every line into the same number of cells."""
    best, best_share = ",", 0.0
    for sign in _DELIMITERS:
        try:
            rows = list(csv.reader(_tidy(lines, sign), delimiter=sign))
        except csv.Error:
            raise errors.BadRecording(errors.binary_junk(where)) from None
        width, count = Counter(len(row) for row in rows).most_common(1)[0]
        if width < 2:
            continue
        # A comma that parts all lines evenly may still be a decimal sign: earlier signs win ties.
        if count / len(rows) > best_share:
            best, best_share = sign, count / len(rows)
    single = all(_COMMA_NUMBER.fullmatch(line) for line in lines[1:]) and len(lines) > 1
    if best == "," and single and "," not in lines[0]:
        return "\t"  # one column with decimal commas
    return best


def _tidy(lines: list[str], delimiter: str) -> list[str]:
    """Blanks as delimiter come in runs."""
    return [" ".join(line.split()) for line in lines] if delimiter == " " else lines


def _split(lines: list[str], numbers: list[int], delimiter: str,
           where: str) -> tuple[list[list[str]], list[int]]:
    reader = csv.reader(_tidy(lines, delimiter), delimiter=delimiter)
    rows, shown = [], []
    last = 0
    try:
        for row in reader:
            rows.append(row)
            shown.append(numbers[last])  # a quoted cell may span lines: count from its first
            last = reader.line_num
    except csv.Error:
        raise errors.BadRecording(errors.binary_junk(where)) from None
    return rows, shown


def _squared(rows: list[list[str]], numbers: list[int],
             where: str) -> tuple[list[list[str]], list[int]]:
    """Rows of the header's width; delimiters at the end of lines and empty rows fall away."""
    width = len(rows[0])
    while width > 1 and not rows[0][width - 1].strip():
        width -= 1
    if any(len(row) != width for row in rows):
        rows = [
            row[:width] if len(row) > width and not any(map(str.strip, row[width:])) else row
            for row in rows
        ]
        for row, number in zip(rows, numbers, strict=True):
            if len(row) != width:
                raise errors.BadRecording(errors.ragged_row(where, number, len(row), width))
    kept = [k for k, row in enumerate(rows) if any(cell and not cell.isspace() for cell in row)]
    if len(kept) == len(rows):
        return rows, numbers
    return [rows[k] for k in kept], [numbers[k] for k in kept]


def _decimal(rows: list[list[str]], delimiter: str) -> str:
    """The sign that more cells use between digits."""
    if delimiter == ",":
        return "."
    commas = points = 0
    for row in rows[1:] or rows:
        commas += sum(1 for cell in row if "," in cell and _COMMA_NUMBER.fullmatch(cell))
        points += sum(1 for cell in row if "." in cell and _POINT_NUMBER.fullmatch(cell))
        if points > 50 * (commas + 1) or commas > 50 * (points + 1):
            break
    return "," if commas > points else "."


def content(channels: Mapping[str, Channel], ending: str) -> bytes:
    """What a file of that ending holds."""
    delimiter = "\t" if ".tsv" in ending else ","
    columns = list(flat(channels))
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
    plain = text.getvalue().encode()
    # no time stamp inside: the same recording gives the same bytes
    return gzip.compress(plain, mtime=0) if ending.endswith(".gz") else plain
