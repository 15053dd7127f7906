"""A diagnosis begins at the starts that data show, not at guesses where nothing moves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import pikanid as pk
from pikanid.mismatch.data.records import Records
from pikanid.mismatch.judge.beginning import begun
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.noise.level import NoiseModel

LEVEL = NoiseModel(1.0, 0.0, 0.0, 0.01, "")


def prey() -> pk.Model:
    """Guessed at zero, where the populations stay."""
    model = pk.systems.lotka_volterra()
    return model.with_bounds(prey_0=(0.0, 1e6), predators_0=(0.0, 1e6)).with_values(
        prey_0=0.0, predators_0=0.0)


def counted(seed: int) -> pk.Recording:
    drive = pk.Recording.from_arrays(np.linspace(0.0, 6e8, 200), {"u": np.zeros(200)})
    truth = pk.systems.lotka_volterra().with_values(prey_0=40.0, predators_0=8.0)
    return pk.simulate(truth, drive, sigma={"prey": 1.0, "predators": 1.0}, seed=seed)


def records(*recordings: pk.Recording) -> Records:
    return Records(recordings, ({"prey": LEVEL, "predators": LEVEL},) * len(recordings), DEFAULTS)


def test_free_starts_are_read_off_one_recording() -> None:
    found = begun(prey(), records(counted(1)))
    assert found.values["prey_0"] == pytest.approx(40.0, abs=4.0)
    assert found.values["predators_0"] == pytest.approx(8.0, abs=3.0)
    assert found.replace(parameters=prey().parameters) == prey()


def test_guesses_of_several_recordings_stay() -> None:
    assert begun(prey(), records(counted(1), counted(2))) == prey()


def test_guesses_that_are_closer_stay() -> None:
    """The first sample is an outlier of a hundred standard deviations."""
    run = counted(1)
    wrong = run["prey"].values.copy()
    wrong[:5] = 400.0
    spoilt = run.with_channels(replace(run["prey"], values=wrong))
    model = prey().with_values(prey_0=40.0, predators_0=8.0)
    assert begun(model, records(spoilt)) == model


@pytest.mark.parametrize("shown", ["1000/T", "clip(1000/T, 0, 9)", "max(1000/T, 0)"])
def test_outputs_that_have_no_value_at_zero_begin_at_their_guesses(shown: str) -> None:
    """A thermistor's resistance has none at zero kelvin, nor has a limit of it."""
    oven = pk.Model.from_dict({
        "name": "oven", "states": {"T": {"initial": "free", "guess": 300.0}},
        "inputs": {"T_m": {}}, "parameters": {"tau": {"unit": "s", "guess": 20.0}},
        "equations": {"T": "(T_m - T)/tau"}, "outputs": {"R": {"expression": shown}}})
    drive = pk.Recording.from_arrays(np.arange(50.0), {"T_m": np.full(50, 330.0)})
    run = pk.simulate(oven.with_values(T_0=320.0), drive, sigma=0.01, seed=0)
    assert begun(oven, Records((run,), ({"R": LEVEL},), DEFAULTS)) == oven
