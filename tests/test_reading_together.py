"""Several files as one recording: which file has what, on whose clock, and what is ambiguous."""

from __future__ import annotations

from pathlib import Path

import benches
import numpy as np
import pytest
from commandline import Run

import pikanid as pk
from pikanid import errors
from pikanid.commands.reading import Reading, sources
from pikanid.recording import Recording

SLOW = "t [s],u_x [m/s^2],temp\n" + "".join(f"{0.5 * k},{k % 3},20\n" for k in range(9))
FAST = "time [ms],angle [deg],temp\n" + "".join(f"{100 * k},{k},{21}\n" for k in range(40))


@pytest.fixture
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "drive.csv").write_text(SLOW)
    (tmp_path / "camera.csv").write_text(FAST)
    return ["drive.csv", "camera.csv"]


def test_each_file_keeps_its_times(files: list[str]) -> None:
    rec = Recording.read(files, {"theta": "angle"}, units={"u_x": "mm/s^2"})
    assert rec.names == ("u_x", "drive/temp", "theta", "camera/temp")
    assert rec.name == "drive+camera" and rec["u_x"].unit == "mm/s^2"
    np.testing.assert_allclose(rec["u_x"].time, 0.5 * np.arange(9))
    np.testing.assert_allclose(rec["theta"].time, 0.1 * np.arange(40))
    assert rec["theta"].unit == "deg" and rec.notes == ()


def test_what_several_files_have_is_named_by_its_file(files: list[str]) -> None:
    with pytest.raises(errors.BadRecording, match=r"'temp' fits several channels: "
                       r"drive/temp, camera/temp; give one of these"):
        Recording.read(files, {"T": "temp"})
    assert Recording.read(files, {"T": "camera/temp"})["T"].values[0] == 21
    assert Recording.read(files, {"T": "drive/t*p"})["T"].values[0] == 20
    with pytest.raises(errors.BadRecording, match=r"'the files together' has no column 'phi'; it "
                       r"has: t \[s\], u_x"):
        Recording.read(files, {"theta": "phi"})
    with pytest.raises(errors.BadRecording, match="has no column 'phi'"):
        Recording.read(files, units={"phi": "deg"})
    (Path("sub")).mkdir()
    (Path("sub") / "drive.csv").write_text(SLOW)
    with pytest.raises(errors.BadRecording, match=r"Two of the files .* are called 'drive'"):
        Recording.read(["drive.csv", "sub/drive.csv"])


def dated(path: str, start: str, step: float, name: str) -> None:
    stamps = np.datetime64(start, "ms") + (1e3 * step * np.arange(20)).astype("m8[ms]")
    rows = "".join(f"{stamp},{k}\n" for k, stamp in enumerate(stamps))
    Path(path).write_text(f"time,{name}\n{rows}")


def test_dates_put_files_on_one_clock(files: list[str]) -> None:
    dated("a.csv", "2026-01-15T10:00:00.250", 0.1, "theta")
    dated("b.csv", "2026-01-15T10:00:00", 0.2, "u_x")
    rec = Recording.read(["a.csv", "b.csv"])
    np.testing.assert_allclose(rec["theta"].time, 0.25 + 0.1 * np.arange(20), atol=1e-6)
    np.testing.assert_allclose(rec["u_x"].time, 0.2 * np.arange(20), atol=1e-6)
    assert rec.began == pytest.approx(1768471200.0)
    assert rec.notes == (
        "Recording 'a' begins 0.25 s after 'b' by the dates in their files.",)
    stands = Recording.read(["a.csv", "b.csv"], by_date=False)
    assert stands["theta"].time[0] == 0.0 and stands.notes == ()
    mixed = Recording.read(["a.csv", "camera.csv"])
    assert mixed["theta"].time[0] == 0.0
    assert "when camera began is not known" in mixed.notes[0]


def test_files_of_another_day_are_not_one_recording(files: list[str]) -> None:
    dated("a.csv", "2026-01-15T10:00:00", 0.1, "theta")
    dated("b.csv", "2026-01-16T10:00:00", 0.2, "u_x")
    with pytest.raises(errors.BadRecording, match=r"a, b were not recorded together: 86398\.1 s"):
        Recording.read(["a.csv", "b.csv"])
    assert Recording.read(["a.csv", "b.csv"], by_date=False).names == ("theta", "u_x")


def test_text_with_a_plus(files: list[str]) -> None:
    assert sources("drive.csv+camera.csv") == files
    Path("a+b.csv").write_text(SLOW)
    assert sources("a+b.csv") == ["a+b.csv"] and sources("+a.csv") == ["+a.csv"]


def test_a_bench_file_beside_a_table(files: list[str]) -> None:
    pytest.importorskip("h5py", reason="needs the `hdf5` extra")
    benches.rig_hdf5(Path("rig.h5"))
    Path("drive.csv").rename("motion.csv")
    model = pk.systems.sloshing()
    rec = Reading(column=["u_x=motion/u_x"]).recording("motion.csv+rig.h5", model)
    assert rec["u_x"].values[1] == 1.0 and len(rec["theta"]) == len(benches.THETA)
    rec = Reading(column=["u_x=rig/drive/*"]).recording("motion.csv+rig.h5", model)
    np.testing.assert_array_equal(rec["u_x"].values, benches.U)
    with pytest.raises(errors.BadRecording, match=r"has no column 'theta'; it has: .*u_x"):
        Reading().recording("motion.csv+camera.csv", model)["theta"]


def test_a_recording_in_two_files_is_identified_as_in_one(
        run: Run, recorded: str, tmp_path: Path) -> None:
    whole = Recording.read(tmp_path / recorded)
    whole.without("u_x").write(tmp_path / "y.csv")
    whole.without("theta").write(tmp_path / "u.csv")
    words = ["--model", "sloshing", "--sigma", "0.1deg", "--json", "-", "--quiet"]
    one, two = (run("identify", text, *words)[1] for text in (recorded, "u.csv+y.csv"))
    cut = two.replace('"u+y"', '"run"')
    assert '"u+y"' in two
    for a, b in zip(one.splitlines(), cut.splitlines(), strict=True):
        assert a == b or '"seconds"' in a
