"""Reading files: every format, and one clear sentence for everything that can be wrong."""

from __future__ import annotations

import gzip
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pikanid.errors import BadRecording, BadSetting, BadUnit, PikanidError
from pikanid.recording import Recording
from pikanid.recording.reading import mat5

T = np.arange(5) * 0.1
Y = np.array([1.0, 2.0, 0.5, -1.0, 3.0])


@pytest.fixture
def read(tmp_path: Path) -> Any:
    """Write text or bytes to a file and read it as a recording."""

    def go(content: str | bytes, name: str = "run.csv", **settings: Any) -> Recording:
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return Recording.read(path, **settings)

    return go


# --- text ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "text",
    [
        "t,theta [deg]\n0,1.5\n0.1,2.5\n",
        "t [s],theta (deg)\n0,1.5\n0.1,2.5",
        "t;theta [°]\n0,0;1,5\n0,1;2,5\n",
        "t;theta [deg]\n0.0;1.5\n0.1;2.5\n",
        "time\ttheta [degree]\n0\t1.5\n0.1\t2.5\n",
        "Time [ms],theta [deg]\n0,1.5\n100,2.5\n",
        "t|theta [deg]\r\n0|1.5\r\n0.1|2.5\r\n",
        "\n# a comment, with commas\nt,theta [deg]\n0,1.5\n# another\n\n0.1,2.5\n",
        "sep=;\nt;theta [deg]\n0;1.5\n0.1;2.5\n",
        '"t","theta [deg]"\n"0","1.5"\n"0.1","2.5"\n',
        "t,theta [deg],\n0,1.5,\n0.1,2.5,\n",
        " t , theta [deg] \n 0 , 1.5 \n 0.1 , 2.5 \n,\n",
        "\ufefft,theta [deg]\n0,1.5\n0.1,2.5\n",
        "t,theta [deg]\n0.0e0,+1.5E0\n1e-1,25e-1\n",
        "when,theta [deg]\n2026-01-01T00:00:00,1.5\n2026-01-01T00:00:00.100,2.5\n",
    ],
)
def test_dialects_agree(read: Any, text: str) -> None:
    columns = {"t": "when"} if "when" in text else None
    theta = read(text, columns=columns)["theta"]
    assert theta.unit == "deg"
    np.testing.assert_allclose(theta.time, [0, 0.1])
    np.testing.assert_allclose(theta.values, [1.5, 2.5])


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "latin-1", "cp1252"])
def test_encodings(read: Any, encoding: str) -> None:
    assert read("t,Größe [°]\n0,1\n1,2\n".encode(encoding))["Größe"].unit == "deg"


@pytest.mark.parametrize("name", ["run.csv.gz", "run.CSV", "run.txt", "run.tsv", "run.dat"])
def test_endings(read: Any, name: str) -> None:
    content = b"t,y\n0,1\n1,2\n"
    rec = read(gzip.compress(content) if name.endswith("gz") else content, name)
    assert rec.name == "run"
    assert rec["y"].values.tolist() == [1, 2]


def test_gzip_under_a_plain_name(read: Any) -> None:
    assert read(gzip.compress(b"t,y\n0,1\n1,2\n", mtime=0))["y"].values.tolist() == [1, 2]


def test_empty_cells_are_missing_samples(read: Any) -> None:
    rec = read("t,u,y,z\n0,1,1,4\n1,2,,NaN\n2,3,N/A,5\n3,4,null,6\n4,5,7,8\n")
    np.testing.assert_array_equal(rec.as_output("y").values, [1, np.nan, np.nan, np.nan, 7])
    with pytest.raises(BadRecording, match="input 'z' is missing"):
        rec.as_input("z")


def test_one_column_and_a_rate(read: Any) -> None:
    rec = read("theta\n0,1\n0,2\n0,4\n", rate=50)
    np.testing.assert_allclose(rec["theta"].time, [0, 0.02, 0.04])
    np.testing.assert_allclose(rec["theta"].values, [0.1, 0.2, 0.4])


def test_a_file_without_header(read: Any) -> None:
    rec = read("0;0;1\n0.5;2;3\n1;1;2\n", columns={"t": 1, "u": "2", "y": 3})
    assert rec["u"].values.tolist() == [0, 2, 1]
    assert rec["y"].time.tolist() == [0, 0.5, 1]
    with pytest.raises(BadRecording, match="no time column among: 1, 2, 3"):
        read("0;0;1\n0.5;2;3\n1;1;2\n")


