"""Reading files: one clear sentence for everything that can be wrong with them."""

from __future__ import annotations

import gzip
from pathlib import Path
from typing import Any

import pytest

from pikanid.errors import BadRecording, BadSetting, PikanidError
from pikanid.recording import Recording


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("", "is empty"),
        ("\n \n\n", "no rows"),
        ("t,y\n", "no rows"),
        ("t,y\n0,1\n0.1,abc\n0.2,3", "row 3, column 'y': 'abc' is not a number"),
        ("t,y\n0,1\n\n#\n0.1,1.2.3\n0.2,3", "row 5, column 'y': '1.2.3' is not a number"),
        ("t,y\n0,1_000\n0.2,3", "'1_000' is not a number"),
        ("t;y\n0;1.234,5\n1;1,5\n2;1,5\n3;1,5", "'1.234,5' is not a number"),
        ("t,y\n0,1\nx,2\n2,3", "row 3, column 't': 'x' is not a number"),
        ("t,y\n0,1\n,2\n2,3", "row 3: the time is nan"),
        ("t,y\n0,1\n0.2,2\n0.1,3", "row 4: the time 0.1 s goes back from 0.2 s"),
        ("t,y\n0,1\n0.2,2\n0.2,3", "row 4: the time 0.2 s repeats"),
        ("t,y\n0,1\n0.2,1e308\n0.3,3", "row 3: 'y' is 1e.308, beyond 1e300"),
        ("t,y\n0,1\n0.2,inf\n0.3,3", "row 3: 'y' is inf"),
        ("t,y\n0,1\n0.2,1e999\n0.3,3", "row 3: 'y' is inf"),
        ("t,y\n0,1\n1e308,2", "row 3: the time is 1e.308"),
        ("t,y\n0,1\n0.1,2\n0.2", "row 4: 1 cell.* where the header has 2; .*cut off"),
        ("t,y\n0,1\n0.1,2,3\n0.2,3", "row 3: 3 cell.* where the header has 2"),
        ("t,y,y\n0,1,2\n1,2,3", "two columns called 'y'"),
        ("x,y\n0,1\n1,2", "no time column among: x, y"),
        ("t,y\n0,a\n1,b", "row 2, column 'y': 'a' is not a number|nothing to identify"),
        ("t\n0\n1", "nothing to identify"),
        (b"\x00\x01\x02\x03" * 99, "binary data"),
        (bytes(range(256)), "binary data"),
        (b"PK\x03\x04 xl/workbook", "is an Excel workbook .* rename it"),
        (b"PAR1....", "is a Parquet file"),
        (b"\x1f\x8b junk", "damaged or cut off"),
        (gzip.compress(b"t,y\n0,1\n1,2\n" * 9, mtime=0)[:-9], "damaged or cut off"),
        (gzip.compress(b"", mtime=0), "is empty"),
        ("t,y\n0,1\n" + '"' + "x" * 200_000, "not text|cell"),
    ],
)
def test_bad_text(read: Any, content: str | bytes, said: str) -> None:
    with pytest.raises(BadRecording, match=said) as caught:
        read(content)
    sentence = str(caught.value)
    assert sentence.startswith("'run.csv'")
    assert "\n" not in sentence
    assert "Traceback" not in sentence


def test_bad_places(tmp_path: Path) -> None:
    with pytest.raises(BadRecording, match="no file"):
        Recording.read(tmp_path / "missing.csv")
    with pytest.raises(BadRecording, match="is a folder"):
        Recording.read(tmp_path)
    with pytest.raises(BadRecording, match="no file"):
        Recording.read("a\0b.csv")
    with pytest.raises(BadRecording, match="no file"):
        Recording.read("x" * 5000 + ".csv")
    (tmp_path / "run.docx").write_text("t,y\n0,1\n")
    with pytest.raises(BadRecording, match=r"no known format \(known: .csv"):
        Recording.read(tmp_path / "run.docx")


@pytest.mark.parametrize(
    "settings",
    [
        {"delimiter": "ab"},
        {"delimiter": ""},
        {"decimal": "x"},
        {"delimiter": ",", "decimal": ","},
        {"rate": 0.0},
        {"rate": -5.0},
        {"rate": float("nan")},
    ],
)
def test_bad_settings(read: Any, settings: dict[str, Any]) -> None:
    with pytest.raises(BadSetting):
        read("t,y\n0,1\n1,2\n", **settings)


def test_a_rate_that_disagrees(read: Any) -> None:
    with pytest.raises(BadRecording, match="sampled at 10 Hz, not at 50 Hz"):
        read("t,y\n0,1\n0.1,2\n0.2,3\n", rate=50)
    assert len(read("t,y\n0,1\n0.1,2\n0.2,3\n", rate=10).t) == 3


def test_a_mapped_column_must_be_there_and_be_sound(read: Any) -> None:
    text = "t,angle,other\n0,1,x1\n1,2,3\n2,3,4\n"
    assert read(text, columns={"theta": "angle"}).names == ("theta",)
    with pytest.raises(BadRecording, match="'x1' is not a number"):
        read(text)
    with pytest.raises(BadRecording, match="'x1' is not a number"):
        read(text, columns={"y": "other"})
    with pytest.raises(BadRecording, match=r"no column 'angel'.*Did you mean 'angle'\?"):
        read(text, columns={"theta": "angel"})


@pytest.mark.parametrize("content", [b",", b";;\n", b"\t\n\t\n"])
def test_delimiters_alone_are_no_rows(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "run.csv").write_bytes(content)
    with pytest.raises(BadRecording, match="no rows of data"):
        Recording.read(tmp_path / "run.csv")


@pytest.mark.parametrize("name", ["run.xlsx", "run.xls", "run.parquet", "run.mat", "run.npz"])
@pytest.mark.parametrize("content", [b"", b"junk", b"t,y\n0,1\n1,2\n", b"\x00" * 300])
def test_other_formats_hold_something_else(read: Any, name: str, content: bytes) -> None:
    with pytest.raises(PikanidError, match=r"empty|damaged or cut off|rename|no numeric"):
        read(content, name)
