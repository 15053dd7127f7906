"""Inputs that run smoothly between their samples, in a diagnosis."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from pikanid import Model, Recording, diagnose


@pytest.mark.parametrize("hold", ["zero", "first"])
def test_an_input_that_runs_smoothly_is_no_second_mode(hold: str) -> None:
    """Sines up to three samples a period: straight lines lose a third of the fastest ones."""
    dt, w2, d = 0.05, 324.0, 1.5

    def seen(seed: int) -> Recording:
        rng = np.random.default_rng(seed)
        rates, phases = rng.uniform(2.0, 40.0, 60), rng.uniform(0.0, 2 * np.pi, 60)
        sizes, t = 8 * rng.normal(size=60), dt * np.arange(900)

        def push(s: np.ndarray | float) -> np.ndarray:
            return np.sin(np.multiply.outer(np.asarray(s), rates) + phases) @ sizes

        x = solve_ivp(lambda s, z: [z[1], push(s) - w2 * z[0] - d * z[1]], (0.0, t[-1]),
                      [0.0, 0.0], "DOP853", t, rtol=1e-8, atol=1e-10).y[0]
        noisy = x + 0.03 * np.std(x) * rng.normal(size=len(t))
        return Recording.from_arrays(t, {"u": push(t), "x": noisy}, {"u": "m/s^2", "x": "m"})

    model = Model.from_dict({
        "states": {"x": {"unit": "m"}, "v": {"unit": "m/s"}},
        "inputs": {"u": {"unit": "m/s^2", "hold": hold}},
        "parameters": {"k": {"unit": "1/s^2", "guess": 300.0, "bounds": [1.0, 2000.0]},
                       "d": {"unit": "1/s", "guess": 1.0, "bounds": [0.0, 20.0]},
                       "b": {"guess": 1.0}},
        "equations": {"x": "v", "v": "b*u - k*x - d*v"},
        "outputs": {"x": {"unit": "m", "expression": "x"}}})
    dx = diagnose(model, seen(1), seen(2), workers=1)
    assert dx.verdict == "named"
    assert [e.ids for e in dx.hypotheses[0].effects] == [("input_hold",)]
    assert dx.model.input("u").hold == "cubic"
