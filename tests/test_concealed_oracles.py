"""Every effect against a closed solution, a limiting case or an identity."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from concealing import crossings, period, push, still, weightless

from pikanid.validation.concealed import equations
from pikanid.validation.concealed.effects import CATALOGUE, NEAR, OUTSIDE
from pikanid.validation.concealed.excitations import two_pulse
from pikanid.validation.concealed.experiment import Experiment
from pikanid.validation.concealed.rig import Rig
from pikanid.validation.concealed.simulate import measured, motion

TIGHT = 1e-9
COVERED: set[str] = set()


def oracle(*ids: str) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Marks a test as the oracle of effects, so that none is forgotten."""
    COVERED.update(ids)
    return lambda test: test


def dense(rig: Rig, duration: float, points: int = 20001) -> tuple[np.ndarray, np.ndarray]:
    t = np.linspace(0.0, duration, points)
    return t, motion(rig, still(duration), t)


# --- friction and drag -----------------------------------------------------------------------


@oracle("coulomb_friction")
def test_coulomb_friction_stops_after_v_over_c() -> None:
    t, x = dense(weightless(coulomb=0.4, start_rate=0.5), 2.0)
    stop = 0.5 / 0.4
    moving = np.minimum(t, stop)
    assert x[:, 0] == pytest.approx(0.5 * moving - 0.2 * moving**2, abs=TIGHT)
    assert np.all(x[t > stop, 1] == 0.0)


@oracle("coulomb_friction")
def test_coulomb_friction_takes_the_same_amount_each_half_swing() -> None:
    rig = Rig(damping=0.0, coulomb=0.05, start_angle=2e-3)
    _, x = dense(rig, 6.0, 60001)
    turning = np.abs(x[1:-1, 0][x[1:-1, 1] * x[2:, 1] <= 0])
    drop = 2 * 0.05 * rig.length / rig.gravity
    assert -np.diff(turning[:3]) == pytest.approx(drop, rel=1e-3)
    # In the end it rests, off zero, where friction can hold it.
    assert x[-1, 1] == 0.0
    assert 0 < abs(x[-1, 0]) <= 0.5 * drop


def test_sticking_holds_until_the_push_exceeds_friction() -> None:
    rig = Rig(coulomb=5.0)
    ramp = push(4.0, lambda t: 0.1 * t)  # u/l reaches 5 rad/s² at u = 0.225, t = 2.25 s
    theta = measured(rig, ramp)
    assert np.all(theta[ramp.t <= 2.25] == 0.0)
    assert np.all(theta[ramp.t > 2.3] > 0.0)


@oracle("quadratic_drag")
def test_quadratic_drag_decays_hyperbolically() -> None:
    t, x = dense(weightless(quadratic=0.7, start_rate=-2.0), 5.0)
    assert x[:, 1] == pytest.approx(-2.0 / (1 + 0.7 * 2.0 * t), abs=TIGHT)


@oracle("power_drag")
@pytest.mark.parametrize("n", [1.5, 2.6])
def test_power_drag_decays_by_its_power(n: float) -> None:
    t, x = dense(weightless(power=0.3, exponent=n, start_rate=2.0), 5.0)
    assert x[:, 1] == pytest.approx((2.0 ** (1 - n) - (1 - n) * 0.3 * t) ** (1 / (1 - n)),
                                    abs=TIGHT)


@oracle("power_drag")
def test_power_drag_below_one_stops_in_finite_time() -> None:
    t, x = dense(weightless(power=1.0, exponent=0.5, start_rate=1.0), 3.0)
    assert x[:, 1] == pytest.approx(np.maximum(1 - 0.5 * t, 0) ** 2, abs=3e-4)  # v₀^½/(½ c) = 2 s


