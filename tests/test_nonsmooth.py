"""Non-smooth terms against the event-exact reference: values within 0.05 σ, and sensitivities."""

from __future__ import annotations

import interpreted
import numpy as np
import oracle
import pytest
from comparing import SIGMA, compare
from nonsmooth_terms import TERMS, G, Values, by_hand, drive, slosh, velocity

from pikanid import errors
from pikanid.model import Model, Parameter, systems
from pikanid.problem.problem import bind
from pikanid.recording import Recording, excitation
from pikanid.simulation import Simulator, Steps
from pikanid.simulation.synthetic import with_outputs


@pytest.mark.parametrize("name", TERMS)
def test_term_agrees_with_the_event_exact_reference(name: str) -> None:
    term = TERMS[name]
    recording = drive(term.drive)
    found = compare(slosh(term), recording, by_hand(term, recording, recording.t), step=term.step)
    assert found.error < 0.05 * SIGMA
    assert found.slope_error < term.accuracy


@pytest.mark.parametrize("text", [
    "sign(theta_dot)*abs(theta_dot)**1.5", "theta_dot*abs(theta_dot)**0.5",
    "theta_dot*sqrt(abs(theta_dot))", "sign(theta_dot)*abs(theta_dot)**n"])
def test_a_power_of_an_amount_is_zero_where_that_is(text: str) -> None:
    """However it is written: within a step an amount may come out a little below zero."""
    new = [Parameter("q", 0.5), Parameter("n", 1.5)]
    found = []
    for law in (text, "signed_power(theta_dot, n)"):
        model = systems.sloshing().with_term("theta_dot", f"-q*{law}", new)
        simulator = Simulator(model, bind(model, with_outputs(model, drive("pulses"))))
        p = np.array(list(model.values.values()))
        active = np.array([model.parameter_names.index(name) for name in ("l_theta", "q")])
        found.append(simulator.run(p, active, Steps("explicit", 1e-3)))
    np.testing.assert_allclose(found[0].y, found[1].y, rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(found[0].sensitivity, found[1].sensitivity, rtol=1e-9, atol=1e-10)
    assert np.abs(found[0].y).max() > 0.1


# --- several surfaces, outputs, and what steps may miss ------------------------------------------


def test_dry_friction_on_both_axes() -> None:
    model = systems.sloshing_2d().with_term("theta_dot", "-mu*sign(theta_dot)",
                                            [Parameter("mu", 2.0)])
    model = model.with_term("phi_dot", "-nu*sign(phi_dot)", [Parameter("nu", 1.2)])
    t = excitation.grid(1.5, 0.02)
    recording = Recording.from_arrays(
        t, {"u_x": np.where(t < 0.5, 0.8, -0.4), "u_y": 0.5 * np.sin(9 * t)},
        hold={"u_x": "zero", "u_y": "first"})
    signals = [oracle.Signal(t, recording[n].values, recording[n].hold) for n in ("u_x", "u_y")]

    def reference(p: Values) -> np.ndarray:
        def axis(angle: float, rate: float, push: float, friction: float) -> list[float]:
            return [rate, push / p["l_theta"] * np.cos(angle) - G / p["l_theta"] * np.sin(angle)
                    - p["d_theta"] / p["m"] * rate * np.cos(angle) ** 2 - friction]

        x = oracle.simulate(
            lambda t, x, u, s: [*axis(x[0], x[1], u[0], p["mu"] * s[0]),
                                *axis(x[2], x[3], u[1], p["nu"] * s[1])], [0, 0, 0, 0], t, signals,
            [lambda t, x, u: x[1], lambda t, x, u: x[3]], max_step=5e-3).x
        return np.concatenate([x[:, 0], x[:, 2]])

    found = compare(model, recording, reference, step=1e-5)
    assert found.error < 0.05 * SIGMA
    assert found.slope_error < 1e-4


@pytest.mark.slow
def test_block_on_a_block_on_the_ground() -> None:
    """Two friction surfaces that carry each other's force, sticking singly and together."""
    model = Model.from_dict({
        "states": {"x": {}, "v": {}, "y": {}, "w": {}}, "inputs": {"F": {}},
        "parameters": {"mu": {"guess": 1.0}, "nu": {"guess": 0.6}, "k": {"guess": 4.0}},
        "equations": {"x": "v", "v": "F - k*x - mu*sign(v) + nu*sign(w - v)",
                      "y": "w", "w": "-2*nu*sign(w - v)"},
        "outputs": {"x": {"expression": "x"}, "y": {"expression": "y"}}})
    t = np.linspace(0, 6, 121)
    push = 3 * np.sin(1.7 * t) + 2.5 * np.sin(0.6 * t)
    recording = Recording.from_arrays(t, {"F": push}, hold={"F": "first"})

    def reference(p: Values) -> np.ndarray:
        return oracle.simulate(
            lambda t, x, u, s: [x[1], u[0] - p["k"] * x[0] - p["mu"] * s[0] + p["nu"] * s[1],
                                x[3], -2 * p["nu"] * s[1]], [0, 0, 0, 0], t,
            [oracle.Signal(t, push, "first")],
            [lambda t, x, u: x[1], lambda t, x, u: x[3] - x[1]], max_step=5e-3,
            ).x[:, [0, 2]].T.ravel()

    found = compare(model, recording, reference, step=1e-5, tolerance=1e-7)
    assert found.error < 1e-6
    assert found.slope_error < 1e-4


def test_outputs_may_be_clipped_and_show_the_friction_force() -> None:
    """While it sticks the friction force is the load that it carries, not ±μ."""
    term = TERMS["coulomb"]
    model = slosh(term).map_output("theta", [Parameter("top", 0.08)], clip=("-1", "top"))
    model = Model.from_dict({**model.to_dict(), "outputs": {
        **model.to_dict()["outputs"], "force": {"expression": "mu*sign(theta_dot)"}}})
    recording = drive("wave")
    signal = oracle.Signal(recording.t, recording["u_x"].values, "first")

    def reference(p: Values) -> np.ndarray:
        def rhs(t: float, x: np.ndarray, u: np.ndarray, s: np.ndarray) -> list[float]:
            return [x[1], u[0] / p["l_theta"] * np.cos(x[0]) - G / p["l_theta"] * np.sin(x[0])
                    - p["d_theta"] / p["m"] * x[1] * np.cos(x[0]) ** 2 - p["mu"] * s[0]]

        path = oracle.simulate(rhs, [0, 0], recording.t, [signal], [velocity], max_step=5e-3)
        return np.concatenate([np.minimum(path.x[:, 0], p["top"]), p["mu"] * path.s[:, 0]])

    found = compare(model, recording, reference, step=1e-5)
    assert found.error < 0.05 * SIGMA
    assert found.slope_error < 1e-4


@pytest.mark.slow
@pytest.mark.parametrize("wall", [0.9995, 0.999, 0.99])
def test_touch_between_two_steps_is_not_missed(wall: float) -> None:
    """A stiff wall near the turning point: from step to step the swing seems not to reach it."""
    model = Model.from_dict({
        "states": {"x": {}, "v": {"initial": "speed"}},
        "parameters": {"wall": {"guess": wall}, "speed": {"guess": 1.0}},
        "equations": {"x": "v", "v": "-x - 1e5*max(x - wall, 0)"},
        "outputs": {"x": {"expression": "x"}}})
    t = np.insert(np.arange(0, 3, 0.2) + 0.07, 0, 0.0)  # π/2 lies between 1.47 and 1.67
    made = interpreted.simulator(model, Recording.from_arrays(t, {"unused": t}), t)
    p = np.array([wall, 1.0])
    steps = made.choose_steps(p, 1e-5, "explicit")
    found = made.run(p, np.arange(2), steps)

    def reference(p: np.ndarray) -> np.ndarray:
        return oracle.simulate(
            lambda t, x, u, s: [x[1], -x[0] - 1e5 * (x[0] - p[0]) * (s[0] > 0)], [0, p[1]],
            t, guards=[lambda t, x, u: x[0] - p[0]], max_step=1e-3).x[:, 0]

    # where the wall is not felt the swing goes on, 0.03 away or more
    assert np.abs(found.y - reference(p)).max() < 3e-5
    expected = oracle.derivative(lambda h: reference(p + np.array([h, 0])), 0.0, 1e-6)
    assert np.abs(found.sensitivity[:, 0] - expected).max() < 1e-2 * np.abs(expected).max()


@pytest.mark.slow
def test_endless_switching_ends_with_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    """At rest on a jump of the force itself every instant is a switch: it is said, not looped."""
    monkeypatch.setattr("pikanid.simulation.simulator.FINEST", 1)
    model = Model.from_dict({
        "states": {"x": {}, "v": {}}, "parameters": {"k": {"guess": 5.0}},
        "equations": {"x": "v", "v": "-k*sign(x) - 0.1"}, "outputs": {"x": {"expression": "x"}}})
    t = np.linspace(0, 1, 11)
    made = interpreted.simulator(model, Recording.from_arrays(t, {"unused": t}), t)
    response = made.run(np.array([5.0]), None, Steps("explicit", 0.1))
    assert (response.status, response.finished) == (2, False)
    with pytest.raises(errors.SimulationFailed, match="switches without end"):
        made.choose_steps(np.array([5.0]), 1e-3, "explicit")


@pytest.mark.parametrize("name", ["coulomb", "stop", "belt"])
@pytest.mark.slow
def test_implicit_steps_switch_at_the_same_instants(name: str) -> None:
    term = TERMS[name]
    recording = drive(term.drive, duration=0.8)
    found = compare(slosh(term), recording, by_hand(term, recording, recording.t),
                    method="implicit", step=term.step, tolerance=1e-5)
    assert found.steps.method == "implicit"
    assert found.error < 0.05 * SIGMA
    assert found.slope_error < 1e-3


@pytest.mark.compiled
@pytest.mark.slow
def test_compiled_friction_is_the_interpreted_one() -> None:
    """What numba makes of the kernels is what Python makes of them."""
    term, recording = TERMS["coulomb"], drive("pulses")
    model = slosh(term)
    p = np.array(list(model.values.values()))
    simulators = [interpreted.simulator(model, recording),
                  Simulator(model, bind(model, with_outputs(model, recording)))]
    for steps in (Steps("explicit", 0.02), Steps("explicit", 0.004)):
        a, b = (s.run(p, np.arange(5), steps, states=True) for s in simulators)
        np.testing.assert_allclose(a.y, b.y, atol=1e-13)
        np.testing.assert_allclose(a.states, b.states, atol=1e-12)
        np.testing.assert_allclose(a.sensitivity, b.sensitivity, rtol=1e-9, atol=1e-11)
