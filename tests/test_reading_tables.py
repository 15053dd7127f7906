"""Reading Excel, Parquet and NPZ."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pikanid.errors import BadRecording
from pikanid.recording import Recording

T = np.arange(5) * 0.1
Y = np.array([1.0, 2.0, 0.5, -1.0, 3.0])


def workbook(path: Path, rows: list[list[Any]], title: str = "run 1") -> None:
    import openpyxl

    book = openpyxl.Workbook()
    page = book.active
    assert page is not None
    page.title = title
    for row in rows:
        page.append(row)
    book.create_sheet("empty")
    book.save(path)


def test_excel(tmp_path: Path) -> None:
    path = tmp_path / "run.xlsx"
    rows = [["t [s]", "y [mm]", "note"], [0, 1.5, "a"], [0.5, None, None], [1, "2.5", "b"]]
    workbook(path, [*rows, [None, None, None]])
    for sheet in (None, "run 1", 0, "0"):
        y = Recording.read(path, sheet=sheet)["y"]
        assert y.unit == "mm"
        np.testing.assert_array_equal(y.values, [1.5, np.nan, 2.5])
    with pytest.raises(BadRecording, match=r"no sheet 'run 2' \(sheets: run 1, empty\)"):
        Recording.read(path, sheet="run 2")
    with pytest.raises(BadRecording, match="no rows"):
        Recording.read(path, sheet="empty")


def test_excel_rows_are_counted_as_excel_does(tmp_path: Path) -> None:
    path = tmp_path / "run.xlsx"
    workbook(path, [[], ["t", "y"], [0, 1], [1, 5], [2, "bad"], [3, 4]])
    with pytest.raises(BadRecording, match="row 5, column 'y': 'bad' is not a number"):
        Recording.read(path)


def test_excel_dates(tmp_path: Path) -> None:
    from datetime import datetime

    path = tmp_path / "run.xlsx"
    stamps = [datetime(2026, 1, 1, 0, 0, s) for s in (0, 1, 3)]
    workbook(path, [["time", "y"], *[[stamp, k] for k, stamp in enumerate(stamps)]])
    assert Recording.read(path).t.tolist() == [0, 1, 3]


def test_excel_under_the_other_ending(tmp_path: Path) -> None:
    path = tmp_path / "run.xls"
    workbook(tmp_path / "new.xlsx", [["t", "y"], [0, 1], [1, 5]])
    (tmp_path / "new.xlsx").rename(path)
    assert Recording.read(path)["y"].values.tolist() == [1, 5]


def test_parquet_of_other_writers(tmp_path: Path) -> None:
    import pandas as pd

    stamps = pd.to_datetime("2026-01-01") + pd.to_timedelta([0, 0.5, 1.5], unit="s")
    frame = pd.DataFrame(
        {"time": stamps, "y [mV]": [1, 2, None], "n": pd.array([1, None, 3], "Int64"), "s": "x"}
    )
    frame.to_parquet(tmp_path / "run.parquet")
    rec = Recording.read(tmp_path / "run.parquet")
    assert rec["y"].unit == "mV"
    assert rec.t.tolist() == [0, 0.5, 1.5]
    np.testing.assert_array_equal(rec["n"].values, [1, np.nan, 3])
    assert "s" in rec.unreadable


def test_npz(tmp_path: Path) -> None:
    path = tmp_path / "run.npz"
    np.savez(path, t=T, y=Y, pose=np.column_stack([Y, 2 * Y]), dt=0.1, label="swing")
    rec = Recording.read(path)
    assert rec.names == ("y", "pose.1", "pose.2")
    assert rec["pose.2"].values.tolist() == (2 * Y).tolist()
    assert Recording.read(path, columns={"theta": "pose.1"}).names == ("theta",)


def test_a_temperature_in_an_archive_is_no_time(tmp_path: Path) -> None:
    np.savez(tmp_path / "run.npz", T=20.0 + Y, t=T, y=Y)
    rec = Recording.read(tmp_path / "run.npz")
    assert set(rec.names) == {"T", "y"} and rec["y"].time.tolist() == T.tolist()


def test_npz_never_unpickles(tmp_path: Path) -> None:
    path = tmp_path / "run.npz"
    np.savez(path, t=T, y=np.array([print, 1], dtype=object))
    with pytest.raises(BadRecording, match="damaged"):
        Recording.read(path)


def test_npz_lengths(tmp_path: Path) -> None:
    np.savez(tmp_path / "run.npz", clock=T, y=Y, z=Y[:3])
    rec = Recording.read(tmp_path / "run.npz", columns={"t": "clock", "y": "y"})
    assert rec.names == ("y",)
    with pytest.raises(BadRecording, match="'z' has 3 values but its time column has 5"):
        Recording.read(tmp_path / "run.npz", columns={"t": "clock", "z": "z"})


@pytest.mark.parametrize(("written", "unit"), [
    ("Nm", "N*m"), ("U/min", "rpm"), ("Grad", "deg"), ("m s-2", "m/s^2"), ("Volts", "V")])
def test_units_as_benches_write_them(tmp_path: Path, written: str, unit: str) -> None:
    (tmp_path / "run.csv").write_text(f"t,y [{written}]\n0,1\n1,2\n")
    assert Recording.read(tmp_path / "run.csv")["y"].converted(unit).values.tolist() == [1.0, 2.0]
