"""Whatever a file contains: a recording, or one sentence that says why not."""

from __future__ import annotations

import gzip
import io
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from pikanid.errors import PikanidError
from pikanid.recording import Recording

FORMATS = [".csv", ".csv.gz", ".xlsx", ".xls", ".parquet", ".mat", ".npz"]
FUZZ = settings(
    deadline=None,
    max_examples=150,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)


def attempt(path: Path, **options: Any) -> None:
    """Read and use a file; anything but success or one sentence fails the test."""
    try:
        rec = Recording.read(path, **options)
        repr(rec)
        for name in rec.names:
            for check in (rec.as_input, rec.as_output):
                try:
                    check(name)
                except PikanidError as error:
                    one_sentence(error)
    except PikanidError as error:
        one_sentence(error)


def one_sentence(error: PikanidError) -> None:
    text = str(error)
    assert error.exit_code == 2
    assert text
    assert "Traceback" not in text
    assert len(text) < 3000


@cache
def good(ending: str) -> bytes:
    """A small sound file of each format."""
    t = np.arange(30) * 0.1
    columns = {"t": t, "theta [deg]": np.sin(t), "u": np.cos(t)}
    buffer = io.BytesIO()
    if ending.startswith(".csv"):
        rows = [",".join(columns), *(",".join(map(repr, r)) for r in np.c_[t, t**2, -t].tolist())]
        text = "\n".join(rows).encode()
        return gzip.compress(text) if ending.endswith("gz") else text
    if ending in (".xlsx", ".xls"):
        import openpyxl

        book = openpyxl.Workbook(write_only=True)
        page = book.create_sheet("run")
        page.append(list(columns))
        for row in np.column_stack(list(columns.values())).tolist():
            page.append(row)
        book.save(buffer)
    elif ending == ".parquet":
        import pyarrow as pa
        import pyarrow.parquet as pq

        pq.write_table(pa.table(columns), buffer)
    elif ending == ".npz":
        np.savez(buffer, **{"t": t, "theta": t**2, "pair": np.stack([t, -t])})
    else:
        from scipy.io import savemat

        cells = np.empty(2, dtype=object)
        cells[:] = [t, -t]
        savemat(buffer, {"t": t, "y": t**2, "s": {"time": t, "values": -t}, "c": cells})
    return buffer.getvalue()


@pytest.mark.parametrize("ending", FORMATS)
def test_the_unharmed_file_reads(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"run{ending}"
    path.write_bytes(good(ending))
    assert len(Recording.read(path).names) >= 2


@pytest.mark.parametrize("ending", FORMATS)
@given(content=st.binary(max_size=600))
@FUZZ
def test_random_bytes(tmp_path: Path, ending: str, content: bytes) -> None:
    path = tmp_path / f"run{ending}"
    path.write_bytes(content)
    attempt(path)


@pytest.mark.parametrize("ending", FORMATS)
@given(data=st.data())
@FUZZ
def test_damaged_files(tmp_path: Path, ending: str, data: st.DataObject) -> None:
    """Sound files cut off, or with bytes changed, doubled or taken out."""
    content = bytearray(good(ending))
    kind = data.draw(st.sampled_from(["cut", "change", "insert", "remove"]))
    at = data.draw(st.integers(0, len(content) - 1))
    piece = data.draw(st.binary(min_size=1, max_size=4))
    if kind == "cut":
        del content[at:]
    elif kind == "change":
        content[at : at + len(piece)] = piece
    elif kind == "insert":
        content[at:at] = piece
    else:
        del content[at : at + len(piece)]
    path = tmp_path / f"run{ending}"
    path.write_bytes(bytes(content))
    attempt(path)


@pytest.mark.parametrize("ending", [".xlsx", ".mat", ".parquet", ".npz", ".xls"])
@given(tail=st.binary(max_size=300))
@FUZZ
def test_a_true_beginning_and_a_false_rest(tmp_path: Path, ending: str, tail: bytes) -> None:
    path = tmp_path / f"run{ending}"
    head = good(ending)[:140]
    path.write_bytes((b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" if ending == ".xls" else head) + tail)
    attempt(path)


@given(text=st.text(max_size=300), rate=st.one_of(st.none(), st.floats()))
@example(text="t,y\n0,1\n1,2\n", rate=5e-324)
@FUZZ
def test_random_text(tmp_path: Path, text: str, rate: float | None) -> None:
    path = tmp_path / "run.csv"
    path.write_bytes(text.encode("utf-8", errors="surrogatepass"))
    attempt(path, rate=rate)


CELL = st.one_of(
    st.floats().map(repr),
    st.integers().map(str),
    st.floats(-9, 9).map(lambda x: repr(x).replace(".", ",")),
    st.sampled_from(["", "NaN", "-", "1e999", "abc", "1_0", '"', '"1"', "1.2.3", "٣", "0x1f", " "]),
    st.text(st.characters(exclude_characters="\r\n"), max_size=6),
)
HEADER = st.sampled_from(
    ["t", "time [ms]", "t [m]", "y", "y [deg]", "y [", "y (a (b) c)", "[]", "()", "", "t:y",
     "sigma:y", "t:t", "u [1/(s^2*rad^2)]", "z []", "#y"]
)  # fmt: skip


@given(
    st.lists(HEADER, min_size=1, max_size=5),
    st.data(),
    st.sampled_from([",", ";", "\t", " ", "|"]),
    st.sampled_from(["\n", "\r\n", "\r"]),
)
@FUZZ
def test_odd_tables(
    tmp_path: Path, headers: list[str], data: st.DataObject, delimiter: str, newline: str
) -> None:
    row = st.lists(CELL, min_size=len(headers), max_size=len(headers))
    rows = [headers, *data.draw(st.lists(row, max_size=8))]
    path = tmp_path / "run.csv"
    text = newline.join(delimiter.join(cells) for cells in rows)
    path.write_bytes(text.encode("utf-8", errors="surrogatepass"))
    attempt(path)
    attempt(path, columns={"t": "t", "theta": "y"})
    attempt(path, rate=10.0, delimiter=";", decimal=",")
