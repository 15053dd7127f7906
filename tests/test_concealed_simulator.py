"""The compiled integrator against SciPy's own, with the equations written a second time."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from concealing import push
from scipy.integrate import solve_ivp

from pikanid import errors
from pikanid.validation.concealed import equations
from pikanid.validation.concealed.excitations import two_pulse
from pikanid.validation.concealed.experiment import Experiment
from pikanid.validation.concealed.fisher import refit
from pikanid.validation.concealed.rig import DYNAMIC, Rig
from pikanid.validation.concealed.simulate import measured, motion

SETTINGS: dict[str, Any] = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13}


def acceleration(rig: Rig, t: float, theta: float, v: float, u: float) -> float:
    """Smooth part of Eq. (6) with some of the rig's forces."""
    length = rig.length * (1 + rig.length_drift * t)
    damping = rig.damping / rig.mass * v * np.cos(theta) ** 2
    return float(u / length * np.cos(theta) - rig.gravity / length * np.sin(theta) - damping
                 - rig.amplitude_damping * np.sin(theta) ** 2 * v - rig.even * theta**2
                 - rig.cubic * 6 * (theta - np.sin(theta)) - rig.quadratic * abs(v) * v)


def segments(experiment: Experiment) -> list[tuple[float, float, float]]:
    """(from, to, u) of each stretch of constant input."""
    u, t = experiment.u_x, experiment.t
    cuts = [0, *(np.flatnonzero(np.diff(u)) + 1).tolist(), len(t) - 1]
    return [(t[a], t[b], u[a]) for a, b in pairwise(cuts)]


def smooth_oracle(rig: Rig, experiment: Experiment) -> np.ndarray:
    x, theta = np.zeros(2), np.zeros(len(experiment.t))
    for start, stop, u in segments(experiment):
        inside = (experiment.t >= start - 1e-9) & (experiment.t <= stop + 1e-9)
        at = np.clip(experiment.t[inside], start, stop)
        done = solve_ivp(lambda t, x, u=u: [x[1], acceleration(rig, t, x[0], x[1], u)],
                         (start, stop), x, t_eval=at, **SETTINGS)
        theta[inside], x = done.y[0], done.y[:, -1]
    return theta


@pytest.mark.parametrize("rig", [
    Rig(), Rig(amplitude_damping=20.0, even=30.0, cubic=-100.0, length_drift=0.01),
    Rig(length=0.02, damping=0.4)], ids=["nominal", "nonlinear", "fast"])
def test_smooth_rigs_agree_to_1e_10(rig: Rig) -> None:
    e = two_pulse()
    assert np.max(np.abs(measured(rig, e) - smooth_oracle(rig, e))) < 1e-10


def test_reference_peak() -> None:
    """Stepping over the pulses would give a rest: the true peak is 11.34 degrees."""
    assert np.degrees(np.max(measured(Rig(), two_pulse()))) == pytest.approx(11.34, abs=0.005)


def friction_oracle(rig: Rig, experiment: Experiment) -> np.ndarray:
    """Coulomb friction with SciPy's events: slide, come to rest, stay or turn."""
    theta = np.zeros(len(experiment.t))
    x, t, sign = np.zeros(2), 0.0, 0
    for start, stop, u in segments(experiment):
        t = start
        while t < stop - 1e-13:
            if sign == 0:
                free = acceleration(rig, t, x[0], 0.0, u)
                if abs(free) <= rig.coulomb:
                    theta[(experiment.t >= t - 1e-12) & (experiment.t <= stop + 1e-12)] = x[0]
                    t = stop
                    continue
                sign = int(np.sign(free))

            def slide(t: float, x: np.ndarray, u: float = u, sign: int = sign) -> list[float]:
                return [x[1], acceleration(rig, t, x[0], x[1], u) - sign * rig.coulomb]

            def turns(t: float, x: np.ndarray, sign: int = sign) -> float:
                return sign * x[1] + (1e-15 if abs(x[1]) < 1e-15 else 0.0)

            turns.terminal, turns.direction = True, -1  # type: ignore[attr-defined]
            done = solve_ivp(slide, (t, stop), x, events=turns, dense_output=True, **SETTINGS)
            end = done.t[-1]
            inside = (experiment.t >= t - 1e-12) & (experiment.t <= end + 1e-12)
            theta[inside] = done.sol(np.clip(experiment.t[inside], t, end))[0]
            x, t = done.y[:, -1], end
            if done.status == 1:
                x, sign = np.array([x[0], 0.0]), 0
    return theta


@pytest.mark.parametrize("rig", [Rig(coulomb=1.5), Rig(coulomb=8.0, quadratic=1.0)],
                         ids=["weak", "sticks often"])
def test_stick_slip_agrees(rig: Rig) -> None:
    e = two_pulse()
    wanted = friction_oracle(rig, e)
    assert np.max(np.abs(measured(rig, e) - wanted)) < 1e-8


def test_positions_follow_the_order_of_the_rig() -> None:
    for position, field in enumerate(DYNAMIC):
        assert getattr(equations, field.upper()) == position


def test_samples_between_the_knots_do_not_matter() -> None:
    e = two_pulse()
    rig = Rig(coulomb=1.0, wall=0.1, wall_stiffness=1e4, sensor_lag=0.01)
    few, many = e.t[::50], np.linspace(0.0, 5.0, 5001)
    assert motion(rig, e, few) == pytest.approx(motion(rig, e, many)[::500], abs=1e-9)


def test_divergence_is_a_sentence() -> None:
    with pytest.raises(errors.SimulationFailed, match="finite"):
        measured(Rig(cubic=-1e5), push(5.0, 3.0))


def test_a_rig_that_rests_nowhere_is_refused() -> None:
    with pytest.raises(errors.SimulationFailed):
        measured(Rig(bias=400.0), push(5.0, 3.0))
    with pytest.raises(errors.SimulationFailed):
        measured(Rig(bias=-400.0, cogging=0.1, cogging_pitch=20.0), push(5.0, 3.0))


def test_a_rival_that_rests_nowhere_where_its_fit_begins_is_infinitely_far() -> None:
    def response(v: np.ndarray) -> np.ndarray:
        if v[0] > 1.0:
            raise errors.SimulationFailed("")
        return v * np.ones(3)

    free, one = np.array([-9.0]), np.ones(1)
    assert refit(response, np.ones(3), 2 * one, free, -free, one).distance == np.inf
    assert refit(response, np.ones(3), 0 * one, free, -free, one).distance <= 0.01