def test_mapping_keeps_the_rest(read: Any) -> None:
    rec = read("when,angle [deg],volt\n0,1,2\n1,3,4\n", columns={"t": "when", "theta": "angle"})
    assert rec.names == ("theta", "volt")
    assert rec["theta"].unit == "deg"
    assert read("s,a [deg]\n0,1\n1,3\n", columns={"time": "s", "y": "a [deg]"}).names == ("y",)


def test_units_can_be_told(read: Any) -> None:
    rec = read("t,y [furlongs per fortnight]\n0,1\n100,3\n", units={"y": "mV", "t": "ms"})
    assert rec["y"].unit == "mV"
    np.testing.assert_allclose(rec.t, [0, 0.1])
    with pytest.raises(BadUnit, match="unknown"):
        read("t,y\n0,1\n1,3\n", units={"y": "widgets"})
    with pytest.raises(BadUnit, match="time column"):
        read("t [m],y\n0,1\n1,3\n")
    with pytest.raises(BadRecording, match="no column 'z'"):
        read("t,y\n0,1\n1,3\n", units={"z": "m"})


def test_an_unknown_unit_matters_only_on_use(read: Any) -> None:
    rec = read("t,y [widgets],z\n0,1,1\n1,3,2\n")
    assert rec.as_output("z").values.tolist() == [1, 2]
    with pytest.raises(BadUnit, match="'widgets' of channel 'y'"):
        rec.as_output("y")


def test_headers_that_differ_in_their_unit(read: Any) -> None:
    rec = read("t,y [deg],y [rad]\n0,1,1\n1,3,2\n")
    assert rec.names == ("y [deg]", "y [rad]")
    assert read("t,y [deg],y [rad]\n0,1,1\n1,3,2\n", columns={"y": "y [rad]"})["y"].unit == "rad"


def test_words_beside_numbers_are_left_out(read: Any) -> None:
    rec = read("t,y,note\n0,1,start\n1,3,\n2,4,stop\n")
    assert rec.names == ("y",)
    assert "'note' is left out" in rec.notes[0]
    with pytest.raises(BadRecording, match="row 2, column 'note': 'start' is not a number"):
        rec["note"]


def test_sigma_from_the_caller(read: Any) -> None:
    assert read("t,y\n0,1\n1,3\n", sigma={"y": 0.1})["y"].sigma == 0.1


def test_own_times_of_a_channel(read: Any) -> None:
    rec = read("t,u,t:y,y\n0,1,0.05,7\n0.1,2,0.15,8\n0.2,3,,\n")
    assert rec["u"].time.tolist() == [0, 0.1, 0.2]
    assert rec["y"].time.tolist() == [0.05, 0.15]


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


def test_fifty_thousand_rows_come_back(tmp_path: Path) -> None:
    t = np.arange(50_000) * 0.01
    arrays = {"u": np.sin(t), "y": np.cos(t), "z": t**2}
    rec = Recording.from_arrays(t, arrays, name="long")
    rec.write(tmp_path / "long.csv")
    assert Recording.read(tmp_path / "long.csv") == rec


# --- Excel ---------------------------------------------------------------------------------------


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


# --- Parquet, NPZ, MAT ---------------------------------------------------------------------------


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


def nested() -> dict[str, Any]:
    signals = {"values": Y[:, None], "label": "theta"}
    other = {"time": T[:3, None], "signals": {"values": Y[:3, None]}}
    cells = np.empty((2, 1), dtype=object)
    cells[0, 0], cells[1, 0] = np.vstack([Y, -Y]), np.arange(4.0)[:, None]
    return {
        "Theta": {"time": T[:, None], "signals": signals},
        "Other": other,
        "Cells": cells,
        "dt": 0.1,
        "word": "abc",
    }


def write_v73(path: Path, content: dict[str, Any]) -> None:
    """A MAT 7.3 file as MATLAB writes it: transposed datasets, references for cells."""
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:

        def put(group: Any, name: str, value: Any) -> Any:
            if isinstance(value, dict):
                made = group.create_group(name)
                made.attrs["MATLAB_class"] = np.bytes_("struct")
                for key, inner in value.items():
                    put(made, key, inner)
            elif isinstance(value, str):
                made = group.create_dataset(name, data=np.array([[ord(c)] for c in value], "u2"))
                made.attrs["MATLAB_class"] = np.bytes_("char")
            elif np.asarray(value).dtype == object:
                array = np.asarray(value)
                references = np.empty(array.T.shape, dtype=h5py.ref_dtype)
                for k, cell in enumerate(array.ravel()):
                    references.ravel()[k] = put(file.require_group("#refs#"), f"c{k}", cell).ref
                made = group.create_dataset(name, data=references)
                made.attrs["MATLAB_class"] = np.bytes_("cell")
            else:
                made = group.create_dataset(name, data=np.atleast_2d(np.asarray(value)).T)
                made.attrs["MATLAB_class"] = np.bytes_("double")
            return made

        for key, value in content.items():
            put(file, key, value)
    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(512, b" ")
    with path.open("r+b") as raw:
        raw.write(head)


