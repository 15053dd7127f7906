"""Forward sensitivities of smooth models: initial states, lags, memory, several outputs, all p."""

from __future__ import annotations

from collections.abc import Mapping

import interpreted
import numpy as np
import oracle
import pytest
from comparing import compare
from hypothesis import given, settings
from hypothesis import strategies as st

from pikanid.formula.expressions import symbol
from pikanid.model import Model, Parameter, State, systems
from pikanid.model.half_derivative import design
from pikanid.problem.problem import bind
from pikanid.recording import Channel, Recording, excitation
from pikanid.simulation import Simulator, Steps

pytestmark = pytest.mark.compiled

Values = Mapping[str, float]


def swing(p: Values, x: np.ndarray, ux: float, uz: float = 0.0) -> list[float]:
    length = p["l_theta"]
    return [x[1], ux / length * np.cos(x[0]) - (p["g"] - uz) / length * np.sin(x[0])
            - p["d_theta"] / p["m"] * x[1] * np.cos(x[0]) ** 2]


def waves(duration: float = 1.5, dt: float = 0.02) -> Recording:
    t = excitation.grid(duration, dt)
    return Recording.from_arrays(t, {"u_x": 0.6 * np.sin(4 * t), "u_z": np.cos(7 * t)},
                                 hold={"u_x": "first", "u_z": "zero"})


def signals(recording: Recording) -> list[oracle.Signal]:
    return [oracle.Signal(c.time, c.values, c.hold) for c in recording.channels.values()]


def test_every_column_of_the_compiled_sensitivities() -> None:
    """Fixed parameters too: any of them may be freed without compiling anew."""
    model, recording = systems.sloshing(), excitation.two_pulse(2.0, 0.02)
    signal = [oracle.Signal(recording.t, recording["u_x"].values)]
    simulator = Simulator(model, bind(model, recording.with_channels(
        Channel("theta", recording.t, recording.t))))
    p = np.array(list(model.values.values()))
    found = simulator.run(p, np.arange(4), Steps("explicit", 0.0025)).sensitivity
    for k, name in enumerate(model.parameter_names):
        def reference(h: float, name: str = name) -> np.ndarray:
            q = {**model.values, name: model.values[name] * (1 + h)}
            return oracle.simulate(lambda t, x, u, s: swing(q, x, u[0]), [0, 0], recording.t,
                                   signal).x[:, 0]

        expected = oracle.derivative(reference, 0.0, 1e-3) / p[k]
        assert np.abs(found[:, k] - expected).max() < 1e-6 * np.abs(expected).max()
    alone = simulator.run(p, np.array([2]), Steps("explicit", 0.0025)).sensitivity
    np.testing.assert_allclose(alone[:, 0], found[:, 2], rtol=1e-12, atol=1e-15)


def test_initial_states_free_fixed_and_by_formula() -> None:
    """Hanging at the angle of a constant push: θ(0) = atan(u/g) + offset; θ'(0) estimated."""
    model = systems.sloshing().with_parameters(Parameter("offset", 0.02))
    model = model.with_initial(theta="atan2(u_x + 1, g) + offset", theta_dot="free")
    model = model.with_values(theta_dot_0=0.4).free("g")
    recording = waves()

    def reference(p: Values) -> np.ndarray:
        start = [np.arctan2(recording["u_x"].values[0] + 1, p["g"]) + p["offset"],
                 p["theta_dot_0"]]
        return oracle.simulate(lambda t, x, u, s: swing(p, x, u[0], u[1]), start, recording.t,
                               signals(recording)).x[:, 0]

    found = compare(model, recording, reference)
    assert found.error < 1e-6
    assert found.slope_error < 1e-5


def test_lagging_input_and_output() -> None:
    """Both lags start in equilibrium with what they follow."""
    model = systems.sloshing().with_initial(theta=0.03)
    model = model.map_input("u_x", [Parameter("actuator", 0.04)], lag="actuator")
    model = model.map_output("theta", [Parameter("sensor", 0.02), Parameter("gain", 1.1)],
                             lag="sensor", gain="gain")
    recording = waves()

    def reference(p: Values) -> np.ndarray:
        def rhs(t: float, x: np.ndarray, u: np.ndarray, s: np.ndarray) -> list[float]:
            return [*swing(p, x, x[2], u[1]), (u[0] - x[2]) / p["actuator"],
                    (x[0] - x[3]) / p["sensor"]]

        start = [0.03, 0, recording["u_x"].values[0], 0.03]
        return p["gain"] * oracle.simulate(rhs, start, recording.t, signals(recording)).x[:, 3]

    found = compare(model, recording, reference)
    assert found.error < 1e-6
    assert found.slope_error < 1e-5


