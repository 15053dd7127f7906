"""A crane that hoists while it travels: what its recorded acceleration does varies with the cable.

Its recordings come from SciPy, and nothing of them is at rest when they begin.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import pikanid as pk
from pikanid.mismatch.catalogue.feedthrough import feedthroughs
from pikanid.mismatch.catalogue.input_offset import input_offsets
from pikanid.mismatch.catalogue.second_mode import second_mode
from pikanid.mismatch.catalogue.sites import sites

STEP, COUNT, NOISE, G, LENGTH, DAMPING = 0.1, 900, 0.003, 9.81, 0.8, 0.03
UNITS = {"acc": "m/s^2", "L": "m", "theta": "rad"}
Shown = Callable[[np.ndarray, np.ndarray], np.ndarray]


def crane() -> pk.Model:
    return pk.Model.from_dict({
        "name": "crane", "states": {"theta": {"unit": "rad", "initial": "free"},
                                    "w": {"unit": "rad/s", "initial": "free"}},
        "inputs": {"acc": {"unit": "m/s^2", "hold": "first"},
                   "L": {"unit": "m", "hold": "first"}},
        "parameters": {"g": {"unit": "m/s^2", "value": G},
                       "L0": {"unit": "m", "guess": 0.5, "bounds": [-2.0, 3.0]},
                       "d": {"unit": "1/s", "guess": 0.02, "bounds": [0.0, 2.0]}},
        "equations": {"theta": "w", "w": "-(g*sin(theta) + acc*cos(theta))/(L + L0) - d*w"},
        "outputs": {"theta": {"unit": "rad", "expression": "theta"}}})


def run(seed: int, wind: float = 0.0, shown: Shown = lambda theta, acc: theta) -> pk.Recording:
    """Travel in random moves, the cable between 4 and 10 m."""
    rng = np.random.default_rng(seed)
    t = np.arange(COUNT) * STEP
    acc = np.interp(t, np.arange(0.0, 91.0, 3.0), rng.uniform(-0.5, 0.5, 31))
    cable = 7.0 + 3.0 * np.sin(2 * np.pi * t / 47.0 + rng.uniform(0.0, 6.0))

    def rates(at: float, x: np.ndarray) -> list[float]:
        a, length = np.interp(at, t, acc) + wind, np.interp(at, t, cable) + LENGTH
        return [x[1], -(G * np.sin(x[0]) + a * np.cos(x[0])) / length - DAMPING * x[1]]

    made = solve_ivp(rates, (0.0, t[-1]), [0.02, -0.01], "LSODA", t, rtol=1e-9, atol=1e-10)
    seen = shown(made.y[0], acc) + NOISE * rng.normal(size=COUNT)
    return pk.Recording.from_arrays(t, {"acc": acc, "L": cable, "theta": seen}, units=UNITS)


def test_an_offset_of_what_does_not_always_act_alike_stands_beside_one_of_the_sensor() -> None:
    """Small motions about a tilted rest are those about a straight one."""
    given = pk.diagnose(crane(), run(1, wind=0.12), run(2, wind=0.12), workers=1)
    assert given.verdict in ("named", "set") and len(given.hypotheses) <= 2
    found = {e.ids: e for h in given.hypotheses for e in h.effects}
    offset = found["input_offset",].parameters["acc_zero"]
    assert abs(offset.value - 0.12) < 4 * offset.std < 0.02


def test_an_offset_in_one_place_that_always_acts_alike_is_a_constant_force() -> None:
    model, moves = crane(), {"theta": (-0.1, 0.1), "w": (-0.1, 0.1), "acc": (-0.5, 0.5)}
    asked = {"acc": 0.5}
    assert [e.variant for e in input_offsets(model, asked, (), lambda: {**moves, "L": (4.0, 10.0)})
            ] == ["acc"]
    assert not [*input_offsets(model, asked, (), lambda: {**moves, "L": (7.0, 7.1)})]


def test_a_sensor_that_leans_with_the_acceleration_is_no_second_mode() -> None:
    def leaning(theta: np.ndarray, acc: np.ndarray) -> np.ndarray:
        return theta + 0.06 * acc

    given = pk.diagnose(crane(), run(3, shown=leaning), run(4, shown=leaning), workers=1)
    assert given.verdict == "named"
    [effect] = given.hypotheses[0].effects
    part = effect.parameters["part_acc"]
    assert effect.ids == ("feedthrough",) and effect.channel == "sensor"
    assert abs(part.value - 0.06) < 4 * part.std < 0.004


def test_nothing_is_missing_where_nothing_hides() -> None:
    assert pk.diagnose(crane(), run(5), run(6), workers=1).verdict == "none"


def test_no_part_is_looked_for_where_a_delay_is_the_same_to_first_order() -> None:
    motor = pk.systems.dc_motor()
    sizes, ranges = {"u": 5.0}, {"omega": 100.0}
    assert [e.variant for e in feedthroughs(motor, sizes, ranges)] == ["u,omega"]
    direct = motor.replace(equations={**motor.equations, "omega": motor.formula(
        "k*u/J - b*omega/J", "a test")})
    assert not [*feedthroughs(direct, sizes, ranges)]


@pytest.mark.parametrize("step", [0.01, 0.5])
def test_a_second_mode_is_slower_than_half_the_sampling_rate(step: float) -> None:
    t = np.arange(400) * step
    recording = pk.Recording.from_arrays(
        t, {"u_x": np.sin(t), "theta": 0.1 * np.sin(t)}, {"u_x": "m/s^2", "theta": "rad"})
    [site] = sites(pk.systems.sloshing(), (recording,))
    found = second_mode(site)
    nyquist = np.pi / step
    assert bool(found) == (0.3 * site.rate < nyquist)
    for mode in found:
        low, high = mode.parameters[1].bounds
        assert low < high == min(12 * site.rate, nyquist)
        assert low <= mode.parameters[1].value <= high
