"""Where fits of the neighbours of a hypothesis begin."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

import pikanid as pk
from pikanid.mismatch.case import Case
from pikanid.mismatch.fitting.fit import fitted
from pikanid.mismatch.fitting.hypothesis import Hypothesis, near_guess
from pikanid.mismatch.search.neighbours import afresh, from_its_place, with_twins
from pikanid.mismatch.search.places import led_away
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.mismatch.steps.opening import open_case
from pikanid.mismatch.steps.searching import searched


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
    rival = hypothesis(case, "input_gain")
    assert rival.key != h.key
    [(effects, [start])] = from_its_place(h, [h, case.base, rival], case.base)
    assert effects == rival.effects and isinstance(start, Mapping)
    own = rival.effects[0].parameters[0].name
    assert start[own] == rival.values[own] and start["a"] == h.values["a"]
    assert [start[label] for label in labels] == [h.point[label] for label in labels]


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


def brushed(seed: int) -> pk.Recording:
    """A motor whose brushes take a voltage away from a current that nobody sees, rounded where it
    turns; integrated by SciPy from level to level of its drive.
    """
    levels, t = np.random.default_rng(seed).uniform(-6.0, 6.0, 40), np.arange(1000) * 0.005
    y, state = np.empty(1000), np.zeros(2)
    for k, u in enumerate(levels):
        found = solve_ivp(lambda t, x, u=u: [
            (0.034 * x[1] - 1e-5 * x[0]) / 1.1e-5,
            (u - x[1] - 0.034 * x[0]) / 1e-3 - 67.0 * np.tanh(x[1] / 0.047)],
            (0.0, 0.125), state, "LSODA", np.arange(26) * 0.005, rtol=1e-8, atol=1e-8)
        y[25 * k:25 * k + 25], state = found.y[0][:25], found.y[:, -1]
    y += 1.6 * np.random.default_rng(seed + 100).standard_normal(1000)
    return pk.Recording.from_arrays(t, {"u": np.repeat(levels, 25), "omega": y},
                                    {"u": "V", "omega": "rad/s"})


def test_effects_show_where_the_model_was_given_if_what_is_missing_has_led_it_away() -> None:
    """Constant and inertia of the motor fall together, far from where the friction shows; and how
    wide its reversal may be is known from the current along the motion, which no output shows.
    """
    train, later = brushed(22), brushed(23)
    case = open_case(pk.systems.dc_motor(), (train,), (later,), None, lambda text: None, DEFAULTS)
    current = next(s for s in case.sites if s.v == "i")
    assert not current.shown and 1.0 < current.usual_speed < 12.0
    about = near_guess(case.model, case.records)
    assert about is not None and led_away(case.base, about) and not led_away(about, about)
    ranked = searched(case, lambda text: None)
    assert ranked[0].key == {"coulomb_friction[rounded]_i"}
    for name, true in (("c_i", 67.0), ("w_c_i", 0.047), ("k", 0.034), ("J", 1.1e-5)):
        assert abs(ranked[0].values[name] - true) < 4 * ranked[0].std[name]
