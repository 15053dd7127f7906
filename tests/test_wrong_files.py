"""Wrong files and places as a user meets them: one sentence and exit code 2, before any work."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import pikanid as pk
from pikanid.cli import EXIT_INTERRUPTED, main

RUN = "t,u_x,theta\n0,0,0\n1,1,1\n2,0,3\n"


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder.csv").mkdir()
    (tmp_path / "empty.csv").write_text("")
    (tmp_path / "blank.csv").write_text("\n\n")
    (tmp_path / "one.csv").write_text("t,u_x,theta\n0,1,1\n")
    (tmp_path / "binary.csv").write_bytes(b"t,theta\n\0\1\2")
    (tmp_path / "run.csv").write_text(RUN)
    (tmp_path / "closed.csv").write_text(RUN)
    (tmp_path / "closed.csv").chmod(0)
    return tmp_path


@pytest.mark.parametrize(("words", "told"), [
    (["folder"], "folder"), (["folder.csv"], "folder"), (["empty.csv"], "empty"),
    (["blank.csv"], "blank.csv"), (["one.csv"], "at least 2"), (["binary.csv"], "binary.csv"),
    (["absent.csv"], "no file"), (["absent/run.csv"], "no file"),
    (["run.csv", "--json", "absent/x.json"], "no folder"),
    (["run.csv", "--plot", "folder"], "must end"), (["run.csv", "--save", "x.pkl"], "must end"),
    (["run.csv", "--model", "folder"], "cannot be read"),
    (["run.csv", "--model", "run.csv"], "cannot be read"),
    (["run.csv", "--set", "l_theta=5Vlt"], "volt"),
    (["run.csv", "--unit", "theta=degre"], "degree"),
    pytest.param(["closed.csv"], "cannot be opened", marks=pytest.mark.skipif(
        not hasattr(os, "geteuid") or os.geteuid() == 0, reason="may read everything")),
])
def test_a_wrong_file_is_one_sentence(words: list[str], told: str, place: Path,
                                      capsys: pytest.CaptureFixture[str]) -> None:
    before = sorted(p.name for p in place.rglob("*"))
    model = [] if "--model" in words else ["--model", "sloshing"]
    assert main(["identify", *words, *model]) == 2
    found = capsys.readouterr()
    assert found.out == "" and found.err.startswith("Error: ") and found.err.count("\n") == 1
    assert told in found.err
    assert sorted(p.name for p in place.rglob("*")) == before


@pytest.mark.slow
def test_an_interrupt_ends_a_fit_with_one_word(tmp_path: Path) -> None:
    pk.simulate(pk.systems.sloshing(), pk.excitation.two_pulse(), sigma=0.002, seed=0).write(
        tmp_path / "run.csv")
    child = subprocess.Popen(
        [sys.executable, "-m", "pikanid", "identify", str(tmp_path / "run.csv"), "-m", "sloshing",
         "--strategy", "pinn", "--json", str(tmp_path / "out.json")],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL))
    time.sleep(10)
    child.send_signal(signal.SIGINT)
    out, err = child.communicate(timeout=60)
    assert child.returncode in (EXIT_INTERRUPTED, -signal.SIGINT)
    assert (out, err) == ("", "Interrupted.\n")
    assert [p.name for p in tmp_path.iterdir()] == ["run.csv"]