@oracle("amplitude_damping")
def test_amplitude_damping_follows_the_averaged_law() -> None:
    c2, start = 60.0, 0.05
    rig = Rig(damping=0.0, amplitude_damping=c2, start_angle=start)
    t, x = dense(rig, 20.0, 40001)
    envelope = np.sqrt(x[:, 0] ** 2 + x[:, 1] ** 2 * rig.length / rig.gravity)
    assert envelope == pytest.approx(start / np.sqrt(1 + c2 * start**2 * t / 4), rel=5e-3)


@oracle("stribeck_friction")
def test_stribeck_friction_rises_at_rest_and_falls_to_coulomb() -> None:
    fast = weightless(coulomb=0.4, stribeck=1.0, stribeck_speed=0.01, start_rate=0.5)
    _, x = dense(fast, 1.0)
    assert x[-1, 1] == pytest.approx(0.5 - 0.4, abs=TIGHT)  # never slow enough to notice
    held = measured(Rig(coulomb=3.0, stribeck=1.0), push(1.0, 0.9 * 6.0 * 0.045))
    assert np.all(held == 0.0)
    slips = measured(Rig(coulomb=3.0, stribeck=1.0), push(1.0, 1.1 * 6.0 * 0.045))
    assert slips[-1] > 0.0


@oracle("one_way_friction")
def test_one_way_friction_brakes_one_way() -> None:
    _, up = dense(weightless(one_way=0.2, start_rate=0.5), 1.0)
    _, down = dense(weightless(one_way=0.2, start_rate=-0.5), 1.0)
    assert up[-1, 1] == pytest.approx(0.3, abs=TIGHT)
    assert down[-1, 1] == pytest.approx(-0.5, abs=TIGHT)


@oracle("hysteresis")
def test_hysteresis_loads_exponentially_and_stores_energy() -> None:
    force, give, start = 2.0, 0.02, 0.6
    _, x = dense(weightless(memory=force, yield_angle=give, start_rate=start), 0.2)
    theta = x[:, 0]
    work = force * (theta - give * (1 - np.exp(-theta / give)))
    assert np.all(np.diff(theta) > 0)
    assert x[:, equations.HYSTERESIS] == pytest.approx(1 - np.exp(-theta / give), abs=TIGHT)
    assert x[:, 1] ** 2 == pytest.approx(start**2 - 2 * work, abs=TIGHT)


@oracle("boundary_layer")
def test_boundary_layer_is_a_half_derivative() -> None:
    s = 1j * np.geomspace(2.0, 40.0, 30)
    terms = equations.WEIGHTS * s[:, None] / (s[:, None] + equations.RATES)
    half = terms.sum(axis=1) + equations.SLOW + equations.FAST * s
    assert np.max(np.abs(half / np.sqrt(s) - 1)) < 2e-3


@oracle("boundary_layer")
def test_boundary_layer_damps_with_the_root_of_frequency() -> None:
    b = 0.02
    for length in (0.09, 0.0225):
        rig = Rig(length=length, damping=0.0, layer=b, start_angle=1e-3)
        t, x = dense(rig, 20.0, 40001)
        omega = np.sqrt(rig.gravity / length)
        envelope = np.hypot(x[:, 0], x[:, 1] / omega)
        rate = -np.polyfit(t[5000:], np.log(envelope[5000:]), 1)[0]
        assert rate == pytest.approx(0.5 * b * np.sqrt(omega / 2), rel=0.03)


# --- stiffness, length, rest -----------------------------------------------------------------


@oracle("cubic_stiffness", "quintic_stiffness", "even_stiffness")
@pytest.mark.parametrize("effect", [{}, {"cubic": 400.0}, {"cubic": -200.0}, {"quintic": 8000.0},
                                    {"even": 150.0}], ids=str)
def test_backbone(effect: dict[str, float]) -> None:
    rig = Rig(damping=0.0, start_angle=0.25, **effect)
    k = rig.gravity / rig.length

    def potential(theta: float) -> float:
        return (k * (1 - np.cos(theta)) + rig.cubic * 6 * (theta**2 / 2 + np.cos(theta) - 1)
                + rig.even * theta**3 / 3 + rig.quintic * theta**6 / 6)

    t, x = dense(rig, 8.0, 400001)
    swing = crossings(t, x[:, 0])
    wanted = period(potential, float(np.min(x[:, 0])), 0.25)
    assert np.mean(np.diff(swing)) == pytest.approx(wanted, rel=2e-6)


