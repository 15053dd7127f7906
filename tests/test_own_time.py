"""Parameters of effects are told in the model's own unit of time."""

from __future__ import annotations

import numpy as np
import pytest

import pikanid as pk
from pikanid.mismatch.report.own_time import own_time, told_in
from pikanid.mismatch.report.part import Value, values_of
from pikanid.model.parts import Parameter
from pikanid.recording import Recording


def tank(rate: str = "1/s", flow: str = "m^3/s") -> pk.Model:
    return pk.Model.from_dict({
        "name": "tank", "states": {"h": {"unit": "m", "initial": "free", "guess": 1.0}},
        "inputs": {"q": {"unit": flow}},
        "parameters": {"k": {"unit": rate, "guess": 0.1}, "A": {"unit": "m^2", "value": 2.0}},
        "equations": {"h": "q/A - k*h"}, "outputs": {"y": {"unit": "m", "expression": "h"}}})


def lasting(seconds: float) -> list[Recording]:
    return [Recording.from_arrays(np.linspace(0.0, seconds, 5), {"y": np.zeros(5)})]


@pytest.mark.parametrize(("model", "seconds", "told"), [
    (tank("1/h", "m^3/h"), 60.0, "h"),  # whatever the recording is
    (tank("1/min", "m^3/min"), 1e6, "min"),
    (tank("1/h", "l/min"), 1e6, "s"),  # several
    (tank(), 1e6, "s"),
    (pk.systems.sloshing(), 1e6, "s"),  # rad/s
    (pk.systems.thermal_rc(), 1e6, "d"),  # K/W and J/K hold none
    (pk.systems.thermal_rc(), 60.0, "s")])
def test_the_unit_of_time_is_the_model_s(model: pk.Model, seconds: float, told: str) -> None:
    assert own_time(model, lasting(seconds)) == told


@pytest.mark.parametrize(("unit", "time", "times", "told"), [
    ("1/s", "h", 3600.0, "1/h"), ("s", "min", 1 / 60, "min"), ("m/s^2", "ms", 1e-6, "m/ms^2"),
    ("1/h", "min", 1.0, "1/h"), ("h/s", "h", 1.0, "h/s"), ("", "h", 1.0, ""), ("W", "h", 1.0, "W")])
def test_a_number_and_its_unit_change_together(unit: str, time: str, times: float, told: str
                                               ) -> None:
    factor, name = told_in(unit, time)
    assert (factor, name) == (pytest.approx(times), told)
    p = Parameter("k", 0.0, unit)
    assert values_of((p,), {"k": 2.0}, {"k": 0.1}, 4.0, time=time)["k"] == Value(
        pytest.approx(2 * times), pytest.approx(0.2 * times), told)
