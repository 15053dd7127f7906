"""Long files are parsed by pandas: the same numbers, bit for bit, and the same messages."""

from __future__ import annotations

import struct
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from pikanid.errors import PikanidError
from pikanid.recording.reading import csv
from pikanid.recording.reading.table import Options

ODD = [
    "", " ", "nan", "NaN", "inf", "-inf", "Infinity", "1e400", "-1e-400", "1_000", "0x1A", "1,5",
    "1.5", "+.5", "5.", "1e5", "1E+05", "1d5", "NA", "-", "--", "null", "word", "True", "2e", "e",
    "12345678901234567890", "9007199254740993", "0.1e1", " 2.5", "2.5 ", "\uff11", '"3"', '"a;b"',
    "#", "2021-10-25 00:00:00", "4.9406564584124654e-324", "1.7976931348623159e308"]
FLOATS = st.integers(0, 2**64 - 1).map(
    lambda bits: repr(struct.unpack("<d", struct.pack("<Q", bits))[0]))
CELLS = st.one_of(FLOATS, FLOATS, st.decimals(allow_nan=False, allow_infinity=False,
                                              places=20).map(str), st.sampled_from(ODD))


def outcome(content: bytes, delimiter: str | None = None) -> Any:
    """What reading gives: headers, defects, row numbers and the bits of all values, or why not."""
    try:
        table = csv.read(content, "run.csv", Options(delimiter=delimiter))
    except PikanidError as problem:
        return type(problem), str(problem)
    return ([(c.header, c.defect, c.text, c.unit, c.is_clock, c.values.tobytes())
             for c in table.columns], list(table.rows or ()))


@settings(max_examples=150, deadline=None)
@given(st.lists(st.lists(CELLS, min_size=2, max_size=4), min_size=2, max_size=8),
       st.sampled_from([",", ";", "\t", " "]), st.booleans(), st.integers(0, 3))
@example([["0", "1"], ["1", "2", ""], ["2"]], ",", True, 0)  # as many cells as there should be
@example([["0", "1", "7"], ["1", ""]], ",", True, 0)
@example([["", ""], ["1", "2"]], ";", True, 2)
@example([["1,5", "1,25"], ["2,5", "3"]], ";", True, 0)
def test_both_ways_of_reading_agree(rows: list[list[str]], delimiter: str, headed: bool,
                                    extra: int) -> None:
    head = [[f"c{k} [m]" for k in range(len(rows[0]))]] if headed else []
    lines = [delimiter.join(row) for row in [*head, *rows]]
    lines[1:1] = ["# a comment", "", "   "][:extra]
    content = "\n".join(lines).encode()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(csv, "_LONG", 10**9)
        slow = outcome(content)
        patch.setattr(csv, "_LONG", 0)
        assert outcome(content) == slow


def test_a_long_file_of_numbers_is_parsed_by_pandas(monkeypatch: pytest.MonkeyPatch) -> None:
    """Cell by cell is for what is not plain: the two ways differ by a factor of five."""
    monkeypatch.setattr(csv, "from_rows", None)
    rows = [f"{k / 7!r};{k};{'' if k % 3 else -k / 3}" for k in range(6000)]
    table = csv.read("\r\n".join(["t [s];a;b", *rows, ""]).encode(), "run.csv", Options())
    assert [c.header for c in table.columns] == ["t [s]", "a", "b"]
    np.testing.assert_array_equal(table.columns[0].values, np.arange(6000) / 7)
    assert np.isnan(table.columns[2].values).sum() == 4000
    assert table.rows is not None and (table.rows[0], table.rows[-1]) == (2, 6001)


@pytest.mark.parametrize("where", [10, 5500])
def test_a_bad_cell_of_a_long_file_is_named(where: int) -> None:
    rows = [f"{k},{k}" for k in range(6000)]
    rows[where] = f"{where},volts"
    table = csv.read("\n".join(["t,a", *rows]).encode(), "run.csv", Options())
    assert f"row {where + 2}" in table.columns[1].defect and "volts" in table.columns[1].defect
