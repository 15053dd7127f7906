"""Delays of inputs and outputs: sub-sample, free, and through jumps, kinks, limits and stiction."""

from __future__ import annotations

from collections.abc import Mapping

import interpreted
import numpy as np
import oracle
import pytest
from comparing import SIGMA, compare

from pikanid.model import Model, Parameter, systems
from pikanid.recording import Recording, excitation
from pikanid.simulation.simulator import Steps

TAU = Parameter("tau", 0.0137, "s", (0.0, 0.1))
LAG = Parameter("late", 0.0231, "s", (0.0, 0.1))
MU = Parameter("mu", 2.0)
Values = Mapping[str, float]


def swing(p: Values, x: np.ndarray, force: float) -> list[float]:
    length = p["l_theta"]
    return [x[1], force / length * np.cos(x[0]) - p["g"] / length * np.sin(x[0])
            - p["d_theta"] / p["m"] * x[1] * np.cos(x[0]) ** 2]


def waves(hold: str, dt: float = 0.02, duration: float = 2.0) -> Recording:
    t = excitation.grid(duration, dt)
    return Recording.from_arrays(t, {"u_x": 0.6 * np.sin(4 * t) + 0.3 * np.sin(9 * t)},
                                 hold={"u_x": hold})


def late_input(recording: Recording, p: Values) -> oracle.Signal:
    channel = recording["u_x"]
    return oracle.Signal(channel.time, channel.values, channel.hold, p["tau"])


@pytest.mark.parametrize("recording", [excitation.two_pulse(2.0, 0.02), waves("zero"),
                                       waves("first")], ids=["pulses", "zero", "first"])
def test_delayed_input(recording: Recording) -> None:
    model = systems.sloshing().map_input("u_x", [TAU], delay="tau")

    def reference(p: Values) -> np.ndarray:
        return oracle.simulate(lambda t, x, u, s: swing(p, x, u[0]), [0, 0], recording.t,
                               [late_input(recording, p)], t0=0.0).x[:, 0]

    found = compare(model, recording, reference)
    assert found.error < 0.05 * SIGMA
    assert found.slope_error < 5e-5


def test_delay_of_many_samples_and_none() -> None:
    """A delay longer than a sample, and of whole samples, and zero, where stops coincide."""
    recording = excitation.two_pulse(2.0, 0.02)
    model = systems.sloshing().map_input("u_x", [TAU], delay="tau")
    for delay in (0.0, 0.02, 0.06, 0.0499999999):
        p = {**model.values, "tau": delay}
        made = interpreted.simulator(model, recording)
        y = made.run(np.array(list(p.values())), None, Steps("explicit", 0.005)).y
        expected = oracle.simulate(lambda t, x, u, s, p=p: swing(p, x, u[0]), [0, 0],
                                   recording.t, [late_input(recording, p)], t0=0.0).x[:, 0]
        assert np.abs(y - expected).max() < 1e-6


def test_another_delay_gets_sub_steps_of_its_own() -> None:
    """Stops of the integrator move with the delay; nothing of the last one may be left."""
    recording = excitation.two_pulse(2.0, 0.02)
    model = systems.sloshing().map_input("u_x", [TAU], delay="tau")
    one, steps = interpreted.simulator(model, recording), Steps("explicit", 0.005)
    for delay in (0.0137, 0.031, 0.02):
        p = np.array(list({**model.values, "tau": delay}.values()))
        fresh = interpreted.simulator(model, recording).run(p, None, steps).y
        assert np.array_equal(one.run(p, None, steps).y, fresh)


def test_delayed_output_shows_the_start_until_the_delay_has_passed() -> None:
    recording = waves("first")
    model = systems.sloshing().with_initial(theta=0.05).map_output(
        "theta", [LAG, Parameter("slope", 0.01)], drift="slope", delay="late")

    def reference(p: Values) -> np.ndarray:
        # the drift is part of the signal that comes late, as is its time
        seen = recording.t - p["late"]
        signal = oracle.Signal(recording.t, recording["u_x"].values, "first")
        x = oracle.simulate(lambda t, x, u, s: swing(p, x, u[0]), [0.05, 0], seen, [signal],
                            t0=0.0).x[:, 0]
        return x + p["slope"] * np.maximum(seen, 0)

    found = compare(model, recording, reference)
    assert found.error < 0.05 * SIGMA
    assert found.slope_error < 5e-5


