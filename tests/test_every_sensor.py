"""Every output's sensor may be wrong, whichever of them the equations' sites are seen in."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import pikanid as pk
from pikanid.mismatch.catalogue.catalogue import candidates
from pikanid.mismatch.catalogue.sites import sites
from pikanid.recording import Recording

STEP, SIGMA = 0.02, {"angle": 0.002, "gyro": 0.004}
OUTPUTS = {"angle": {"unit": "rad", "expression": "q"},
           "gyro": {"unit": "rad/s", "expression": "v"}}


def model(*order: str) -> pk.Model:
    return pk.Model.from_dict({
        "name": "roll", "states": {"q": {"unit": "rad"}, "v": {"unit": "rad/s"}},
        "inputs": {"u": {"unit": "rad/s^2"}},
        "parameters": {"k": {"unit": "1/s^2", "guess": 3.0, "bounds": [0.1, 50.0]},
                       "c": {"unit": "1/s", "guess": 0.3, "bounds": [0.0, 5.0]}},
        "equations": {"q": "v", "v": "u - k*q - c*v"},
        "outputs": {name: OUTPUTS[name] for name in order}})


def recorded(seed: int, gain: float = 1.0, offset: float = 0.0) -> Recording:
    """k = 4 /s², c = 0.4 /s under a random input, by another integrator; the gyro errs."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, 24.0, STEP)
    u = np.repeat(rng.uniform(-1.0, 1.0, len(t) // 20 + 1), 20)[:len(t)]
    x, held = np.zeros((len(t), 2)), np.zeros(2)
    for k in range(len(t) - 1):
        held = solve_ivp(lambda _, y, f=u[k]: (y[1], f - 4 * y[0] - 0.4 * y[1]), (0.0, STEP), held,
                         rtol=1e-9, atol=1e-11).y[:, -1]
        x[k + 1] = held
    return Recording.from_arrays(t, {
        "u": u, "angle": x[:, 0] + SIGMA["angle"] * rng.standard_normal(len(t)),
        "gyro": gain * x[:, 1] + offset + SIGMA["gyro"] * rng.standard_normal(len(t))},
        {"u": "rad/s^2", "angle": "rad", "gyro": "rad/s"}, hold={"u": "zero"})


@pytest.fixture(scope="module")
def still() -> Recording:
    return recorded(1)


@pytest.mark.parametrize("order", [("angle", "gyro"), ("gyro", "angle")])
def test_both_sensors_are_asked_and_only_the_site_s_own_has_twins(order: tuple[str, str],
                                                                 still: Recording) -> None:
    made = candidates(sites(model(*order), (still,)))
    by_sensor: dict[str, set[str]] = {}
    for c in made:
        if c.channel == "sensor" and not c.next_to:
            by_sensor.setdefault(c.site.output.name, set()).add(c.ids[0])
    assert by_sensor.keys() == {"angle", "gyro"} and by_sensor["angle"] == by_sensor["gyro"]
    gyro = {c.alike for c in made if c.alike and c.site.output.name == "gyro"}
    assert gyro and not gyro & {c.alike for c in made if c.site.output.name != "gyro"}


@pytest.mark.parametrize(("order", "errs", "said"), [
    (("angle", "gyro"), {"gain": 1.08}, "sensor_gain"),
    (("angle", "gyro"), {"offset": 0.01}, "sensor_offset"),
    (("gyro", "angle"), {"offset": 0.01}, "sensor_offset")])
def test_a_gyro_that_errs_is_accused_itself(order: tuple[str, str], errs: dict[str, Any], said: str
                                            ) -> None:
    dx = pk.diagnose(model(*order), recorded(3, **errs), recorded(4, **errs), workers=1)
    assert dx.verdict in ("named", "set")
    accused = {(e.ids[0], e.expression) for h in dx.hypotheses for e in h.effects}
    assert any(name == said and "gyro" in text for name, text in accused)
