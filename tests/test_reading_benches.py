"""Files of test benches: what every reader of a bench's format does alike."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from pathlib import Path

import benches
import numpy as np
import pytest

from pikanid import errors
from pikanid.recording import Recording
from pikanid.recording.reading import foreign

# ending -> what it needs, the extra that brings it, and who makes a file of the rig
MAKERS: dict[str, tuple[str, str, Callable[[Path], None]]] = {
    ".mf4": ("asammdf", "mdf", benches.rig_mdf),
    ".tdms": ("nptdms", "tdms", benches.rig_tdms),
    ".h5": ("h5py", "hdf5", benches.rig_hdf5),
    ".bag": ("rosbags", "ros", lambda path: benches.ros1(path, benches.rig_topics(1))),
    "": ("rosbags", "ros", lambda path: benches.ros2(path, benches.rig_topics(2), "sqlite3")),
}


@pytest.fixture(scope="module", params=MAKERS)
def rig(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The rig's file in each format."""
    library, extra, make = MAKERS[request.param]
    pytest.importorskip(library, reason=f"needs the `{extra}` extra")
    path = tmp_path_factory.mktemp("bench") / f"rig{request.param}"
    make(path)
    return path


def test_each_signal_is_on_its_own_clock(rig: Path) -> None:
    ros = rig.suffix in ("", ".bag")
    theta = {"theta": "/joints.position.theta"} if ros else None
    rec = Recording.read(rig, theta, also=["theta", "u_x"])
    assert set(rec.names) == {"theta", "u_x"} and rec.name == "rig"
    np.testing.assert_allclose(rec["theta"].time, benches.FAST, atol=1e-9)
    np.testing.assert_allclose(rec["u_x"].time, benches.SLOW, atol=1e-9)
    expected = np.deg2rad(benches.THETA) if ros else benches.THETA
    np.testing.assert_array_equal(rec["theta"].values, expected)
    np.testing.assert_array_equal(rec["u_x"].values, benches.U)
    assert rec["theta"].unit == ("" if ros else "deg")
    assert rec.began == (None if rig.suffix == ".h5" else benches.START)


def test_signals_are_found_by_pattern(rig: Path) -> None:
    assert Recording.read(rig, {"y": "*theta"}).names == ("y",)
    with pytest.raises(errors.BadRecording, match=r"fits several channels: .*; give one of"):
        Recording.read(rig, {"y": "*[/a]*"})
    if rig.suffix in (".mf4", ".h5"):
        assert Recording.read(rig, {"y": "encoder"}).names == ("y",)  # the only one of its group
    with pytest.raises(errors.BadRecording, match="has no column 'phi'; it has: "):
        Recording.read(rig, {"y": "phi"})


def test_without_the_extra_it_says_what_to_install(
        rig: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    library, extra, _ = MAKERS[rig.suffix]
    real = importlib.util.find_spec
    monkeypatch.setattr(foreign, "find_spec", lambda name: None if name == library else real(name))
    with pytest.raises(errors.BadSetting, match=rf"needs '{library}'.*'pikanid\[{extra}\]'\.$"):
        Recording.read(rig)


def test_another_ending_is_told(rig: Path, tmp_path: Path) -> None:
    if rig.is_dir():
        rig = next(rig.glob("*.db3"))
    for ending in {".csv", ".mf4", ".tdms", ".xlsx"} - {rig.suffix}:
        wrong = tmp_path / f"run{ending}"
        wrong.write_bytes(rig.read_bytes())
        with pytest.raises(errors.BadRecording, match=r"as its name says: rename it\.$"):
            Recording.read(wrong)


@pytest.mark.parametrize("ending", [".mf4", ".tdms", ".h5", ".bag", ".db3", ".mcap"])
def test_nothing_and_rubbish_are_refused(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"run{ending}"
    path.write_bytes(b"")
    with pytest.raises(errors.BadRecording, match="is empty"):
        Recording.read(path)
    path.write_bytes(b"t,y\n0,1\n")
    with pytest.raises(errors.BadRecording, match="damaged or cut off"):
        Recording.read(path)


def attempt(path: Path) -> str:
    """What reading says; anything but success or one sentence fails the test."""
    try:
        return repr(Recording.read(path))
    except errors.PikanidError as problem:
        text = str(problem)
        assert problem.exit_code == 2 and text.isprintable() and 10 < len(text) < 3000
        return text


@pytest.mark.parametrize("number", [4, pytest.param(60, marks=pytest.mark.slow)])
def test_damaged_files_are_read_or_refused_in_a_sentence(
        rig: Path, tmp_path: Path, number: int) -> None:
    whole = rig if rig.is_file() else next(rig.glob("*.db3"))
    path = tmp_path / f"run{whole.suffix}"
    for content in benches.cut_and_changed(whole.read_bytes(), number, seed=number):
        path.write_bytes(content)
        attempt(path)
    path.write_bytes(whole.read_bytes()[:whole.stat().st_size // 3])
    # what a TDMS file holds up to there can be read
    assert ("is cut off: its last samples are missing" if whole.suffix == ".tdms" else
            "is damaged or cut off") in attempt(path)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


def test_a_folder_without_a_bag_is_a_folder(tmp_path: Path) -> None:
    with pytest.raises(errors.BadRecording, match="is a folder; give one of the files"):
        Recording.read(tmp_path)


def test_a_bag_with_a_pipe_in_it_does_not_wait(tmp_path: Path) -> None:
    import os

    os.mkfifo(tmp_path / "part.db3")
    with pytest.raises(errors.BadRecording, match="it is no regular file"):
        Recording.read(tmp_path)
