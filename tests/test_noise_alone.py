"""What may be noise alone: a colour that high frequencies of a short recording do not show."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.signal import lfilter

import pikanid as pk
from pikanid.model import Model

T = 0.05 * np.arange(600)
SIGMA = 0.003  # m


def oscillator() -> Model:
    return Model.from_dict({
        "name": "oscillator",
        "states": {"x": {"unit": "m", "initial": 0.0}, "v": {"unit": "m/s", "initial": 0.0}},
        "inputs": {"u": {"unit": "m/s^2", "hold": "first"}},
        "parameters": {"w2": {"unit": "1/s^2", "guess": 30.0, "bounds": [1.0, 200.0]},
                       "c": {"unit": "1/s", "guess": 0.5, "bounds": [0.0, 20.0]}},
        "equations": {"x": "v", "v": "u - w2*x - c*v"},
        "outputs": {"y": {"unit": "m", "expression": "x"}}})


def recorded(seed: int, rho: float, rubs: float) -> pk.Recording:
    """SciPy's, with AR(1) noise; beyond 0.05 m it may rub (m/s²)."""
    rng = np.random.default_rng(seed)
    w, phase = rng.uniform(1.0, 8.0, 6), rng.uniform(0.0, 2 * np.pi, 6)
    u = 1.2 * np.sum(np.sin(np.outer(w, T) + phase[:, None]), axis=0)

    def rate(t: float, z: np.ndarray) -> list[float]:
        rub = rubs * np.tanh(z[1] / 0.01) * (z[0] > 0.05)
        return [z[1], np.interp(t, T, u) - 36.0 * z[0] - 0.6 * z[1] - rub]

    x = solve_ivp(rate, (0.0, T[-1]), [0.0, 0.0], method="LSODA", rtol=1e-8, atol=1e-10,
                  max_step=0.05, t_eval=T).y[0]
    drawn = np.sqrt(1 - rho**2) * rng.standard_normal(len(T) + 200)
    noise = SIGMA * lfilter([1.0], [1.0, -rho], drawn)[200:]
    return pk.Recording.from_arrays(T, {"u": u, "y": x + noise}, {"u": "m/s^2", "y": "m"})


@pytest.mark.slow
def test_a_colour_that_is_all_of_it_is_offered_in_place_of_a_law() -> None:
    """Either nothing is missing, or it is said that nothing need be."""
    said = [pk.diagnose(oscillator(), recorded(10 * seed, 0.8, 0.0),
                        recorded(10 * seed + 1, 0.8, 0.0)) for seed in range(6)]
    assert all(dx.verdict in ("none", "unnamed") for dx in said)
    doubted = [dx for dx in said if dx.mismatch]
    assert doubted and all("it may be noise alone" in dx.sentence() for dx in doubted)


@pytest.mark.slow
def test_a_law_that_nobody_has_listed_is_no_noise() -> None:
    dx = pk.diagnose(oscillator(), recorded(3, 0.0, 0.8), recorded(4, 0.0, 0.8))
    assert dx.mismatch and dx.verdict == "unnamed" and not dx.doubt
