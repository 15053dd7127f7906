"""`pikanid channels`, and the options that every command takes which reads recordings."""

from __future__ import annotations

import json
import re
from pathlib import Path

import benches
import pytest
from commandline import Run

from pikanid.recording.formats import written_endings

OPTIONS = ["--column", "--unit", "--rate", "--sheet", "--from", "--to", "--own-times"]


@pytest.mark.parametrize("ending", written_endings())
def test_what_was_written_is_listed(run: Run, tmp_path: Path, ending: str) -> None:
    run("simulate", "--model", "sloshing", "--out", f"run{ending}")
    code, out, err = run("channels", f"run{ending}")
    assert (code, err) == (0, "")
    lines = [line.split() for line in out.splitlines()]
    assert ["theta", "rad", "501", "100", "0", "5"] in lines
    code, out, _ = run("channels", f"run{ending}", "--json", "-")
    (told,) = json.loads(out)["files"]
    assert told["channels"][0] == {
        "name": "u_x", "path": "", "unit": "m/s^2", "samples": 501, "start": 0.0, "stop": 5.0,
        "rate": pytest.approx(100.0), "uniform": True, "remark": ""}
    assert told["began"] is None and told["name"] == f"run{ending}"


def test_rates_and_paths_of_a_bench_file(run: Run, tmp_path: Path) -> None:
    pytest.importorskip("nptdms", reason="needs the `tdms` extra")
    benches.rig_tdms(tmp_path / "rig.tdms")
    code, out, _ = run("channels", "rig.tdms")
    assert code == 0 and "t = 0 at 2023-11-14T22:13:20.000+00:00" in out
    assert re.search(r"^theta +Rig/theta +deg +200 +100 +0 +1\.99$", out, re.MULTILINE)
    assert re.search(r"^u_x +Rig/u_x +m/s\^2 +40 +20 +0 +1\.95$", out, re.MULTILINE)


def test_what_cannot_be_used_is_listed_with_the_reason(run: Run, tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("y [widgets],gear,z\n1,on,2\n2,off,4\n")
    code, out, _ = run("channels", "a.csv")
    assert code == 0 and "is not a number" in out and out.count("no times: name their column") == 2
    code, out, _ = run("channels", "a.csv", "--rate", "10")
    assert code == 0 and "its unit 'widgets' is unknown: say what is meant" in out
    (tmp_path / "b.csv").write_text("t,y\n0,1\n1,2\n1,3\n3,4\n")
    code, out, _ = run("channels", "b.csv")
    assert code == 0 and "the time 1 s repeats 1 s" in out
    (tmp_path / "c.csv").write_text("t,y\n0,1\n1,2\n1.5,3\n")
    assert "uneven" in run("channels", "c.csv")[1]
    code, out, err = run("channels", "absent.csv")
    assert (code, out) == (2, "") and "There is no file 'absent.csv'" in err


def test_joined_files_are_listed_one_by_one(run: Run, tmp_path: Path) -> None:
    (tmp_path / "fast.csv").write_text("t,y [mm]\n0,1\n0.1,2\n0.2,3\n")
    (tmp_path / "slow.csv").write_text("t,u [V]\n0,1\n1,2\n")
    code, out, err = run("channels", "fast.csv+slow.csv", "--json", "-")
    assert (code, err) == (0, "")
    files = json.loads(out)["files"]
    assert [(one["name"], [c["name"] for c in one["channels"]]) for one in files] == [
        ("fast.csv", ["y"]), ("slow.csv", ["u"])]
    code, out, err = run("channels", "fast.csv+absent.csv")
    assert (code, out) == (2, "") and "There is no file 'absent.csv'" in err
    code, out, err = run("channels", "fast.csv+slow.csv", "--json", "slow.csv")
    assert code == 2 and "slow.csv" in err
    (tmp_path / "a+b.csv").write_text("t,z\n0,1\n1,2\n")
    assert "a+b.csv: CSV" in run("channels", "a+b.csv")[1]


@pytest.mark.parametrize("command", [
    "identify", "diagnose", "validate", "simulate", "confusable", "effects", "design"])
def test_every_command_reads_with_the_same_options(run: Run, command: str) -> None:
    told = run(command, "--help")[1]
    assert [o for o in OPTIONS if not re.search(rf"{o}\b", told)] == []


def test_a_window_of_a_diagnosis_is_checked(run: Run, recorded: str) -> None:
    code, _, err = run("diagnose", recorded, "--model", "sloshing", "--from", "3", "--to", "2")
    assert code == 2 and "3" in err and "2" in err


def test_an_excitation_is_mapped_and_cut(run: Run, tmp_path: Path) -> None:
    (tmp_path / "drive.csv").write_text("acc\n" + "".join(f"{k % 2}\n" for k in range(300)))
    words = ["--model", "sloshing", "--excitation", "drive.csv", "--column", "u_x=acc",
             "--unit", "u_x=m/s^2", "--rate", "50", "--from", "1", "--to", "3"]
    code, out, err = run("simulate", *words, "--out", "run.csv")
    assert (code, err) == (0, "") and "1 s to 3 s" in out
    code, out, err = run("confusable", *words, "--sigma", "0.1deg", "--quick")
    assert (code, err) == (0, "") and "cannot" in out
