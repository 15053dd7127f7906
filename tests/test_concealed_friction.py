"""Every friction and drag against a closed solution, a limiting case or an identity."""

from __future__ import annotations

import numpy as np
import pytest
from concealing import TIGHT, dense, oracle, push, weightless

from pikanid.validation.concealed import equations
from pikanid.validation.concealed.rig import Rig
from pikanid.validation.concealed.simulate import measured


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
