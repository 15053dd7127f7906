"""HDF5 and TDMS: where times and units come from, and what is left closed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import benches
import numpy as np
import pytest

from pikanid import errors
from pikanid.recording import Recording

h5py = pytest.importorskip("h5py", reason="needs the `hdf5` extra")
T = np.arange(0.0, 1.0, 0.02)


def hdf5(path: Path, fill: Any) -> Recording:
    with h5py.File(path, "w") as file:
        fill(file)
    return Recording.read(path)


def test_times_of_hdf5(tmp_path: Path) -> None:
    def fill(file: Any) -> None:
        file["time"] = T
        file["deep/er/y"] = T**2  # the vector of times around it
        file["scaled"], file["axis"] = np.arange(30.0), np.arange(30.0) / 10
        file["axis"].attrs["units"] = "minutes since 2023-11-14T22:13:20"
        file["axis"].make_scale("time")
        file["scaled"].dims[0].attach_scale(file["axis"])
        file["rate"] = np.arange(7.0)
        file["rate"].attrs.update({"sampling_rate": 50.0, "unit": "°C"})
        file["step"] = np.arange(7)
        file["step"].attrs["dt"] = 0.5
        file["table"] = np.rec.fromarrays([T / 2, -T], names=["time", "force"])
        file["pair"] = np.stack([T, -T], axis=1)
        file["words"] = np.array(["a", "b"], dtype=h5py.string_dtype())
        file["number"] = 3.0

    rec = hdf5(tmp_path / "run.h5", fill)
    for name, values, times in [
            ("y", T**2, T), ("scaled", np.arange(30), 6.0 * np.arange(30)),
            ("rate", np.arange(7), np.arange(7) / 50), ("step", np.arange(7), np.arange(7) / 2),
            ("force", -T, T / 2), ("pair.1", T, T), ("pair.2", -T, T)]:
        np.testing.assert_allclose(rec[name].values, values, err_msg=name)
        np.testing.assert_allclose(rec[name].time, times, atol=1e-12, err_msg=name)
    assert rec["rate"].unit == "degC" and "words" not in rec and "number" not in rec


def test_a_temperature_is_no_time(tmp_path: Path) -> None:
    def fill(file: Any) -> None:
        file["T"], file["time"], file["y"] = 20.0 + T, T / 2, -T

    rec = hdf5(tmp_path / "run.h5", fill)
    np.testing.assert_array_equal(rec["T"].values, 20.0 + T)
    np.testing.assert_array_equal(rec["y"].time, T / 2)


def test_a_temperature_in_tdms_is_no_time(tmp_path: Path) -> None:
    nptdms = pytest.importorskip("nptdms", reason="needs the `tdms` extra")
    made = nptdms.ChannelObject
    benches.tdms(tmp_path / "run.tdms", [
        made("A", "T", 20.0 + T, {"unit_string": "degC"}), made("A", "Time", T),
        made("A", "y", -T)])
    rec = Recording.read(tmp_path / "run.tdms")
    assert set(rec.names) == {"T", "y"} and rec["T"].unit == "degC"
    np.testing.assert_array_equal(rec["y"].time, T)


def test_dates_of_netcdf(tmp_path: Path) -> None:
    def fill(file: Any) -> None:
        file["time"], file["y"] = np.arange(5), np.arange(5.0)
        file["time"].attrs["units"] = "hours since 2023-11-14 22:13:20"

    rec = hdf5(tmp_path / "run.nc", fill)
    assert rec["y"].interval == 3600.0 and rec.began == benches.START


def test_other_files_stay_closed(tmp_path: Path) -> None:
    import os

    os.mkfifo(tmp_path / "pipe.h5")
    (tmp_path / "raw").write_bytes(bytes(8 * len(T)))

    def fill(file: Any) -> None:
        file["t"], file["y"] = T, T**2
        file["link"] = h5py.ExternalLink(str(tmp_path / "pipe.h5"), "/y")
        file["round"] = h5py.SoftLink("/")
        file.create_dataset("raw", (len(T),), "f8",
                            external=[(str(tmp_path / "raw"), 0, h5py.h5f.UNLIMITED)])

    assert hdf5(tmp_path / "run.h5", fill).names == ("y",)


def test_a_shape_that_nobody_wrote_is_refused_unless_it_is_not_asked_for(tmp_path: Path) -> None:
    def fill(file: Any) -> None:
        file["t"], file["y"] = T, T**2
        file.create_dataset("vast", (10**9,), "f8", chunks=(10**6,)).attrs["dt"] = 0.1

    with pytest.raises(errors.BadRecording, match=r"more than 512 MiB of samples: name those"):
        hdf5(tmp_path / "run.h5", fill)
    assert Recording.read(tmp_path / "run.h5", {"theta": "y"}).names == ("theta",)


@pytest.mark.parametrize("fill", [lambda file: None, lambda file: file.create_group("a/b")])
def test_an_hdf5_file_without_vectors(tmp_path: Path, fill: Any) -> None:
    with pytest.raises(errors.BadRecording, match="holds no signals"):
        hdf5(tmp_path / "run.h5", fill)


def test_times_of_tdms(tmp_path: Path) -> None:
    nptdms = pytest.importorskip("nptdms", reason="needs the `tdms` extra")
    made = nptdms.ChannelObject
    began = np.datetime64(benches.START, "s")
    benches.tdms(tmp_path / "run.tdms", [
        made("A", "first", T, {"wf_increment": 0.02, "wf_start_time": began}),
        made("A", "Kraft µ", T[::2].astype("i2"), {
            "wf_increment": 0.04, "wf_start_offset": 0.01, "unit_string": "N",
            "wf_start_time": began + np.timedelta64(250, "ms")}),
        made("B", "Time", T / 2), made("B", "y", np.where(T > 0.5, np.nan, T)),
        made("C", "Zeit", began + (1e6 * T).astype("m8[us]")), made("C", "z", -T),
        made("D", "alone", T), made("D", "words", ["a", "b"])])
    rec = Recording.read(tmp_path / "run.tdms")
    assert set(rec.names) == {"first", "Kraft µ", "y", "z"} and rec.began == benches.START
    np.testing.assert_allclose(rec["first"].time, T, atol=1e-12)
    np.testing.assert_allclose(rec["Kraft µ"].time, 0.26 + T[::2], atol=1e-9)
    assert rec["Kraft µ"].unit == "N"
    np.testing.assert_allclose(rec["y"].time, T / 2)
    np.testing.assert_array_equal(np.isnan(rec["y"].values), T > 0.5)
    np.testing.assert_allclose(rec["z"].time, T, atol=1e-9)
    with pytest.raises(errors.BadRecording, match="holds text or bytes, not numbers"):
        rec["words"]
    with pytest.raises(errors.BadRecording, match="has no time column among"):
        Recording.read(tmp_path / "run.tdms", {"x": "D/alone"})
    assert Recording.read(tmp_path / "run.tdms", {"x": "D/alone"}, rate=8.0)["x"].interval == 0.125
