"""A loss in proportion to a state that is the rate of no other one."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import pikanid as pk
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.mismatch.steps.opening import open_case
from pikanid.model import Model, systems

M, ROLLING, AIR, MORE = 1500.0, 200.0, 0.42, 7.0  # kg, N, N s²/m², N s/m


def car() -> Model:
    """Rolls against a constant and a quadratic resistance, from a speed of its own each time."""
    return Model.from_dict({
        "name": "car", "states": {"v": {"unit": "m/s", "initial": "v0"}},
        "inputs": {"F": {"unit": "N", "hold": "zero"}},
        "parameters": {
            "v0": {"unit": "m/s", "guess": 15.0, "bounds": [0.0, 60.0], "scope": "recording"},
            "m": {"unit": "kg", "guess": 1300.0, "bounds": [300.0, 5000.0]},
            "Fr": {"unit": "N", "guess": 150.0, "bounds": [0.0, 3000.0]},
            "c2": {"unit": "N*s^2/m^2", "guess": 0.3, "bounds": [0.0, 10.0]}},
        "equations": {"v": "(F - Fr - c2*v*abs(v))/m"},
        "outputs": {"v": {"unit": "m/s", "expression": "v"}}})


def driven(seed: int, v0: float) -> pk.Recording:
    """To another speed every 10 s, with a resistance in proportion to it besides: SciPy's."""
    rng = np.random.default_rng(seed)
    t = np.arange(0, 200, 0.25)
    F, v, now = np.empty_like(t), np.empty_like(t), v0
    for k in range(0, len(t), 40):
        goal = rng.uniform(8, 36)
        F[k:k + 40] = push = np.clip(150 * (goal - now) + AIR * now**2 + MORE * now, -5000, 4000)
        run = solve_ivp(lambda _, y, push=push: (
            push - ROLLING - MORE * y - AIR * y * np.abs(y)) / M, (0, 10.0), [now],
            method="DOP853", rtol=1e-10, atol=1e-10, t_eval=np.arange(41) * 0.25)
        v[k:k + 40], now = run.y[0][:-1], run.y[0][-1]
    noise = 0.02 * rng.standard_normal(len(t))
    return pk.Recording.from_arrays(t, {"F": F, "v": v + noise}, {"F": "N", "v": "m/s"})


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_loss_that_an_offset_equals_to_the_letter_is_told(seed: int) -> None:
    """(v + w)² is v², a constant and 2 w v: with a constant and a quadratic resistance of its own a
    model cannot tell a linear one from a sensor that is w off.
    """
    dx = pk.diagnose(car(), driven(10 * seed, 15.0), driven(10 * seed + 1, 22.0))
    told = {i for h in dx.hypotheses for e in h.effects for i in e.ids}
    assert dx.mismatch and dx.verdict in ("set", "partial")
    assert "linear_drag" in told
    found = next(h for h in dx.hypotheses if any("linear_drag" in e.ids for e in h.effects))
    assert found.model.parameter("m").value == pytest.approx(M, rel=0.002)


def offered(model: Model, inputs: dict[str, np.ndarray], units: dict[str, str]) -> set[str]:
    """Ids of what a diagnosis looks for."""
    t = 10.0 * np.arange(len(next(iter(inputs.values()))))
    shown = pk.simulate(model, pk.Recording.from_arrays(t, inputs, units), sigma=0.01, seed=1)
    case = open_case(model, (shown,), None, None, lambda text: None, DEFAULTS)
    return {i for c in case.candidates for i in c.ids}


def test_one_law_is_offered_once() -> None:
    """Where the model has such a loss, or its catalogue lists it under another name, not again."""
    def tank(*domain: str) -> Model:
        return Model.from_dict({
            "name": "tank", "states": {"h": {"unit": "m", "initial": 0.0}}, "domain": list(domain),
            "inputs": {"q": {"unit": "m^3/s"}}, "outputs": {"h": {"expression": "h"}},
            "parameters": {"A": {"unit": "m^2", "guess": 1.0}}, "equations": {"h": "q/A"}})

    q = {"q": np.sin(np.arange(100))}
    assert "linear_drag" in offered(tank(), q, {"q": "m^3/s"})
    found = offered(tank("hydraulics"), q, {"q": "m^3/s"})
    assert "seepage" in found and "linear_drag" not in found
    heat = {"T_a": np.full(50, 5.0), "P": 100.0 * np.arange(50)}
    assert "linear_drag" not in offered(systems.thermal_rc(), heat, {"T_a": "degC", "P": "W"})
