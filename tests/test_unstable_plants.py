"""Plants that a controller holds where they would not stay: followed in segments."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import pikanid as pk
from pikanid.mismatch.data.records import Records
from pikanid.mismatch.data.stretches import as_one
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.model import Model, systems
from pikanid.problem.problem import Problem
from pikanid.strategies.cuts import counts_for, in_segments
from pikanid.strategies.growth import growth

K, M, G = 6.5e-5, 0.068, 9.81

# A ball below a magnet: it falls, or jumps there
MAGLEV: dict[str, Any] = {
    "name": "magnetic levitation",
    "states": {"z": {"unit": "m", "initial": "z_0"}, "v": {"unit": "m/s", "initial": 0.0}},
    "inputs": {"i": {"unit": "A", "hold": "zero"}},
    "parameters": {"C": {"unit": "N*m^2/A^2", "guess": 6e-5, "bounds": [1e-6, 1e-3]},
                   "z_0": {"unit": "m", "guess": 0.01, "scope": "recording"},
                   "m": {"unit": "kg", "value": M}, "g": {"unit": "m/s^2", "value": G}},
    "equations": {"z": "v", "v": "g - C/m*(i/z)**2"},
    "outputs": {"z": {"unit": "m", "expression": "z"}}}
SIGMA = 2e-5  # m


def levitated(seed: int, seconds: float = 4.0, drag: float = 0.0) -> pk.Recording:
    """Held by a controller about set points of 7.5 to 12.5 mm, at 500 Hz; `drag` in N s/m."""
    rng = np.random.default_rng(seed)
    count, step = round(500 * seconds), 0.002
    wanted = np.repeat(rng.uniform(0.0075, 0.0125, count // 200 + 1), 200)[:count]
    x, seen, current = np.array([0.01, 0.0]), np.empty(count), np.empty(count)
    rest = 0.01 * np.sqrt(M * G / K)
    for k in range(count):
        seen[k] = x[0]
        current[k] = np.clip(rest + 520 * (x[0] - wanted[k]) + 14 * x[1]
                             + 0.05 * rest * np.sin(20 * k * step), 0.05, 5 * rest)
        x = solve_ivp(lambda _, x, i: [x[1], G - K / M * (i / x[0]) ** 2 - drag / M * x[1]],
                      (0.0, step), x, "DOP853", args=(current[k],), rtol=1e-9,
                      atol=1e-12).y[:, -1]
    t = step * np.arange(count)
    return pk.Recording.from_arrays(t, {"i": current, "z": seen + SIGMA * rng.standard_normal(
        count)}, units={"i": "A", "z": "m"}, hold={"i": "zero"}, name=f"run {seed}")


@pytest.fixture(scope="module")
def run() -> pk.Recording:
    return levitated(1)


def test_errors_grow_as_the_linearised_plant_says(run: pk.Recording) -> None:
    """By sqrt(2 g/z) about rest at z: 44 /s at 10 mm."""
    problem = Problem(Model.from_dict(MAGLEV), run)
    grown, = growth(problem, problem.guess)
    rates = np.sqrt(2 * G / run["z"].values)
    assert grown == pytest.approx(float(rates.mean()) * 4.0, rel=0.1)


def test_a_stable_rig_and_a_chaotic_one_are_followed_in_one_go() -> None:
    for model, drive in ((systems.sloshing(), pk.excitation.two_pulse()),
                         (systems.pendulum(), None)):
        recording = pk.simulate(model, drive or pk.Recording.from_arrays(
            np.linspace(0, 60, 1200), {"none": np.zeros(1200)}), sigma=1e-3, seed=0)
        problem = Problem(model, recording)
        assert growth(problem, problem.guess) == (0.0,)


@pytest.mark.parametrize("guess", [5.5e-5, 6e-5, 7.5e-5])
def test_nls_finds_the_force_of_a_magnet(run: pk.Recording, guess: float) -> None:
    """In one go a fit ends at C = 0.00015, with a residual of metres."""
    model = Model.from_dict(MAGLEV).with_values(C=guess)
    found = pk.NLS().fit(model, run)
    assert abs(found.value("C") - K) < 4 * found.std("C") < 4e-3 * K
    assert found.ok and found.rmse == pytest.approx(SIGMA, rel=0.08)
    assert [f.label for f in found.free] == ["C", "z_0[0]"]
    assert "unstable" in found.warnings[0] and found.settings["pieces"][0] > 10
    assert len(found.fits) == 1 and len(found.fits[0].t) == len(run.t)
    assert found.model.parameter_names == model.parameter_names


def test_several_recordings_are_cut_each(run: pk.Recording) -> None:
    found = pk.NLS().fit(Model.from_dict(MAGLEV), [run, levitated(2, 2.0)])
    assert abs(found.value("C") - K) < 4 * found.std("C")
    assert [f.label for f in found.free] == ["C", "z_0[0]", "z_0[1]"]
    assert [(f.recording, len(f.t)) for f in found.fits] == [("run 1", 2000), ("run 2", 1000)]


def test_segments_hold_every_sample_once_and_the_input_from_their_start(run: pk.Recording) -> None:
    problem = Problem(Model.from_dict(MAGLEV), run)
    grown = growth(problem, problem.guess)
    counts = counts_for(problem, grown, 2.0)
    pieces, owners = in_segments(problem, counts, grown)
    assert set(owners) == {0} and len(pieces) == counts[0] > 50
    whole = as_one(pieces)
    np.testing.assert_array_equal(whole["z"].values, run["z"].values)
    for piece in pieces:
        assert piece["i"].time[0] <= piece["z"].time[0]
        at = np.searchsorted(run.t, piece["i"].time[0], "right") - 1
        assert piece["i"].values[0] == run["i"].values[at]


@pytest.mark.slow
def test_what_an_unstable_plant_lacks_is_named(run: pk.Recording) -> None:
    """And nothing where nothing is."""
    model = Model.from_dict(MAGLEV)
    assert pk.diagnose(model, run, levitated(2), workers=1).verdict == "none"
    found = pk.diagnose(model, levitated(3, drag=0.5), levitated(4, drag=0.5), workers=1)
    assert found.verdict == "named", str(found)
    effect, = found.hypotheses[0].effects
    assert "linear_drag" in effect.ids
    value, = effect.parameters.values()
    assert abs(value.value - 0.5 / M) < 4 * value.std


def test_segments_stay_together_beside_other_recordings(run: pk.Recording) -> None:
    cut = Records((run,) * 4, ({},) * 4, DEFAULTS, cut_from=(0, 0, 1, 1))
    alone = Records((run,) * 2, ({},) * 2, DEFAULTS)
    assert alone.stretches == [[0], [1]] and cut.stretches == [[0, 1], [2, 3]]
    assert cut.beside(alone).stretches == [[0, 1], [2, 3], [4], [5]]
    assert alone.beside(cut).beside(cut).stretches == [[0], [1], [2, 3], [4, 5], [6, 7], [8, 9]]


def test_what_a_simulation_in_one_go_cannot_judge_is_said(run: pk.Recording) -> None:
    found = pk.IPDA().fit(Model.from_dict(MAGLEV), run)
    assert found.value("C") == pytest.approx(K, rel=5e-3)
    assert any("NLS follows it in segments" in w for w in found.warnings)
    assert not any("do not determine" in w for w in found.warnings)


def changed(**tables: Any) -> Model:
    """The model with other entries in its tables."""
    return Model.from_dict({**MAGLEV, **{
        name: {**MAGLEV[name], **table} for name, table in tables.items()}})


@pytest.mark.parametrize("kind", ["gap", *(pytest.param(kind, marks=pytest.mark.slow) for kind in (
    "coarse", "ends early", "input later", "slow output"))])
def test_recordings_that_are_not_whole_are_followed(run: pk.Recording, kind: str) -> None:
    model, z, t = Model.from_dict(MAGLEV), run["z"], run.t
    if kind == "gap":
        run = run.with_channels(replace(z, values=np.where((t > 1) & (t < 1.2), np.nan, z.values)))
    elif kind == "coarse":
        run = run.with_channels(replace(z, values=np.round(z.values / 1e-4) * 1e-4))
    elif kind == "ends early":
        run = run.with_channels(replace(z, time=z.time[:-150], values=z.values[:-150]))
    elif kind == "input later":
        run = run.with_channels(replace(
            run["i"], time=run["i"].time[3:], values=run["i"].values[3:]))
    else:
        model = changed(outputs={"w": {"unit": "m/s", "expression": "v"}})
        speed = np.gradient(z.values, t)[::5]
        run = run.with_channels(pk.Channel("w", t[::5], speed, "m/s", 0.01))
        run = run.with_sigma({"z": SIGMA})
    found = pk.NLS().fit(model, run)
    assert "pieces" in found.settings and found.value("C") == pytest.approx(K, rel=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize("guess", [2e-5, 2e-4])
def test_a_guess_two_and_three_times_off(run: pk.Recording, guess: float) -> None:
    found = pk.NLS().fit(Model.from_dict(MAGLEV).with_values(C=guess), run)
    assert "pieces" in found.settings and found.value("C") == pytest.approx(K, rel=1e-3)


def test_multiple_shooting_and_bounds_of_a_start_are_no_hindrance(run: pk.Recording) -> None:
    model = changed(parameters={"z_0": {
        "unit": "m", "guess": 0.011, "bounds": [0.0105, 0.02], "scope": "recording"}})
    found = pk.NLS(segments=4).fit(model, run)
    assert found.value("C") == pytest.approx(K, rel=1e-3) and found.settings["segments"] == 4
    assert found.fitted_model.parameter("z_0").value == 0.0105


@pytest.mark.parametrize("tables", [
    {"inputs": {"i": {"unit": "A", "delay": "tau"}},
     "parameters": {"tau": {"unit": "s", "guess": 0.003, "bounds": [0, 0.02]}}},
    {"equations": {"v": "g + f - C/m*(i/z)**2"},
     "parameters": {"f": {"unit": "m/s^2", "guess": 0.0, "scope": "recording"}}},
    {"equations": {"v": "g - C/m*(i/(z + 0.1*(z - z_0)))**2"}}])
def test_what_segments_would_not_tell_is_not_cut(tables: dict[str, Any], run: pk.Recording) -> None:
    """The past of an input, and what is a recording's own."""
    problem = Problem(changed(**tables), run)
    assert growth(problem, problem.guess) == (0.0,)


