"""A channel of the opposite sign is what it is, and not a hundred other things."""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp

import pikanid as pk
from pikanid.mismatch.catalogue.catalogue import candidates
from pikanid.mismatch.catalogue.sites import sites
from pikanid.model import Model
from pikanid.recording import Recording

MOTOR = {
    "name": "motor", "states": {"omega": {"unit": "rad/s"}},
    "parameters": {"k": {"unit": "rad/(s^2*V)", "guess": 30.0, "bounds": [1.0, 200.0]},
                   "b": {"unit": "1/s", "guess": 2.0}},
    "inputs": {"u": {"unit": "V", "hold": "zero"}}, "equations": {"omega": "k*u - b*omega"},
    "outputs": {"omega": {"unit": "rad/s", "expression": "omega"}}}
SPRING = {
    "name": "spring", "states": {"x": {"unit": "m"}, "v": {"unit": "m/s"}},
    "parameters": {"k": {"unit": "1/s^2", "guess": 50.0, "bounds": [5.0, 500.0]},
                   "b": {"unit": "1/s", "guess": 1.5, "bounds": [0.0, 50.0]}},
    "inputs": {"f": {"unit": "m/s^2", "hold": "zero"}},
    "equations": {"x": "v", "v": "f - k*x - b*v"},
    "outputs": {"x": {"unit": "m", "expression": "x"}}}


def motor(seed: int) -> Recording:
    """k = 40, b = 3: its voltage was written down with the opposite sign.  Exact, step by step."""
    rng = np.random.default_rng(seed)
    u, step = np.repeat(rng.normal(0, 3, 30), 20), 0.01
    omega, fades = np.zeros(len(u)), np.exp(-3 * step)
    for i in range(len(u) - 1):
        omega[i + 1] = omega[i] * fades + 40 / 3 * u[i] * (1 - fades)
    return Recording.from_arrays(
        step * np.arange(len(u)), {"u": -u, "omega": omega + rng.normal(0, 0.2, len(u))},
        {"u": "V", "omega": "rad/s"}, {"omega": 0.2}, {"u": "zero"})


def spring(seed: int) -> Recording:
    """k = 60, b = 2, and dry friction: the force was written down with the opposite sign."""
    rng = np.random.default_rng(seed)
    t, f = 0.01 * np.arange(600), np.repeat(rng.normal(0, 2, 12), 50)
    states = np.zeros((len(t), 2))
    for i in range(len(t) - 1):
        states[i + 1] = solve_ivp(
            lambda _, x, push=f[i]: [
                x[1], push - 60 * x[0] - 2 * x[1] - 0.6 * np.tanh(x[1] / 1e-3)],
            (0, 0.01), states[i], "LSODA", rtol=1e-8, atol=1e-10).y[:, -1]
    return Recording.from_arrays(
        t, {"f": -f, "x": states[:, 0] + rng.normal(0, 5e-4, len(t))},
        {"f": "m/s^2", "x": "m"}, {"x": 5e-4}, {"f": "zero"})


def test_a_reversed_input_is_named() -> None:
    """Of a linear model at rest a reversed sensor is the same: twins in one hypothesis."""
    answer = pk.diagnose(Model.from_dict(MOTOR), motor(1), motor(2))
    assert answer.verdict == "named"
    [effect] = answer.hypotheses[0].effects
    assert set(effect.ids) == {"input_sign", "sensor_sign"}
    for name, true in (("k", 40.0), ("b", 3.0)):
        assert abs(answer.after.value(name) - true) < 4 * answer.after.std(name)


def test_what_hides_behind_a_reversed_input_is_found_as_well() -> None:
    answer = pk.diagnose(Model.from_dict(SPRING), spring(1), spring(2))
    assert answer.verdict in ("named", "set", "partial")
    assert any(e.ids[0].endswith("_sign") for e in answer.hypotheses[0].effects)
    if answer.verdict == "partial":
        assert {p.family for p in answer.present} == {"gain", "dry friction"}
    else:
        assert any("coulomb_friction" in e.ids for h in answer.hypotheses for e in h.effects)
    assert "it is at rest" not in str(answer)


def test_a_temperature_has_no_sign() -> None:
    model = pk.systems.thermal_rc()
    t = 1800 * np.arange(50.0)
    run = Recording.from_arrays(
        t, {n: 20 + np.sin(t) for n in (*model.input_names, *model.output_names)},
        {c.name: c.unit for c in (*model.inputs, *model.outputs)})
    found = candidates(sites(model, (run,)))
    assert {c.key for c in found if c.ids[0].endswith("_sign")} == {"input_sign[P]"}
