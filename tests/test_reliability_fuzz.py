"""The fuzz itself: its sound inputs are read, damaged ones pass, and a failure would be seen."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
import reliability_fuzz as fuzzing
import reliability_inputs as inputs

from pikanid import Model, Recording
from pikanid.estimate import Estimate
from pikanid.validation.concealed.score import judge

QUICK = [name for name in fuzzing.targets() if name not in ("network", "command line")]


def test_what_is_damaged_was_sound(tmp_path: Path) -> None:
    for ending in inputs.RECORDINGS:
        if ending != ".xls":  # nothing here writes old workbooks
            path = tmp_path / f"run{ending}"
            path.write_bytes(inputs.sound_recording(ending))
            assert len(Recording.read(path).names) >= 2, ending
    assert Model.from_dict(tomllib.loads(inputs.MODEL)).name == "pendulum"
    (tmp_path / "fit.json").write_text(json.dumps(inputs.estimate_content()))
    assert str(Estimate.load(tmp_path / "fit.json"))
    assert judge(inputs.CASE, inputs.ANSWER).outcome == "right"


@pytest.mark.kan
def test_the_network_that_is_damaged_was_sound(tmp_path: Path) -> None:
    from pikanid.approximators.kan import load

    (tmp_path / "net.json").write_text(json.dumps(inputs.network_content()))
    assert load(tmp_path / "net.json") is not None


@pytest.mark.parametrize("name", QUICK)
def test_damaged_inputs_are_read_or_refused(name: str, tmp_path: Path) -> None:
    for number in range(20):
        assert fuzzing.one(name, 11, number, tmp_path) in ("read", "refused"), number


def test_a_failure_is_seen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(rng: np.random.Generator, folder: Path) -> None:
        raise ZeroDivisionError("here")

    def endless(rng: np.random.Generator, folder: Path) -> None:
        while True:
            pass

    monkeypatch.setattr(fuzzing, "SECONDS", 0.05)
    monkeypatch.setattr(fuzzing, "targets", lambda: {"broken": broken, "endless": endless})
    assert fuzzing.one("broken", 0, 0, tmp_path) == "ZeroDivisionError: here"
    assert fuzzing.one("endless", 0, 0, tmp_path) == "more than 0.05 s"


@pytest.mark.slow
def test_every_target_in_processes_of_its_own(monkeypatch: pytest.MonkeyPatch,
                                              tmp_path: Path) -> None:
    monkeypatch.setattr(fuzzing, "KEPT", tmp_path)
    found = fuzzing.fuzz(n=280, seed=5, workers=1)
    assert [f for tally in found.targets.values() for f in tally.failures] == []
    assert sum(tally.inputs for tally in found.targets.values()) == 280
    assert found.memory < 2**30
    assert "| model | 20 |" in found.markdown()