@pytest.mark.parametrize("version", ["5", "7.3"])
def test_mat_structures_and_cells(tmp_path: Path, version: str) -> None:
    path = tmp_path / "run.mat"
    if version == "5":
        from scipy.io import savemat

        savemat(path, nested())
    else:
        write_v73(path, nested())
    rec = Recording.read(path)
    assert set(rec.names) == {"Theta.signals.values", "Other.signals.values"}
    assert rec["Theta.signals.values"].time.tolist() == T.tolist()
    assert rec["Other.signals.values"].time.tolist() == T[:3].tolist()
    assert set(rec.unreadable) == {"Cells.1.1", "Cells.1.2", "Cells.2"}
    cell = Recording.read(path, columns={"t": "Theta.time", "y": "Cells.1.2"})
    assert cell["y"].values.tolist() == (-Y).tolist()
    assert Recording.read(path, columns={"z": "Cells.2"}, rate=10)["z"].time[-1] == pytest.approx(
        0.3
    )


def test_mat_of_plain_vectors(tmp_path: Path) -> None:
    from scipy.io import savemat

    path = tmp_path / "run.mat"
    savemat(path, {"V1": Y, "V2": -Y, "flag": np.uint8([[1]])})
    rec = Recording.read(path, columns={"u": "V1", "y": "V2"}, rate=10)
    assert rec.names == ("u", "y")
    np.testing.assert_allclose(rec.t, T)
    with pytest.raises(BadRecording, match="no time column among: V1, V2"):
        Recording.read(path)
    savemat(path, {"note": "nothing here"})
    with pytest.raises(BadRecording, match="no numeric vector"):
        Recording.read(path)


@pytest.mark.parametrize("name", ["run.xlsx", "run.xls", "run.parquet", "run.mat", "run.npz"])
@pytest.mark.parametrize("content", [b"", b"junk", b"t,y\n0,1\n1,2\n", b"\x00" * 300])
def test_other_formats_hold_something_else(read: Any, name: str, content: bytes) -> None:
    with pytest.raises(PikanidError, match=r"empty|damaged or cut off|rename|no numeric"):
        read(content, name)


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("kind", ["f8", "f4", "i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "?"])
def test_level_5_arrays_as_scipy_writes_them(kind: str, packed: bool) -> None:
    from io import BytesIO

    from scipy.io import savemat

    array = (np.random.default_rng(0).standard_normal((3, 4, 2)) * 100).astype(kind)
    many = np.array([(1.0, array[0]), (2.0, array[1])], dtype=[("p", "O"), ("q", "O")])
    content = {"a_name_beyond_four_bytes": array, "s": {"in": {"y": array[:, 0]}}, "m": many,
               "none": np.zeros((0, 0)), "z": 1j * np.ones(3), "word": "abc"}  # fmt: skip
    buffer = BytesIO()
    savemat(buffer, content, do_compression=packed)
    found = dict(mat5.leaves(buffer.getvalue()))
    assert set(found) == {"a_name_beyond_four_bytes", "s.in.y", "m.1.p", "m.1.q", "m.2.p", "m.2.q",
                          "none"}  # fmt: skip
    np.testing.assert_array_equal(found["a_name_beyond_four_bytes"], array)
    np.testing.assert_array_equal(found["s.in.y"], array[:, 0])
    np.testing.assert_array_equal(found["m.2.q"], array[1])


def test_level_5_files_of_the_other_byte_order() -> None:
    """Written by hand: one double matrix [1, 2] called y, most significant byte first."""
    import struct

    parts = [
        struct.pack(">IIII", 6, 8, 6, 0),
        struct.pack(">IIii", 5, 8, 1, 2),
        struct.pack(">HHI", 1, 1, ord("y") << 24),
        struct.pack(">IIdd", 9, 16, 1.0, 2.0),
    ]
    body = b"".join(parts)
    head = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x01\x00MI"
    found = dict(mat5.leaves(head + struct.pack(">II", 14, len(body)) + body))
    assert found["y"].tolist() == [[1.0, 2.0]]


@pytest.mark.parametrize("content", [b",", b";;\n", b"\t\n\t\n"])
def test_delimiters_alone_are_no_rows(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "run.csv").write_bytes(content)
    with pytest.raises(BadRecording, match="no rows of data"):
        Recording.read(tmp_path / "run.csv")
