"""Whole sets: sealed, resumable, the same bytes again, no hint in what surrounds the numbers."""

from __future__ import annotations

import hashlib
import json
import os
import signal
import stat
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pikanid import errors
from pikanid.cli import main
from pikanid.recording import Recording
from pikanid.validation.concealed import case, seal
from pikanid.validation.concealed import generate as of_set
from pikanid.validation.concealed import making as room
from pikanid.validation.concealed.deck import DEFAULT_MIX
from pikanid.validation.concealed.effects import IDS
from pikanid.validation.concealed.files import HEADER
from pikanid.validation.concealed.generate import generate
from pikanid.validation.concealed.seal import Settings
from pikanid.validation.concealed.visibility import Visibility

SMALL = Settings(4, "two_pulse", 0.1 * np.pi / 180, dict(DEFAULT_MIX))
CLEAN = Settings(3, "two_pulse", 1e-3, {"nothing": 1.0})
LONGER = Settings(6, "two_pulse", 1e-3, {"nothing": 1.0})


UMASK = os.umask(0o022)
os.umask(UMASK)


def mode(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


def content(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Path, Path]]:
    place = tmp_path_factory.mktemp("set")
    generate(place / "given", place / "truth.json", SMALL, seed=11, workers=1)
    yield place / "given", place / "truth.json"


def test_what_is_written(made: tuple[Path, Path]) -> None:
    folder, file = made
    truth = json.loads(file.read_text())
    assert truth["open"]
    assert not truth["sealed"]
    assert len(truth["cases"]) == 4
    wanted = {"seal.json"} | {n for entry in truth["cases"] for n in entry["files"].values()}
    assert set(content(folder)) == wanted
    assert not (file.parent / "truth.json.unfinished").exists()
    for entry in truth["cases"]:
        assert entry["visibility"]["nominal"] >= entry["visibility"]["best_rival_distance"] >= 0
        for effect in entry["effects"]:
            assert effect["kind"] != "catalogue" or effect["id"] in IDS
            assert all(set(p) == {"value", "unit"} for p in effect["parameters"].values())
        if entry["nameable"]:
            assert entry["visibility"]["nominal"] >= 5
            assert entry["visibility"]["best_rival_distance"] >= 4


def test_recordings_are_read_by_the_front_door(made: tuple[Path, Path]) -> None:
    rec = Recording.read(made[0] / "001_train.csv")
    assert rec.names == ("u_x", "u_y", "pitch", "theta")
    assert rec["theta"].unit == "rad"
    assert len(rec.t) == 501


def test_truth_matches_its_seal_and_nothing_else_does(made: tuple[Path, Path],
                                                      tmp_path: Path) -> None:
    folder, file = made
    sealed = json.loads((folder / "seal.json").read_text())
    assert sealed["sha256"] == hashlib.sha256(file.read_bytes()).hexdigest()
    assert set(sealed) == {"schema_version", "generator", "sealed", "sha256", "of"}
    assert seal.matches(folder, file)
    changed = tmp_path / "truth.json"
    changed.write_text(file.read_text().replace('"nameable": false', '"nameable": true', 1))
    assert not seal.matches(folder, changed)


def test_altered_recording_is_noticed(tmp_path: Path) -> None:
    generate(tmp_path / "d", tmp_path / "t.json", CLEAN, seed=1, workers=1)
    assert seal.matches(tmp_path / "d", tmp_path / "t.json")
    with (tmp_path / "d" / "002_train.csv").open("a") as file:
        file.write(" ")
    assert not seal.matches(tmp_path / "d", tmp_path / "t.json")


@pytest.mark.parametrize("settings", [
    CLEAN, pytest.param(replace(SMALL, cases=12), marks=pytest.mark.slow)], ids=["clean", "mixed"])
def test_same_seed_same_bytes_whatever_the_workers(settings: Settings, tmp_path: Path) -> None:
    for name, workers in (("a", 1), ("b", 2)):
        generate(tmp_path / name, tmp_path / f"{name}.json", settings, seed=11, workers=workers)
    assert content(tmp_path / "a") == content(tmp_path / "b")
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()


