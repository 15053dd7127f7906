"""Where fits of the neighbours of a hypothesis begin."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

import pikanid as pk
from pikanid.mismatch.case import Case
from pikanid.mismatch.fitting.hypothesis import Hypothesis, fitted
from pikanid.mismatch.search.neighbours import afresh, with_twins
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.mismatch.steps.opening import open_case


def hypothesis(case: Case, key: str, **start: float) -> Hypothesis:
    listed = {c.key: c for c in case.candidates}
    found = fitted(case.model, [listed[key]], case.records, [start], 30)
    assert found is not None
    return found


def test_an_explanation_begins_again_at_the_guess() -> None:
    """The model's own parameters, in every recording, not those of effects."""
    tank = pk.Model.from_dict({
        "name": "tank", "states": {"h": {"unit": "cm", "initial": "h_0"}},
        "inputs": {"u": {"unit": "V"}},
        "parameters": {"h_0": {"unit": "cm", "guess": 4.0, "bounds": [0.1, 20.0],
                               "scope": "recording"},
                       "k": {"unit": "cm/(s*V)", "guess": 0.4, "bounds": [0.01, 5.0]},
                       "a": {"unit": "1/s", "guess": 0.1, "bounds": [0.001, 2.0]}},
        "equations": {"h": "k*u - a*h"}, "outputs": {"y": {"unit": "cm", "expression": "h"}}})
    t, guess = np.arange(200) * 0.5, {n: tank.parameter(n).value for n in tank.free_names}
    runs = tuple(pk.simulate(
        tank.with_values(h_0=start, a=0.2), pk.Recording.from_arrays(
            t, {"u": 2.0 + np.sin(t / 9.0)}, units={"u": "V"}), sigma=0.01, seed=k)
        for k, start in enumerate((3.0, 6.0)))
    case = open_case(tank, runs, None, None, lambda text: None, DEFAULTS)
    h = hypothesis(case, "static_bias")
    labels = [f.label for f in h.whitened.problem.free if f.name == "h_0"]
    assert [round(h.point[label]) for label in labels] == [3, 6]
    effects, [start] = next(iter(afresh(h, guess)))
    assert effects == h.effects and isinstance(start, Mapping)
    assert [start[label] for label in labels] == [4.0, 4.0] and start["a"] == 0.1
    assert start["bias"] == h.values["bias"]


def test_twins_begin_as_strong_as_what_they_replace() -> None:
    """Where one unit measures both: an offset of the sensor says nothing of the force's."""
    recorded = pk.simulate(pk.systems.sloshing(), pk.excitation.planar_moves(4, 6.0, seed=1),
                           sigma=0.002, seed=1)
    case = open_case(pk.systems.sloshing(), (recorded,), None, None, lambda text: None, DEFAULTS)
    gain = hypothesis(case, "sensor_gain", k_out=1.2)
    begun: dict[frozenset[str], Any] = {
        frozenset(e.key for e in effects): start[0]
        for effects, start in with_twins(gain, case.candidates)}
    assert begun[frozenset({"input_gain"})]["k_in"] == gain.values["k_out"]
    offset = hypothesis(case, "sensor_offset")
    (_, [start]), = with_twins(offset, case.candidates)
    assert start == offset.point