def test_output_whose_clock_loses() -> None:
    """Late by a share of the time, begun half a second before the record, and twice as a gain."""
    recording = waves("first")
    clock = Parameter("clock", 0.013, "", (-0.1, 0.1))
    model = systems.sloshing().with_initial(theta=0.05).map_output(
        "theta", [clock], delay="0.01 - clock*(t + 0.5)", gain="1 + 2*clock")

    def reference(p: Values) -> np.ndarray:
        seen = recording.t * (1 + p["clock"]) + 0.5 * p["clock"] - 0.01
        signal = oracle.Signal(recording.t, recording["u_x"].values, "first")
        x = oracle.simulate(lambda t, x, u, s: swing(p, x, u[0]), [0.05, 0], seen, [signal],
                            t0=0.0).x[:, 0]
        return (1 + 2 * p["clock"]) * x

    found = compare(model, recording, reference)
    assert found.error < 0.05 * SIGMA
    assert found.slope_error < 5e-5


def test_delays_of_input_and_output_tied_by_one_parameter() -> None:
    """One free number sets both: the late output of a late input, a direct path included."""
    recording = waves("first")
    model = systems.sloshing().map_input("u_x", [TAU], delay="tau")
    model = model.map_output("theta", function="theta + 0.02*u_x", delay="2*tau")

    def reference(p: Values) -> np.ndarray:
        seen = recording.t - 2 * p["tau"]
        path = oracle.simulate(lambda t, x, u, s: swing(p, x, u[0]), [0, 0], seen,
                               [late_input(recording, p)], t0=0.0)
        return path.x[:, 0] + 0.02 * path.u[:, 0]

    found = compare(model, recording, reference, direction={"tau": 0.01, "l_theta": 0.03})
    assert found.error < 0.05 * SIGMA
    assert found.slope_error < 5e-5


@pytest.mark.parametrize("recording", [excitation.two_pulse(2.0, 0.02), waves("zero")],
                         ids=["pulses", "zero"])
def test_delayed_pulses_that_free_a_sticking_pendulum(recording: Recording) -> None:
    """The jump that ends stiction comes late: the mode changes where the delay says."""
    model = systems.sloshing().with_term("theta_dot", "-mu*sign(theta_dot)", [MU])
    model = model.map_input("u_x", [TAU], delay="tau")

    def reference(p: Values) -> np.ndarray:
        def rhs(t: float, x: np.ndarray, u: np.ndarray, s: np.ndarray) -> list[float]:
            rate, push = swing(p, x, u[0])
            return [rate, push - p["mu"] * s[0]]

        return oracle.simulate(rhs, [0, 0], recording.t, [late_input(recording, p)],
                               [lambda t, x, u: x[1]], t0=0.0).x[:, 0]

    found = compare(model, recording, reference)
    assert found.error < 0.05 * SIGMA
    assert found.slope_error < 5e-5


@pytest.mark.parametrize("hold", ["zero", "first"])
def test_delayed_input_that_saturates(hold: str) -> None:
    recording = waves(hold)
    model = systems.sloshing().map_input(
        "u_x", [TAU, Parameter("level", 0.4)], saturation="level", delay="tau")

    def reference(p: Values) -> np.ndarray:
        level = p["level"]
        return oracle.simulate(
            lambda t, x, u, s: swing(p, x, float(np.clip(u[0], -level, level))), [0, 0],
            recording.t, [late_input(recording, p)],
            [lambda t, x, u: u[0] - level, lambda t, x, u: u[0] + level], t0=0.0).x[:, 0]

    found = compare(model, recording, reference)
    assert found.error < 0.05 * SIGMA
    assert found.slope_error < 5e-5


def test_delay_survives_the_model_file_as_the_text_it_is() -> None:
    model = systems.sloshing().map_input("u_x", [TAU], delay="tau")
    assert model.to_dict()["inputs"]["u_x"]["delay"] == "tau"
    assert Model.from_dict(model.to_dict()) == model


def test_delay_that_does_not_move_yet_is_still_free() -> None:
    """A delay tau**2 has no slope at tau = 0; it must have one as soon as tau moves."""
    recording = excitation.two_pulse(1.0, 0.02)
    model = systems.sloshing().map_input("u_x", [Parameter("tau", 0.0)], delay="tau**2")
    made = interpreted.simulator(model, recording)
    p = np.array(list({**model.values, "tau": 0.1}.values()))
    column = np.array([model.parameter_names.index("tau")])
    steps = Steps("explicit", 0.005)
    slope = made.run(p, column, steps).sensitivity[:, 0]

    def shifted(h: float) -> np.ndarray:
        moved = p.copy()
        moved[column] += h
        return made.run(moved, None, steps).y

    expected = oracle.derivative(shifted, 0.0, 1e-4)
    assert np.abs(slope - expected).max() < 1e-4 * np.abs(expected).max()
