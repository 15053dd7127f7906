"""Limits that the held-out recording does not meet: it speaks of them no more than of what happens
once.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import pikanid as pk

Sensor = Callable[[np.ndarray], np.ndarray]


def stops_at(limit: float) -> Sensor:
    return lambda w: np.minimum(w, limit)


def bends(w: np.ndarray) -> np.ndarray:
    """A sensor of no catalogue: it shows less and less of what is beyond 16 rad/s."""
    over = np.maximum(w - 16.0, 0.0)
    return w - over + 6.0 * (1 - np.exp(-over / 6.0))


def diagnosed(high: tuple[int, ...], sensor: Sensor, noise: float = 0.05) -> pk.Diagnosis:
    """Of a speed that is held at each of 16 levels, the `high` ones near 22 rad/s."""
    model = pk.Model.from_dict({
        "name": "fan", "states": {"w": {"unit": "rad/s", "initial": 0.0}},
        "inputs": {"u": {"unit": "V", "hold": "zero"}},
        "parameters": {"k": {"unit": "rad/(s^2*V)", "guess": 8.0, "bounds": [0.0, 100.0]},
                       "b": {"unit": "1/s", "guess": 1.5, "bounds": [0.0, 50.0]}},
        "equations": {"w": "k*u - b*w"}, "outputs": {"y": {"unit": "rad/s", "expression": "w"}}})

    def run(high: tuple[int, ...], seed: int) -> pk.Recording:
        rng = np.random.default_rng(seed)
        u = np.repeat([5.0 if k in high else rng.uniform(-3.0, 3.0) for k in range(16)], 50)
        w, decay = [0.0], np.exp(-2.0 * 0.02)  # k = 10, b = 2: exact from sample to sample
        for volts in u[:-1]:
            w.append(w[-1] * decay + 5.0 * volts * (1 - decay))
        y = sensor(np.array(w)) + noise * rng.standard_normal(len(u))
        return pk.Recording.from_arrays(np.arange(len(u)) * 0.02, {"u": u, "y": y},
                                        {"u": "V", "y": "rad/s"})

    return pk.diagnose(model, run(high, 3), run((), 4))


@pytest.mark.parametrize("high", [(2, 5, 9, 13), (9,)])
def test_a_limit_that_only_the_train_recording_meets(high: tuple[int, ...]) -> None:
    dx = diagnosed(high, stops_at(20.0))
    assert dx.verdict == "named" and dx.hypotheses[0].effects[0].ids == ("sensor_saturation",)
    assert dx.held_out is not None
    assert dx.held_out.not_met == ((name := dx.hypotheses[0].effects[0].name),)
    assert ("confirmed where this recording meets it: the held-out one does not."
            in dx.sentence())
    assert dx.to_dict()["held_out"]["not_met"] == [name]


def test_a_limit_that_is_hardly_met_may_be_anything() -> None:
    dx = diagnosed((9,), stops_at(20.8), noise=0.5)
    assert dx.verdict == "unconfirmed" and "does not act in any other recording" in dx.doubt


def test_another_law_beyond_what_the_held_out_recording_meets_is_no_limit() -> None:
    dx = diagnosed((2, 5, 9, 13), bends)
    assert dx.mismatch
    assert dx.verdict not in ("named", "set") or not any(
        "sensor_saturation" in e.ids for h in dx.hypotheses for e in h.effects)
    assert not any("sensor_saturation" in p.ids for p in dx.present)
