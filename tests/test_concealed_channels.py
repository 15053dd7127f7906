"""What inputs and sensors do, against closed solutions, limiting cases and identities."""

from __future__ import annotations

import numpy as np
import pytest
from concealing import TIGHT, oracle, push, still, weightless

from pikanid.validation.concealed.excitations import two_pulse
from pikanid.validation.concealed.experiment import Experiment
from pikanid.validation.concealed.rig import Rig
from pikanid.validation.concealed.simulate import measured, motion


@oracle("input_delay", "sensor_delay")
@pytest.mark.parametrize("field", ["input_delay", "sensor_delay"])
def test_delay_is_an_exact_shift(field: str) -> None:
    nominal = measured(Rig(), two_pulse())
    late = measured(Rig(**{field: 0.07}), two_pulse())
    assert late[7:] == pytest.approx(nominal[:-7], abs=TIGHT)
    assert np.all(late[:7] == 0.0)


def test_delays_are_twins_between_the_samples_too() -> None:
    first, second = (measured(Rig(**{field: 0.0123}), two_pulse())
                     for field in ("input_delay", "sensor_delay"))
    assert first == pytest.approx(second, abs=TIGHT)


@oracle("actuator_lag")
def test_actuator_lag_answers_a_step() -> None:
    u, tau = 1e-4, 0.05
    t, e = np.linspace(0, 1, 101), push(1.0, 1e-4)
    x = motion(weightless(actuator_lag=tau), e, t)
    assert x[:, 1] == pytest.approx(u / 0.045 * (t - tau * (1 - np.exp(-t / tau))), rel=1e-6,
                                    abs=1e-12)


@oracle("sensor_lag")
def test_sensor_lag_trails_a_ramp() -> None:
    tau, e = 0.05, still(1.0)
    y = measured(weightless(sensor_lag=tau, start_rate=0.2), e)
    assert y == pytest.approx(0.2 * (e.t - tau * (1 - np.exp(-e.t / tau))), abs=TIGHT)


@oracle("input_gain", "input_saturation", "input_dead_zone", "soft_saturation")
@pytest.mark.parametrize("effect", [
    {"input_gain": 0.8}, {"input_limit": 0.8}, {"dead_zone": 0.2},
    {"soft_limit": 1.0, "input_gain": 0.8 / np.tanh(1.0)}], ids=str)
def test_on_equal_pulses_every_static_input_is_a_gain(effect: dict[str, float]) -> None:
    pulses = two_pulse()
    weak = Experiment("test", pulses.t, 0.8 * pulses.u_x, pulses.u_y, pulses.pitch, 0.2)
    assert measured(Rig(**effect), pulses) == pytest.approx(measured(Rig(), weak), abs=TIGHT)


@oracle("sensor_gain", "sensor_offset", "sensor_drift", "sensor_saturation",
        "sensor_nonlinearity")
def test_sensor_is_algebra() -> None:
    e = two_pulse()
    s = measured(Rig(), e)
    rig = Rig(sensor_gain=1.1, sensor_cubic=2.0, sensor_low=-0.05, sensor_high=0.1, offset=0.01,
              sensor_drift=0.002)
    wanted = np.clip(1.1 * (s + 2.0 * s**3), -0.05, 0.1) + 0.01 + 0.002 * e.t
    assert np.array_equal(measured(rig, e), wanted)


@oracle("clock_error")
def test_clock_error_stretches_time() -> None:
    y = measured(weightless(clock=0.01, start_rate=0.1), still(2.0))
    assert y == pytest.approx(0.1 * 1.01 * still(2.0).t, abs=TIGHT)


@oracle("input_hold")
def test_input_hold_integrates_straight_lines() -> None:
    e = push(1.0, lambda t: 1e-5 * t)
    stairs = motion(weightless(), e, e.t)[:, 1]
    lines = motion(weightless(first_order_hold=1.0), e, e.t)[:, 1]
    assert lines == pytest.approx(1e-5 / 0.045 * e.t**2 / 2, rel=1e-9, abs=1e-15)
    assert stairs == pytest.approx(1e-5 / 0.045 * (e.t**2 - 0.01 * e.t) / 2, rel=1e-9, abs=1e-15)


@oracle("rate_limited_input")
def test_rate_limited_input_ramps_up() -> None:
    t, e = np.linspace(0, 1, 101), push(1.0, lambda t: np.where(t >= 0.1, 1e-4, 0.0))
    x = motion(weightless(slew=2e-4), e, t)
    ramp = np.clip(t - 0.1, 0.0, 0.5)
    wanted = 2e-4 * ramp**2 / 2 + 1e-4 * np.clip(t - 0.6, 0.0, None)
    assert x[:, 1] * 0.045 == pytest.approx(wanted, rel=1e-6, abs=1e-13)


@oracle("hysteresis")
def test_backlash_loses_the_play() -> None:
    pulses = two_pulse()
    # +1 is followed up to 0.8, back to 0 up to 0.2: the play leaves an offset behind.
    theta = measured(Rig(backlash=0.2), pulses)
    u = np.where(pulses.t < 0.2, 0.0, np.where(pulses.t < 0.6, 0.8, np.where(
        pulses.t < 1.2, 0.2, np.where(pulses.t < 1.6, -0.8, -0.2))))
    same = Experiment("test", pulses.t, u, pulses.u_y, pulses.pitch, 0.2)
    assert theta == pytest.approx(measured(Rig(), same), abs=TIGHT)
