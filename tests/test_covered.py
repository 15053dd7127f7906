"""Samples that show what came after the inputs were recorded tell nothing of a model."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import pikanid as pk
from pikanid.mismatch.data.covered import covered
from pikanid.mismatch.data.records import Records
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.noise.level import NoiseModel

STEP, COUNT = 0.02, 1000


def records(longer: int = 0) -> Records:
    """20 s of an input and an output, which is recorded for so many samples longer."""
    t = STEP * np.arange(COUNT + longer)
    run = pk.Recording.from_arrays(t, {"theta": np.sin(t), "u_x": np.cos(t)})
    u = pk.Recording.from_arrays(t[:COUNT], {"u_x": np.cos(t[:COUNT])})["u_x"]
    return Records((run.with_channels(u),), ({"theta": NoiseModel(0.01, 0.0, 0.0, 0.01, "")},),
                   DEFAULTS)


@pytest.mark.parametrize(("maps", "last"), [
    ({"delay": "0.1 - clock*t"}, COUNT - 4),  # 20 + 0.1 s are shown at 19.90 s
    ({"delay": "0.5"}, COUNT - 1), ({"delay": "-0.1"}, COUNT - 5)])
def test_what_is_shown_must_have_been_driven_by_what_was_recorded(
        maps: dict[str, str], last: int) -> None:
    model = pk.systems.sloshing().map_output("theta", [pk.Parameter("clock", 0.0)], **maps)
    before = records()
    after = covered(before, model, {"clock": 0.009})
    kept = np.flatnonzero(np.isfinite(after.recordings[0]["theta"].values))
    assert kept[0] == 0 and kept[-1] == last and len(kept) == last + 1
    assert (after is before) == (last == COUNT - 1)


def test_an_input_recorded_late_is_known_for_less() -> None:
    model = pk.systems.sloshing().map_input("u_x", delay="-0.06")
    kept = np.isfinite(covered(records(), model, {}).recordings[0]["theta"].values)
    assert kept[:COUNT - 2].all() and not kept[COUNT - 2:].any()


def test_what_was_recorded_longer_than_the_inputs_is_left_as_it_was() -> None:
    before = records(longer=50)
    assert covered(before, pk.systems.sloshing(), {}) is before


def test_a_model_without_inputs_leaves_all() -> None:
    model = pk.Model.from_dict({
        "name": "decay", "states": {"x": {"initial": 1.0}}, "parameters": {"a": {"guess": 0.5}},
        "equations": {"x": "-a*x"}, "outputs": {"theta": {"expression": "x", "delay": -3.0}}})
    before = records()
    assert covered(before, model, {}) is before


@pytest.mark.slow
def test_a_clock_error_is_named_where_the_input_goes_on_to_the_end() -> None:
    """A cart on a spring, by another integrator; the camera loses 1.2 %."""
    def run(seed: int) -> pk.Recording:
        rng, t = np.random.default_rng(seed), STEP * np.arange(COUNT)
        force = np.repeat(rng.uniform(-2, 2, 21), 50)
        x, states = np.zeros(2), [np.zeros(2)]
        dense = []
        for k in range(COUNT + 20):
            found = solve_ivp(lambda _, y, f=force[k]: (y[1], (f - 8 * y[0] - 0.5 * y[1]) / 1.3),
                              (0.0, STEP), x, rtol=1e-9, atol=1e-11, dense_output=True)
            dense.append(found.sol)
            x = found.y[:, -1]
            states.append(x)
        seen = [dense[int(s / STEP)](s % STEP)[0] for s in 1.012 * t]
        return pk.Recording.from_arrays(
            t, {"F": force[:COUNT], "x": np.array(seen) + 0.003 * rng.normal(size=COUNT)},
            units={"F": "N", "x": "m"}, name=f"run {seed}")

    cart = pk.Model.from_dict({
        "name": "cart", "states": {"x": {"unit": "m", "initial": 0},
                                   "v": {"unit": "m/s", "initial": 0}},
        "inputs": {"F": {"unit": "N"}},
        "parameters": {"m": {"unit": "kg", "guess": 1.0, "bounds": [0.1, 10]},
                       "k": {"unit": "N/m", "guess": 6.0, "bounds": [0, 100]},
                       "c": {"unit": "N*s/m", "guess": 0.3, "bounds": [0, 10]}},
        "equations": {"x": "v", "v": "(F - k*x - c*v)/m"},
        "outputs": {"x": {"unit": "m", "expression": "x"}}})
    dx = pk.diagnose(cart, run(1), run(2))
    assert dx.verdict == "named" and dx.hypotheses[0].effects[0].ids == ("clock_error",)
    clock = dx.hypotheses[0].effects[0].parameters["clock"]
    assert abs(clock.value - 0.012) < 4 * clock.std < 4e-4
    assert any("after the inputs" in note for note in dx.notes)