def test_sealed_sets_differ_and_keep_their_seed_in_the_truth(tmp_path: Path) -> None:
    for name in ("a", "b"):
        generate(tmp_path / name, tmp_path / f"{name}.json", CLEAN, workers=1)
    truths = [json.loads((tmp_path / f"{name}.json").read_text()) for name in ("a", "b")]
    assert all(truth["sealed"] and not truth["open"] for truth in truths)
    assert truths[0]["seed"] != truths[1]["seed"]
    assert truths[0]["nonce"] != truths[1]["nonce"]
    given = b"".join(content(tmp_path / "a").values()).decode()
    assert truths[0]["seed"] not in given
    assert truths[0]["nonce"] not in given
    assert content(tmp_path / "a")["001_train.csv"] != content(tmp_path / "b")["001_train.csv"]


def test_interrupted_run_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    generate(tmp_path / "whole", tmp_path / "whole.json", LONGER, seed=11, workers=1)
    make, done = case.make, []

    def stopped(order: case.Order) -> object:
        if len(done) == 3:
            raise KeyboardInterrupt
        done.append(order.name)
        return make(order)

    monkeypatch.setattr(of_set, "make", stopped)
    with pytest.raises(KeyboardInterrupt):
        generate(tmp_path / "d", tmp_path / "t.json", LONGER, seed=11, workers=1)
    assert not (tmp_path / "t.json").exists()
    assert content(tmp_path / "d") == {}  # nothing half-made is given away
    monkeypatch.setattr(of_set, "make", make)
    # What a killed run may leave behind: a recording without its entry, a half-written file.
    progress = tmp_path / "t.json.unfinished"
    (progress / "006_train.csv").write_text("half")
    leftovers = [tmp_path / "d" / ".001_train.csv.0a.part", tmp_path / "d" / ".seal.json.0a.part",
                 tmp_path / ".t.json.0a.part"]
    for path in leftovers:
        path.write_text("half")
    again = generate(tmp_path / "d", tmp_path / "t.json", LONGER, seed=11, workers=1)
    assert (again.kept, again.made) == (3, 3)
    assert content(tmp_path / "d") == content(tmp_path / "whole")
    assert (tmp_path / "t.json").read_bytes() == (tmp_path / "whole.json").read_bytes()
    assert not any(path.exists() for path in [progress, *leftovers])


