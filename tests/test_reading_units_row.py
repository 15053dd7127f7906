"""A row of units below the headers, as loggers and spreadsheets write it, and dates of a locale."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pikanid.errors import BadRecording
from pikanid.recording import Recording


def written(folder: Path, text: str) -> Path:
    path = folder / "run.csv"
    path.write_text(text, "utf-8")
    return path


@pytest.mark.parametrize("row", ["s,deg,m/s^2,-", "[s],[deg],[m/s^2],", "(s),(deg),(m/s^2),counts"])
def test_a_row_of_units_is_read(tmp_path: Path, row: str) -> None:
    rec = Recording.read(written(tmp_path, f"t,theta,u_x,n\n{row}\n0,0,0,1\n0.1,2,3,1\n0.2,3,,2\n"))
    assert [rec[n].unit for n in ("theta", "u_x")] == ["deg", "m/s^2"]
    assert rec["theta"].values.tolist() == [0.0, 2.0, 3.0] and np.isnan(rec["u_x"].values[2])
    assert rec.t.tolist() == [0.0, 0.1, 0.2]
    assert any("row 2: taken for the columns' units" in note for note in rec.notes)


def test_times_are_in_the_unit_of_their_row(tmp_path: Path) -> None:
    rec = Recording.read(written(tmp_path, "t;y\nms;V\n0;0,5\n10;0,6\n20;0,7\n"))
    assert rec.t.tolist() == pytest.approx([0.0, 0.01, 0.02])
    assert rec["y"].values.tolist() == [0.5, 0.6, 0.7]


@pytest.mark.parametrize("text", [
    "t,y\n0,on\n1,2\n2,3\n",  # a word among numbers
    "t,y\nfirst,second\n1,2\n2,3\n",  # words that are no units
    "t,y\ns,V\nA,B\n1,2\n"])  # nothing below that is a number
def test_other_rows_of_words_are_refused_where_they_are(tmp_path: Path, text: str) -> None:
    with pytest.raises(BadRecording, match=r"row [23], column .* is not a number"):
        Recording.read(written(tmp_path, text), {"y": "y"})


def test_dates_of_a_locale_are_refused_with_those_that_are_read(tmp_path: Path) -> None:
    text = "Timestamp,y\n03/31/2024 01:50:00 AM,1\n03/31/2024 01:50:01 AM,2\n"
    with pytest.raises(BadRecording, match="2024-03-31T13:50:00"):
        Recording.read(written(tmp_path, text))


def test_headers_with_units_have_no_row_of_them(tmp_path: Path) -> None:
    """Which of both is meant is for the file's author to say."""
    with pytest.raises(BadRecording, match="row 2, column"):
        Recording.read(written(tmp_path, "t [ms],y [mm]\ns,m\n0,1\n100,2\n200,4\n"))


@pytest.mark.parametrize(("factor", "unit"), [(1e3, "ms"), (1e6, "us"), (1e9, "ns")])
def test_times_counted_since_1970_are_in_their_unit(tmp_path: Path, factor: float, unit: str
                                                    ) -> None:
    """As seconds they would lie thousands of years ahead; seconds, and what has a unit, stay."""
    lines = "".join(f"{(1.7118498e9 + k) * factor:.0f},{k}\n" for k in range(4))
    rec = Recording.read(written(tmp_path, "timestamp,y\n" + lines))
    assert np.diff(rec.t).tolist() == pytest.approx([1.0, 1.0, 1.0])
    assert any(f"read as {unit} since 1970" in note for note in rec.notes)
    for head in ("timestamp [s]", "y2"):
        rec = Recording.read(written(tmp_path, f"{head},y\n" + lines), rate=None if "[s]" in head
                             else 1.0)
        assert not rec.notes


@pytest.mark.parametrize(("times", "head", "told"), [
    ("0 20 40", "t", True), ("0.0 20.0 40.0", "time", True), ("0 0.02 0.04", "t", False),
    ("0 20 40", "t [ms]", False)])
def test_times_that_are_whole_numbers_without_a_unit_are_told(
        tmp_path: Path, times: str, head: str, told: bool) -> None:
    file = tmp_path / "run.csv"
    file.write_text(f"{head},y [V]\n" + "".join(f"{t},{k}\n" for k, t in enumerate(times.split())))
    assert any("are read as seconds" in note for note in Recording.read(file).notes) is told
    assert not Recording.read(file, units={"t": "ms"}).notes
