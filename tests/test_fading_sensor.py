"""A sensor that loses sensitivity, and a spring where the model has no place; SciPy simulates."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp

from pikanid.mismatch.diagnose import diagnose
from pikanid.model import Model
from pikanid.recording import Recording

FADES, SPRING = -1.4e-4, 0.04


def sensor() -> Model:
    return Model.from_dict({
        "name": "gas sensor", "states": {"c": {"unit": "ppm"}, "y": {"unit": "ppm"}},
        "parameters": {"tau": {"unit": "s", "guess": 100.0, "bounds": [1, 1e4]},
                       "k": {"unit": "ppm/ml", "guess": 5.0, "bounds": [0.1, 100]},
                       "ts": {"unit": "s", "guess": 12.0, "bounds": [0.1, 1e3]}},
        "inputs": {"q": {"unit": "ml/s", "hold": "zero"}},
        "equations": {"c": "k*q - c/tau", "y": "(c - y)/ts"},
        "outputs": {"y": {"unit": "ppm", "expression": "y"}}})


def lift() -> Model:
    return Model.from_dict({
        "name": "lift", "states": {"x": {"unit": "m"}, "v": {"unit": "m/s"}},
        "parameters": {"M": {"unit": "kg", "guess": 1200.0, "bounds": [100, 1e4]},
                       "b": {"unit": "N*s/m", "guess": 700.0, "bounds": [0, 1e4]}},
        "inputs": {"F": {"unit": "N", "hold": "zero"}},
        "equations": {"x": "v", "v": "(F - b*v)/M"},
        "outputs": {"x": {"unit": "m", "expression": "x"}}})


def run(f: Callable[[np.ndarray, float], list[float]], steps: np.ndarray, dt: float) -> np.ndarray:
    """States (N, 2) at the beginning of every step, from rest."""
    x, rows = np.zeros(2), []
    for u in steps:
        rows.append(x)
        x = solve_ivp(lambda t, y, u=u: f(y, u), (0, dt), x, rtol=1e-9, atol=1e-9).y[:, -1]
    return np.array(rows)


def sniffed(seed: int) -> Recording:
    rng, t = np.random.default_rng(seed), 3.0 * np.arange(600)
    q = np.repeat(rng.uniform(0.0, 2.0, 20), 30)
    c = run(lambda y, u: [6 * u - y[0] / 120, (y[0] - y[1]) / 15], q, 3.0)[:, 1]
    seen = c * (1 + FADES * t) + 5.0 * rng.standard_normal(600)
    return Recording.from_arrays(t, {"q": q, "y": seen}, units={"q": "ml/s", "y": "ppm"})


def lifted(seed: int) -> Recording:
    rng, t = np.random.default_rng(seed), 0.1 * np.arange(600)
    F = np.repeat(rng.uniform(-900.0, 900.0, 20), 30)
    x = run(lambda y, u: [y[1], (u - 900 * y[1]) / 1500 - SPRING * y[0]], F, 0.1)[:, 0]
    seen = x + 0.03 * rng.standard_normal(600)
    return Recording.from_arrays(t, {"F": F, "x": seen}, units={"F": "N", "x": "m"})


def test_what_fades_may_be_the_sensor() -> None:
    """Before, drift of k alone was named: small motions hardly tell the two apart."""
    dx = diagnose(sensor(), sniffed(1), sniffed(2))
    given = [e for h in dx.hypotheses for e in h.effects if e.ids == ("sensor_fading",)]
    assert dx.verdict in ("named", "set") and given
    rate = given[0].parameters["r_scale_y"]
    assert abs(rate.value - FADES) < 4 * rate.std < 0.2 * abs(FADES)


def test_a_spring_where_no_place_is_special() -> None:
    dx = diagnose(lift(), lifted(1), lifted(2))
    assert dx.verdict in ("named", "set")
    [effect] = dx.hypotheses[0].effects
    assert effect.ids == ("linear_stiffness",)
    k = effect.parameters["k1"]
    assert abs(k.value - SPRING) < 4 * k.std
