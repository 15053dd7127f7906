"""Noise whose colour is as slow as the motion: nothing is missing, and what is still shows."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.signal import lfilter

import pikanid as pk
from pikanid.recording import Recording

TRUE = {"w": 0.8, "z": 0.05, "e": 0.6}
STEP, SIGMA, RHO = 0.6, {"roll": 0.004, "rate": 0.003}, 0.6
WAVES = ((0.05, 0.31, 0.4), (0.04, 0.62, 1.9), (0.05, 0.85, 5.1), (0.03, 1.1, 2.7))


def ship() -> pk.Model:
    return pk.Model.from_dict({
        "name": "ship", "states": {"q": {"unit": "rad", "initial": "free", "guess": 0.0},
                                   "p": {"unit": "rad/s", "initial": "free", "guess": 0.0}},
        "inputs": {"slope": {"unit": "rad", "hold": "cubic"}},
        "parameters": {"w": {"unit": "rad/s", "guess": 0.7, "bounds": [0.1, 3.0]},
                       "z": {"guess": 0.08, "bounds": [0.001, 0.5]},
                       "e": {"guess": 0.8, "bounds": [0.1, 2.0]}},
        "equations": {"q": "p", "p": "-2*z*w*p - w**2*(q - e*slope)"},
        "outputs": {"roll": {"unit": "rad", "expression": "q"},
                    "rate": {"unit": "rad/s", "expression": "p"}}})


def sailed(seed: int, swell: float = 0.0) -> Recording:
    """Ten minutes in waves; `swell` is how far a stiffness of its own rhythm changes."""
    rng = np.random.default_rng(seed)
    phases, w, z, e = rng.uniform(0, 6, len(WAVES)), *TRUE.values()

    def slope(t: np.ndarray | float) -> np.ndarray:
        return sum((a * np.sin(f * np.asarray(t) + c + p)
                    for (a, f, c), p in zip(WAVES, phases, strict=True)), np.zeros_like(t))

    def rates(t: float, x: np.ndarray) -> tuple[float, float]:
        k = w**2 * (1 + swell * np.sin(1.7 * t))
        return x[1], -2 * z * w * x[1] - k * x[0] + w**2 * e * float(slope(t))

    t = np.arange(0.0, 600.0, STEP)
    x = solve_ivp(rates, (0.0, t[-1]), [0.03, 0.0], t_eval=t, method="DOP853", rtol=1e-9,
                  atol=1e-11).y
    white = rng.standard_normal((2, len(t)))
    coloured = lfilter([np.sqrt(1 - RHO**2)], [1.0, -RHO], white[0])
    return Recording.from_arrays(
        t, {"slope": slope(t), "roll": x[0] + SIGMA["roll"] * coloured,
            "rate": x[1] + SIGMA["rate"] * white[1]},
        {"slope": "rad", "roll": "rad", "rate": "rad/s"}, hold={"slope": "cubic"})


@pytest.mark.parametrize("seed", range(5))
def test_nothing_is_missing_beside_slow_noise(seed: int) -> None:
    """Read at high frequencies alone it is white and half as loud, and 4 of 5 alarmed."""
    dx = pk.diagnose(ship(), sailed(seed), sailed(seed + 100), workers=1)
    assert dx.verdict == "none"
    std = np.sqrt(np.diag(dx.before.covariance))
    for f, value, error in zip(dx.before.free, dx.before.theta, std, strict=True):
        if f.name in TRUE:
            assert abs(value - TRUE[f.name]) < 4 * error, f.name
    assert any("correlation 0." in said for said in dx.noise)


def test_a_stiffness_with_a_rhythm_of_its_own_is_no_noise() -> None:
    dx = pk.diagnose(ship(), sailed(7, swell=0.3), sailed(107, swell=0.3), workers=1)
    assert dx.mismatch