@oracle("static_bias")
def test_static_bias_rests_where_gravity_balances_it() -> None:
    theta = measured(Rig(bias=10.0), still(3.0))
    assert theta == pytest.approx(np.arcsin(10.0 * 0.045 / 9.81), abs=TIGHT)


@oracle("parameter_drift")
def test_length_drift_divides_the_push() -> None:
    u, r = 1e-5, 0.3
    t, e = np.linspace(0, 3, 301), push(3.0, 1e-5)
    x = motion(weightless(length_drift=r), e, t)
    assert x[:, 1] == pytest.approx(u / 0.045 / r * np.log1p(r * t), rel=1e-6)


@oracle("parameter_drift")
def test_damping_drift_integrates() -> None:
    t, x = dense(Rig(gravity=0.0, damping=0.15, damping_drift=0.4, start_rate=1e-4), 4.0)
    assert x[:, 1] == pytest.approx(1e-4 * np.exp(-0.5 * (t + 0.2 * t**2)), rel=1e-6)


@oracle("wobbling_length")
def test_wobbling_length_at_a_standstill_of_the_wobble() -> None:
    # Very slow: after a quarter of the wobble's period, l is l (1 + ε).
    e = push(1.0, 1e-6)
    late = motion(weightless(wobble=0.2, wobble_rate=1e-3), e, e.t)[-1, 1]
    assert late == pytest.approx(1e-6 / 0.045 * (1 - 0.2 * 1e-3 / 2), rel=1e-6)


@oracle("initial_state")
def test_initial_state_moves_off_straight() -> None:
    t, x = dense(weightless(start_angle=0.02, start_rate=-0.1), 1.0)
    assert x[:, 0] == pytest.approx(0.02 - 0.1 * t, abs=TIGHT)


# --- walls, modes, forces --------------------------------------------------------------------


@oracle("wall_impact")
def test_elastic_wall_returns_the_speed_after_half_a_period() -> None:
    k, v, wall = 1e4, 0.5, 0.1
    t, x = dense(weightless(wall=wall, wall_stiffness=k, start_rate=v), 1.0)
    touch, leave = wall / v, wall / v + np.pi / np.sqrt(k)
    inside = (t > touch) & (t < leave)
    bounce = wall + v / np.sqrt(k) * np.sin(np.sqrt(k) * (t - touch))
    assert x[inside, 0] == pytest.approx(bounce[inside], abs=TIGHT)
    assert x[-1, 1] == pytest.approx(-v, abs=TIGHT)


@oracle("hard_stop")
def test_hard_stop_returns_a_share_of_the_speed() -> None:
    t, x = dense(weightless(stop=0.1, restitution=0.6, start_rate=0.5), 1.0)
    assert x[:, 0] == pytest.approx(np.minimum(0.5 * t, 0.1 - 0.3 * (t - 0.2)), abs=TIGHT)


def test_hard_stop_carries_a_steady_push_and_lets_go() -> None:
    u = push(4.0, lambda t: np.where(t < 2.0, 2.0, 0.0))
    theta = measured(Rig(stop=0.1, restitution=0.3), u)
    assert theta[(u.t > 1.5) & (u.t < 2.0)] == pytest.approx(0.1, abs=1e-12)
    assert np.max(theta) <= 0.1 + 1e-12
    assert theta[-1] < 0.09


def _step_response(t: np.ndarray, omega: float, zeta: float) -> np.ndarray:
    """x'' + 2ζωx' + ω²x = 1 from rest."""
    wd = omega * np.sqrt(1 - zeta**2)
    decay = np.exp(-zeta * omega * t)
    return (1 - decay * (np.cos(wd * t) + zeta * omega / wd * np.sin(wd * t))) / omega**2


