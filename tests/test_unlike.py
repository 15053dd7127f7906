"""Questions about units that are put before anything is fitted, and only where there is cause."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from ready_made import EXPERIMENTS

import pikanid as pk
from conftest import Run
from pikanid.mismatch.steps.unlike import unlike
from pikanid.model import systems

MODEL = systems.sloshing()


def moved(seed: int) -> pk.Recording:
    return pk.simulate(MODEL, pk.excitation.planar_moves(6, 10.0, seed=seed), sigma=0.002,
                       seed=seed)


def scaled(recording: pk.Recording, name: str, factor: float) -> pk.Recording:
    channel = recording[name]
    return recording.with_channels(replace(channel, values=channel.values * factor))


def stretched(recording: pk.Recording, factor: float) -> pk.Recording:
    return recording.with_channels(*(
        replace(ch, time=ch.time * factor) for ch in recording.channels.values()))


@pytest.mark.parametrize("factor", [57.3, 1 / 57.3])
def test_one_recording_in_degrees_is_asked_about(factor: float) -> None:
    (said,) = unlike(MODEL, [moved(1)], [scaled(moved(2), "theta", factor)])
    assert "'theta' is " in said and said.endswith("is it in rad in both?")
    assert 30 < float(said.split(" is ")[1].split(" times")[0]) < 120


def test_one_recording_in_milliseconds_is_asked_about() -> None:
    (said,) = unlike(MODEL, [moved(1)], [stretched(moved(2), 1e3)])
    assert "are the times of both in s?" in said


def test_both_recordings_in_milliseconds_are_asked_about() -> None:
    (said,) = unlike(MODEL, *([stretched(moved(seed), 1e3)] for seed in (1, 2)))
    assert "the model's slowest motion lasts 0.4" in said


@pytest.mark.parametrize("name", ["theta", "u_x"])
def test_one_that_rests_is_not_asked_about(name: str) -> None:
    assert unlike(MODEL, [moved(1)], [scaled(moved(2), name, 0.0)]) == []
    assert unlike(MODEL, [moved(1)], []) == []


@pytest.mark.parametrize("name", [*EXPERIMENTS])
def test_right_recordings_are_not_asked_about(name: str) -> None:
    tried = EXPERIMENTS[name]
    assert unlike(tried.guess(name), [tried.recording(name, 1)], [tried.recording(name, 2)]) == []


def test_it_is_told_before_anything_is_fitted(tmp_path: Path, run: Run) -> None:
    train, held_out = tmp_path / "a.csv", tmp_path / "b.csv"
    # too short: refused before it is fitted
    moved(1).window(0.0, 0.05).write(train)
    scaled(moved(2), "theta", 57.3).write(held_out)
    code, _, err = run("diagnose", str(train), "--held-out", str(held_out), "-m", "sloshing")
    assert code == 2
    assert err.index("is it in rad in both?") < err.index("Error")
