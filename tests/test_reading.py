"""Reading text: dialects, encodings, names, units, and what is missing."""

from __future__ import annotations

import gzip
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pikanid.errors import BadRecording, BadUnit
from pikanid.recording import Recording


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


def test_fifty_thousand_rows_come_back(tmp_path: Path) -> None:
    t = np.arange(50_000) * 0.01
    arrays = {"u": np.sin(t), "y": np.cos(t), "z": t**2}
    rec = Recording.from_arrays(t, arrays, name="long")
    rec.write(tmp_path / "long.csv")
    assert Recording.read(tmp_path / "long.csv") == rec


@pytest.mark.parametrize(("header", "names"), [
    ("t [s],T [degC]", ("T",)), ("t,T", ("T",)), ("T,x", ("x",)), ("T [s],x", ("x",)),
    ("t [s],Time [K]", ("Time",)), ("time,T", ("T",)), ("Zeit [s],T", ("T",))])
def test_a_temperature_is_no_time(tmp_path: Path, header: str, names: tuple[str, ...]) -> None:
    (tmp_path / "a.csv").write_text(header + "\n0,20\n1,21\n2,21.5\n")
    assert Recording.read(tmp_path / "a.csv").names == names
