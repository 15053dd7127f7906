"""Stiffness, walls, modes and forces against closed solutions, limiting cases, identities."""

from __future__ import annotations

import numpy as np
import pytest
from concealing import TIGHT, crossings, dense, oracle, period, push, still, weightless

from pikanid.validation.concealed import equations
from pikanid.validation.concealed.rig import Rig
from pikanid.validation.concealed.simulate import measured, motion


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