def test_the_secret_of_an_unfinished_set_is_the_users_alone(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def killed(*_: object) -> None:
        raise KeyboardInterrupt

    places = tmp_path / "d", tmp_path / "t.json"
    for last in ("_hand_over", "_remove"):
        with monkeypatch.context() as patch:
            patch.setattr(room, last, killed)
            with pytest.raises(KeyboardInterrupt):
                generate(*places, CLEAN, workers=1)
        progress = tmp_path / "t.json.unfinished"
        assert mode(progress) == 0o700
        assert {mode(path) for path in progress.iterdir()} == {0o600}
    seed = json.loads((progress / "set.json").read_bytes())["seed"]
    assert not any(seed.encode() in path.read_bytes() for path in places[0].iterdir())
    again = generate(*places, CLEAN, workers=1)
    assert (again.kept, again.made) == (3, 0)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["d", "t.json"]
    assert mode(places[1]) == 0o600  # sealed
    assert {mode(path) for path in places[0].iterdir()} == {0o666 & ~UMASK}


def test_a_planted_place_for_the_secret_is_not_used(tmp_path: Path) -> None:
    (tmp_path / "theirs").mkdir()
    (tmp_path / "t.json.unfinished").symlink_to(tmp_path / "theirs")
    with pytest.raises(errors.BadSetting, match="something else"):
        generate(tmp_path / "d", tmp_path / "t.json", CLEAN, workers=1)
    assert list((tmp_path / "theirs").iterdir()) == []


def test_damaged_case_of_an_unfinished_set_is_made_again(tmp_path: Path,
                                                         monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(room, "_hand_over", lambda *a: (_ for _ in ()).throw(KeyboardInterrupt))
    with pytest.raises(KeyboardInterrupt):
        generate(tmp_path / "d", tmp_path / "t.json", CLEAN, seed=3, workers=1)
    monkeypatch.undo()
    (tmp_path / "t.json.unfinished" / "002_train.csv").write_text("damaged")
    again = generate(tmp_path / "d", tmp_path / "t.json", CLEAN, seed=3, workers=1)
    assert (again.kept, again.made) == (2, 1)
    assert seal.matches(tmp_path / "d", tmp_path / "t.json")


def test_finished_set_is_left_alone(made: tuple[Path, Path]) -> None:
    before = content(made[0])
    again = generate(*made, SMALL, seed=11)
    assert (again.made, again.kept) == (0, 4)
    assert content(made[0]) == before
    with pytest.raises(errors.BadSetting, match="something else"):
        generate(*made, SMALL, seed=12)
    with pytest.raises(errors.BadSetting, match="something else"):
        generate(*made, SMALL)


def test_places_that_cannot_be(tmp_path: Path) -> None:
    with pytest.raises(errors.BadSetting, match="outside"):
        generate(tmp_path / "d", tmp_path / "d" / "truth.json", CLEAN)
    with pytest.raises(errors.BadSetting, match="outside"):
        generate(tmp_path / "d", tmp_path / "d" / "deep" / "truth.json", CLEAN)
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "mine.txt").write_text("mine")
    with pytest.raises(errors.BadSetting, match="something else"):
        generate(tmp_path / "full", tmp_path / "t.json", CLEAN)
    (tmp_path / "file").write_text("")
    with pytest.raises(errors.BadSetting, match="something else"):
        generate(tmp_path / "file", tmp_path / "t.json", CLEAN)
    (tmp_path / "other.json").write_text("{}")
    with pytest.raises(errors.BadSetting, match="truth file"):
        generate(tmp_path / "d", tmp_path / "other.json", CLEAN)


def test_unfinished_set_of_other_settings_is_not_mixed(tmp_path: Path,
                                                       monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(room, "_hand_over", lambda *a: (_ for _ in ()).throw(KeyboardInterrupt))
    with pytest.raises(KeyboardInterrupt):
        generate(tmp_path / "d", tmp_path / "t.json", CLEAN, seed=3, workers=1)
    for settings, seed in ((SMALL, 3), (CLEAN, 4), (CLEAN, None)):
        with pytest.raises(errors.BadSetting, match="other settings"):
            generate(tmp_path / "d", tmp_path / "t.json", settings, seed=seed, workers=1)


@pytest.mark.parametrize(("options", "part"), [
    (["--cases", "0"], "--cases"), (["--excitation", "drum"], "drum"), (["--mix", "all=1"], "mix"),
    (["--sigma", "-1deg"], "--sigma"), (["--sigma", "1 m"], "'m'"),
    (["--inputs", "a.csv"], "--inputs is of a model of your own"),
    (["--noise", "0.01"], "--noise is of a model of your own"),
    (["--model", "dc_motor", "--excitation", "mixed"], "--excitation is of the sloshing rig"),
    (["--model", "dc_motor", "--sigma", "1deg"], "--sigma is of the sloshing rig")])
def test_command_line_refuses(options: list[str], part: str, tmp_path: Path,
                              capsys: pytest.CaptureFixture[str]) -> None:
    words = ["conceal", "--out", str(tmp_path / "d"), "--truth", str(tmp_path / "t.json")]
    assert main([*words, *options]) == 2
    assert part in capsys.readouterr().err
    assert not (tmp_path / "d").exists()


def test_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["conceal", "--out", str(tmp_path / "d"), "--truth", str(tmp_path / "t.json"),
             "--cases", "2", "--excitation", "two_pulse", "--mix", "nothing=1", "--seed", "5",
             "--workers", "1", "--sigma", "0.2deg"]
    assert main(words) == 0
    assert "2 cases; open truth" in capsys.readouterr().out
    assert main(words) == 0
    assert "were there already" in capsys.readouterr().out
    truth = json.loads((tmp_path / "t.json").read_text())
    assert truth["settings"]["sigma"] == pytest.approx(np.radians(0.2))


@pytest.mark.slow
def test_killed_process_leaves_no_half_files(tmp_path: Path) -> None:
    words = [sys.executable, "-m", "pikanid", "conceal", "--out", str(tmp_path / "d"), "--truth",
             str(tmp_path / "t.json"), "--cases", "12", "--excitation", "two_pulse", "--seed", "2"]
    running = subprocess.Popen(words, start_new_session=True)
    progress = tmp_path / "t.json.unfinished"
    for _ in range(600):
        time.sleep(0.2)
        if len(list(progress.glob("0*.json"))) >= 2 or running.poll() is not None:
            break
    os.killpg(running.pid, signal.SIGKILL)
    running.wait()
    assert list((tmp_path / "d").iterdir()) == []
    assert subprocess.run(words, check=False).returncode == 0
    assert seal.matches(tmp_path / "d", tmp_path / "t.json")
    whole = tmp_path / "again"
    words = [w.replace(str(tmp_path / "d"), str(whole)).replace("t.json", "u.json") for w in words]
    assert subprocess.run(words, check=False).returncode == 0
    assert content(whole) == content(tmp_path / "d")


# --- no hints ----------------------------------------------------------------------------------


def features(folder: Path, entry: dict) -> list[float]:
    """All that can be seen of a case without looking at the numbers, or at how many are missing."""
    row = []
    for k, name in enumerate(sorted(entry["files"].values())):
        path = folder / name
        text = path.read_text()
        lines = text.splitlines()
        status = path.stat()
        gone = sum(line.endswith(",") for line in lines)
        digits = {tuple(len(cell) for cell in line.split(",")[:4]) for line in lines[1:]}
        last = {len(line.split(",")[4]) for line in lines[1:]} - {0}
        row += [len(lines), status.st_size + 11 * gone, status.st_mtime_ns, len(digits), len(last),
                lines[0] == HEADER, len(name), int(name[:3]) + 0.1 * k, status.st_mode]
    return row


def accuracy(x: np.ndarray, labels: np.ndarray, neighbours: int = 7) -> float:
    """Leave-one-out accuracy of nearest neighbours, balanced over the classes."""
    spread = np.ptp(x, axis=0)
    x = (x - x.min(axis=0)) / np.where(spread > 0, spread, 1.0)
    distance = np.linalg.norm(x[:, None] - x[None], axis=2) + np.diag(np.full(len(x), np.inf))
    nearest = np.argsort(distance, axis=1, kind="stable")[:, :neighbours]
    kinds = np.unique(labels)
    share = np.array([np.mean(labels == kind) for kind in kinds])
    votes = np.stack([np.mean(labels[nearest] == kind, axis=1) for kind in kinds], axis=1) / share
    guess = kinds[np.argmax(votes, axis=1)]
    return float(np.mean([np.mean(guess[labels == kind] == kind) for kind in kinds]))


def chance(x: np.ndarray, labels: np.ndarray) -> tuple[float, float]:
    """Accuracy, and the share of shuffled labels that reach it."""
    rng = np.random.default_rng(0)
    reached = accuracy(x, labels)
    shuffled = [accuracy(x, rng.permutation(labels)) for _ in range(200)]
    return reached, float(np.mean([s >= reached for s in shuffled]))


def test_classifier_on_metadata_would_see_a_hint() -> None:
    rng = np.random.default_rng(1)
    labels = np.repeat(["nothing", "single"], 30)
    hint = np.where(labels == "single", 1.0, 0.0) + 0.3 * rng.normal(size=60)
    _, p = chance(np.stack([hint, rng.normal(size=60)], axis=1), labels)
    assert p < 0.01


@pytest.mark.parametrize(("excitation", "cases"), [
    ("two_pulse", 40), pytest.param("two_pulse", 200, marks=pytest.mark.slow),
    pytest.param("rich", 200, marks=pytest.mark.slow)])
def test_metadata_carry_no_hint(excitation: str, cases: int, tmp_path: Path,
                                monkeypatch: pytest.MonkeyPatch) -> None:
    # How visible an effect is does not enter its files: left out, to be quick.
    monkeypatch.setattr(case, "visibility", lambda *a: Visibility(0.0, (), 0.0, (), 0.05, 0.1))
    settings = Settings(cases, excitation, 1e-3, dict(DEFAULT_MIX))
    generate(tmp_path / "d", tmp_path / "t.json", settings, seed=4, workers=1)
    truth = json.loads((tmp_path / "t.json").read_text())
    x = np.array([features(tmp_path / "d", entry) for entry in truth["cases"]], dtype=float)
    constant = np.ptp(x, axis=0) == 0
    assert np.flatnonzero(~constant).tolist() == [7, 16]  # only the running number differs
    for kinds in (["nothing" if c["class"] == "nothing" else "hidden" for c in truth["cases"]],
                  [c["class"] for c in truth["cases"]]):
        reached, p = chance(x, np.array(kinds))
        assert p > 0.01, f"a balanced accuracy of {reached:.2f}"
