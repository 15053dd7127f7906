"""A controller that acts on what is measured: its input knows the noise of every sample."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from pikanid.mismatch.data.outliers import without_outliers
from pikanid.mismatch.diagnose import diagnose
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.mismatch.steps.opening import open_case
from pikanid.model import Model
from pikanid.recording import Recording

SAMPLES, VOLUME, LEAK, NOISE = 600, 20.0, 0.5, 0.04


def vessel() -> Model:
    return Model.from_dict({
        "name": "vessel", "states": {"p": {"unit": "bar", "initial": 2.0}},
        "parameters": {"V": {"unit": "l/bar", "guess": 26.0, "bounds": [0.1, 1e3]},
                       "k": {"unit": "l/s/bar", "guess": 0.4, "bounds": [1e-3, 100]}},
        "inputs": {"q": {"unit": "l/s", "hold": "zero"}}, "equations": {"p": "(q - k*p)/V"},
        "outputs": {"p": {"unit": "bar", "expression": "p"}}})


def controlled(seed: int, quadratic: float = 0.0) -> Recording:
    """By proportion and integral of the error of the sample at hand."""
    rng = np.random.default_rng(seed)
    wanted = np.repeat(rng.uniform(1.5, 5.0, SAMPLES // 40), 40)
    p, whole, seen, valve = 2.0, 1.0, [], []
    for at in wanted:
        seen.append(p + NOISE * rng.standard_normal())
        whole = float(np.clip(whole + 0.02 * (at - seen[-1]), 0.0, 4.0))
        valve.append(float(np.clip(1.5 * (at - seen[-1]) + whole, 0.0, 6.0)))
        if quadratic:
            p = solve_ivp(lambda t, x, q=valve[-1]: (q - LEAK * x - quadratic * x**2) / VOLUME,
                          (0, 1), [p], rtol=1e-9, atol=1e-11).y[0, -1]
        else:
            rest = valve[-1] / LEAK
            p = rest + (p - rest) * np.exp(-LEAK / VOLUME)
    return Recording.from_arrays(np.arange(float(SAMPLES)),
                                 {"q": np.array(valve), "p": np.array(seen)},
                                 units={"q": "l/s", "p": "bar"})


def p_value(seed: int) -> float:
    case = open_case(vessel(), (controlled(seed),), None, None, lambda text: None, DEFAULTS)
    case.base = case.begin_search().base()
    return case.detected().p_value


def test_its_noise_is_no_mismatch() -> None:
    """Of 40 right models 4 may be refuted at a level of 1 % with a probability of 6e-4."""
    assert sum(p_value(seed) < 0.01 for seed in range(40)) <= 3


@pytest.mark.parametrize("seed", [1, 5])
def test_it_is_no_outlier_either(seed: int) -> None:
    assert without_outliers(controlled(seed), "p", DEFAULTS, ("q",))[1] == []


def test_what_is_missing_in_the_loop_is_found() -> None:
    dx = diagnose(vessel(), controlled(101, 0.08), controlled(102, 0.08))
    assert dx.verdict in ("named", "set")
    assert any(i.startswith(("quadratic", "power"))
               for h in dx.hypotheses for e in h.effects for i in e.ids)