@pytest.mark.parametrize(("guess", "count"), [(2.0, 50), (1e5, 500)])
def test_a_guess_that_explodes_on_a_rig_at_rest_ends(guess: float, count: int) -> None:
    model = Model.from_dict({
        "name": "decay", "states": {"x": {"initial": 1.0}},
        "parameters": {"a": {"guess": guess}}, "equations": {"x": "a*x"},
        "outputs": {"x": {"expression": "x"}}})
    t = np.linspace(0, 20, count)
    noise = 0.01 * np.random.default_rng(0).standard_normal(count)
    recording = pk.Recording.from_arrays(t, {"x": np.exp(-0.2 * t) + noise})
    problem = Problem(model, recording)
    assert growth(problem, problem.guess) in [(0.0,), (pytest.approx(40.0, rel=0.1),)]


def test_a_stable_rig_with_an_unstable_guess_is_fitted_in_one_go() -> None:
    model = Model.from_dict({
        "name": "swing", "states": {"x": {"initial": 0.5}, "v": {"initial": 0.0}},
        "parameters": {"k": {"guess": 30.0}, "d": {"guess": -3.0}},
        "equations": {"x": "v", "v": "-k*x - d*v"}, "outputs": {"x": {"expression": "x"}}})
    recording = pk.simulate(model.with_values(k=32.0, d=0.4), pk.Recording.from_arrays(
        np.linspace(0, 20, 1000), {"none": np.zeros(1000)}), sigma=1e-3, seed=0)
    found = pk.NLS().fit(model, recording)
    assert "pieces" not in found.settings and found.ok
    assert abs(found.value("d") - 0.4) < 4 * found.std("d")