def test_outputs_of_two_coupled_axes() -> None:
    model = systems.sloshing_2d().map_output("phi", [Parameter("cross", 0.1)],
                                             function="phi + cross*theta_dot")
    t = excitation.grid(1.0, 0.02)
    recording = Recording.from_arrays(t, {"u_x": np.sin(6 * t), "u_y": np.cos(5 * t) - 1},
                                      hold={"u_x": "first", "u_y": "zero"})

    def reference(p: Values) -> np.ndarray:
        x = oracle.simulate(
            lambda t, x, u, s: [*swing(p, x[:2], u[0]), *swing(p, x[2:], u[1])], [0, 0, 0, 0], t,
            signals(recording)).x
        return np.concatenate([x[:, 0], x[:, 2] + p["cross"] * x[:, 1]])

    found = compare(model, recording, reference)
    assert found.error < 1e-6
    assert found.slope_error < 1e-5


def test_half_derivative_is_simulated_and_differentiated_like_any_state() -> None:
    model, half = systems.sloshing().with_half_derivative("theta_dot", "memory", (2.0, 200.0), 4)
    model = model.with_term("theta_dot", -half * symbol("b"), [Parameter("b", 1.5)])
    recording = excitation.two_pulse(1.0, 0.02)
    signal = [oracle.Signal(recording.t, recording["u_x"].values)]
    filters = design((2.0, 200.0), 4)

    def reference(p: Values) -> np.ndarray:
        def rhs(t: float, x: np.ndarray, u: np.ndarray, s: np.ndarray) -> list[float]:
            gaps = x[1] - x[2:]
            rate, push = swing(p, x, u[0])
            push -= p["b"] * (filters.constant * x[1] + float(filters.weights @ gaps))
            return [rate, push, *(filters.rates * gaps)]

        return oracle.simulate(rhs, np.zeros(6), recording.t, signal).x[:, 0]

    found = compare(model, recording, reference)
    assert found.error < 1e-6
    assert found.slope_error < 1e-5


@pytest.mark.parametrize("method", ["explicit", "implicit"])
def test_sensitivities_belong_to_the_discrete_solution_itself(method: str) -> None:
    """With coarse steps the solution is inexact, but its derivative is exactly its derivative."""
    model = systems.duffing_oscillator()
    recording = waves(1.0, 0.05).rename({"u_x": "u"}).with_unit("u", "N")
    made = interpreted.simulator(model, recording)
    p, steps = np.array(list(model.values.values())), Steps(method, 0.05)
    found = made.run(p, np.arange(4), steps).sensitivity
    for k in range(4):
        def along(h: float, k: int = k) -> np.ndarray:
            q = p.copy()
            q[k] += h
            return made.run(q, None, steps).y

        expected = oracle.derivative(along, 0.0, 1e-3 * p[k])
        assert np.abs(found[:, k] - expected).max() < 1e-8 * max(np.abs(expected).max(), 1e-3)


FORCES = ("a*x*y", "a*sin(y*b)", "exp(-a*x**2)*b", "a*tanh(b*x) - y", "u*cos(a*x)", "b*t*x",
          "a*atan2(y, 1 + x**2)", "log(1 + a*x**2)*b", "sqrt(1 + (b*y)**2)*a", "x/(1 + (b*x)**2)*u")


@settings(max_examples=12)
@given(st.lists(st.sampled_from(FORCES), min_size=1, max_size=3, unique=True),
       st.lists(st.sampled_from(FORCES), min_size=1, max_size=3, unique=True),
       st.floats(0.3, 2.0), st.floats(-1.5, -0.3))
def test_random_models_have_exact_sensitivities(first: list[str], second: list[str], a: float,
                                                b: float) -> None:
    """Derivatives of the discrete solution by differences: no reference, only consistency."""
    model = Model.from_dict({
        "states": {"x": {"initial": "b/2"}, "y": {"initial": 0.2}}, "inputs": {"u": {}},
        "parameters": {"a": {"guess": a}, "b": {"guess": b}},
        "equations": {"x": " + ".join(["y - x", *first]), "y": " + ".join(["-4*x - y", *second])},
        "outputs": {"z": {"expression": "x + a*y**2"}}})
    t = np.linspace(0, 0.6, 13)
    recording = Recording.from_arrays(t, {"u": np.sin(8 * t)}, hold={"u": "first"})
    made = interpreted.simulator(model, recording)
    p, steps = np.array([a, b]), Steps("explicit", 0.05)
    found = made.run(p, np.arange(2), steps).sensitivity
    for k in range(2):
        def along(h: float, k: int = k) -> np.ndarray:
            q = p.copy()
            q[k] += h
            return made.run(q, None, steps).y

        expected = oracle.derivative(along, 0.0, 1e-3)
        assert np.abs(found[:, k] - expected).max() < 1e-7 * max(np.abs(expected).max(), 1.0)


def test_state_added_by_hand_starts_from_its_formula() -> None:
    model = systems.pendulum().with_parameters(Parameter("tau", 0.3))
    model = model.with_state(State("heat", "", 0.5), "(theta_dot**2 - heat)/tau")
    assert model.state_names[-1] == "heat"
    assert Model.from_dict(model.to_dict()) == model
