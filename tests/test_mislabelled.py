"""Hints at exchanged columns and at a wrong unit of time: given where they help, and only there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from ready_made import EXPERIMENTS

import pikanid as pk
from pikanid.mismatch.case import Case
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.mismatch.steps import mislabelled as module
from pikanid.mismatch.steps.mislabelled import mislabelled, sampled_otherwise
from pikanid.mismatch.steps.opening import open_case
from pikanid.model import systems


def opened(model: pk.Model, *recordings: pk.Recording) -> Case:
    train, later = recordings
    return open_case(model, (train,), (later,), None, lambda text: None, DEFAULTS)


def moved(model: pk.Model, seed: int) -> pk.Recording:
    return pk.simulate(model, pk.excitation.planar_moves(6, 10.0, seed=seed), sigma=0.002,
                       seed=seed)


def exchanged(recording: pk.Recording) -> pk.Recording:
    return recording.with_channels(replace(recording["theta"], name="phi"),
                                   replace(recording["phi"], name="theta"))


def stretched(recording: pk.Recording, factor: float) -> pk.Recording:
    return recording.with_channels(*(
        replace(ch, time=ch.time * factor) for ch in recording.channels.values()))


def test_exchanged_columns_are_told() -> None:
    model = systems.sloshing_2d()
    case = opened(model, *(exchanged(moved(model, seed)) for seed in (1, 2)))
    (said,) = mislabelled(case)
    assert "'theta' and 'phi' exchanged" in said and "check which is which" in said


def test_exchanged_inputs_are_told() -> None:
    """Of a crane the length of the rope and the acceleration of the trolley."""
    model = pk.Model.from_dict({
        "name": "crane", "states": {"theta": {}, "w": {}}, "inputs": {"a": {}, "L": {}},
        "parameters": {"c": {"guess": 0.1, "bounds": [0.0, 2.0]}},
        "equations": {"theta": "w", "w": "-(9.81*sin(theta) + a*cos(theta))/L - c*w"},
        "outputs": {"theta": {"expression": "theta"}}})
    t = np.arange(400) * 0.05

    def recorded(seed: int) -> pk.Recording:
        moves = np.repeat(np.random.default_rng(seed).choice([-0.5, 0.5], 20), 20)
        drive = pk.Recording.from_arrays(t, {"a": moves, "L": 3.0 + np.sin(0.3 * t + seed)})
        made = pk.simulate(model, drive, sigma=0.002, seed=seed)
        return made.with_channels(replace(made["a"], name="L"), replace(made["L"], name="a"))

    (said,) = mislabelled(opened(model, recorded(1), recorded(2)))
    assert "'a' and 'L' exchanged" in said


def test_times_that_are_too_short_are_told() -> None:
    model = systems.sloshing()
    case = opened(model, *(stretched(moved(model, seed), 1e-3) for seed in (1, 2)))
    (said,) = mislabelled(case)
    assert "all times multiplied by 1000" in said and "check the unit of the time" in said


@pytest.mark.slow
def test_a_diagnosis_tells_it() -> None:
    model = systems.sloshing()
    found = pk.diagnose(model, *(stretched(moved(model, seed), 1e-3) for seed in (1, 2)))
    assert found.verdict == "unnamed" and "check the unit of the time" in str(found)


def test_times_that_are_too_long_are_told() -> None:
    """A filter of 0.5 s, sampled every 50 ms, as a logger writes it without a unit: 0, 50, 100."""
    model = pk.Model.from_dict({
        "name": "filter", "states": {"x": {}}, "inputs": {"u": {"hold": "zero"}},
        "parameters": {"T": {"guess": 0.4, "bounds": [0.01, 10.0]}},
        "equations": {"x": "(u - x)/T"}, "outputs": {"x": {"expression": "x"}}})
    t = np.arange(400) * 0.05

    def recorded(seed: int) -> pk.Recording:
        u = np.repeat(np.random.default_rng(seed).choice([-1.0, 1.0], 100), 4)
        drive = pk.Recording.from_arrays(t, {"u": u}, hold={"u": "zero"})
        return stretched(pk.simulate(model.with_values(T=0.5), drive, sigma=0.01, seed=seed), 1e3)

    (said,) = mislabelled(opened(model, recorded(1), recorded(2)))
    assert "all times divided by 1000" in said


def test_an_input_that_the_held_out_recording_samples_more_coarsely_is_told() -> None:
    model = systems.dc_motor()
    u = np.repeat(np.random.default_rng(2).uniform(-6.0, 6.0, 60), 10)
    drive = pk.Recording.from_arrays(np.arange(600) * 0.005, {"u": u}, {"u": "V"})
    one, other = (pk.simulate(model, drive, sigma=2.0, seed=seed) for seed in (1, 2))
    assert sampled_otherwise(opened(model, one, other)) == []
    coarse = other["u"]
    coarse = replace(coarse, time=coarse.time[::4], values=coarse.values[::4])
    (said,) = sampled_otherwise(opened(model, one, other.with_channels(coarse)))
    assert "'u' every 0.02 s" in said and "every 0.005 s" in said


@pytest.mark.parametrize("name", [*EXPERIMENTS])
def test_right_recordings_get_no_hint(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    tried = EXPERIMENTS[name]
    case = opened(tried.guess(name), tried.recording(name, 1), tried.recording(name, 2))
    assert mislabelled(case) == []
    monkeypatch.setattr(module, "POOR", 0.0)  # as if the model explained nothing
    assert mislabelled(case) == []


def test_a_wrong_model_gets_no_hint() -> None:
    """Nothing fits: neither do exchanged columns."""
    model = systems.sloshing_2d()
    rng = np.random.default_rng(5)

    def noise(seed: int) -> pk.Recording:
        clean = moved(model, seed)
        return clean.with_channels(*(
            replace(clean[o], values=np.cumsum(rng.normal(size=len(clean[o].values))) * 0.01)
            for o in model.output_names))

    assert mislabelled(opened(model, noise(1), noise(2))) == []