@oracle("second_mode")
def test_second_mode_beats_with_the_first() -> None:
    u = 1e-5
    e = push(10.0, u)
    first = np.sqrt(9.81 / 0.045)
    rig = Rig(mode_gain=3.0, mode_rate=1.1 * first, mode_damping=0.01)
    y = measured(rig, e)
    wanted = u / 0.045 * _step_response(e.t, first, 0.5 / 2 / first)
    wanted = wanted + 3.0 * u * _step_response(e.t, 1.1 * first, 0.01)
    assert y == pytest.approx(wanted, abs=1e-6 * np.max(np.abs(wanted)))


@oracle("internal_resonance")
def test_internal_resonance_conserves_energy_and_exchanges_it() -> None:
    rig = Rig(damping=0.0, internal=200.0, mode_rate=2 * np.sqrt(9.81 / 0.045), mode_damping=0.0,
              start_angle=0.1)
    _, x = dense(rig, 10.0)
    theta, v, q, w = x[:, [0, 1, equations.MODE, equations.MODE + 1]].T
    energy = (0.5 * v**2 + 0.5 * w**2 + rig.gravity / rig.length * (1 - np.cos(theta))
              + 0.5 * rig.mode_rate**2 * q**2 - 0.5 * 200.0 * theta**2 * q)
    assert energy == pytest.approx(energy[0], rel=1e-8)
    assert np.max(np.abs(q)) > 0.01


@oracle("cross_axis")
def test_cross_axis_acts_as_that_much_of_the_drive() -> None:
    along = measured(Rig(), push(2.0, 0.3 * 0.8))
    assert measured(Rig(leak_y=0.3), push(2.0, u_y=0.8)) == pytest.approx(along, abs=TIGHT)
    tilted = measured(Rig(), push(2.0, 9.81 * np.sin(0.5 * 0.02)))
    assert measured(Rig(leak_pitch=0.5), push(2.0, pitch=0.02)) == pytest.approx(tilted, abs=TIGHT)


@oracle("disturbance")
def test_disturbance_gives_its_impulse() -> None:
    t, x = dense(weightless(bump=3.0, bump_time=0.5, bump_width=0.4), 1.0)
    assert np.all(x[t < 0.3, 1] == 0.0)
    assert x[t > 0.7, 1] == pytest.approx(0.5 * 3.0 * 0.4, abs=TIGHT)


@oracle("background_vibration")
def test_background_vibration_integrates() -> None:
    t, x = dense(weightless(vibration=2.0, vibration_rate=7.0), 3.0)
    assert x[:, 1] == pytest.approx(2.0 / 7.0 * (1 - np.cos(7.0 * t)), abs=TIGHT)


@oracle("turbulence")
def test_turbulence_is_one_of_many_repeatable_forces() -> None:
    same = [measured(Rig(turbulence=0.5, turbulence_key=key), still(3.0)) for key in (4, 4, 5)]
    assert np.array_equal(same[0], same[1])
    assert np.max(np.abs(same[0] - same[2])) > 1e-3
    double = measured(weightless(turbulence=1.0, turbulence_key=4), still(3.0))
    single = measured(weightless(turbulence=0.5, turbulence_key=4), still(3.0))
    assert double == pytest.approx(2 * single, abs=TIGHT)


@oracle("velocity_coupled_drive")
def test_velocity_coupled_drive_grows_exponentially() -> None:
    u, kappa = 1e-4, 5e3
    t, e = np.linspace(0, 2, 201), push(2.0, 1e-4)
    x = motion(weightless(bilinear=kappa), e, t)
    assert x[:, 1] == pytest.approx(np.expm1(kappa * u * t) / kappa / 0.045, rel=1e-5, abs=1e-9)


# --- input and sensor ------------------------------------------------------------------------


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


def test_every_effect_has_an_oracle() -> None:
    assert {effect.id for effect in (*CATALOGUE, *NEAR, *OUTSIDE)} == COVERED
