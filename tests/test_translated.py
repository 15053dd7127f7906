"""Models run from tapes: against compiled models, closed forms and finite differences."""

from __future__ import annotations

import numpy as np
import pytest

from pikanid.model import Model, Output, Parameter, systems
from pikanid.problem.problem import bind
from pikanid.recording import Recording, excitation
from pikanid.simulation.simulator import Simulator, Steps
from pikanid.simulation.structure import Structure
from pikanid.simulation.tape import tape
from pikanid.simulation.translated import Translated

pytestmark = pytest.mark.compiled

FINE = Steps("explicit", 0.0025)


def recorded(model: Model, duration: float = 4.0) -> Recording:
    u = excitation.planar_moves(2, duration)["u_x"]
    y = {o.name: np.sin(u.time) for o in model.outputs}
    return Recording.from_arrays(u.time, {"u_x": u.values, **y}, hold={"u_x": "zero"})


def values(model: Model) -> np.ndarray:
    return np.array(list(model.values.values()))


def test_smooth_model_agrees_with_its_compiled_self() -> None:
    model = systems.sloshing()
    experiment = bind(model, recorded(model))
    p, active = values(model), np.arange(4)
    tape_run = Translated(model, experiment).run(p, active, FINE)
    compiled = Simulator(model, experiment).run(p, active, FINE)
    np.testing.assert_allclose(tape_run.y, compiled.y, atol=1e-14)
    np.testing.assert_allclose(tape_run.sensitivity, compiled.sensitivity, atol=1e-11)


@pytest.mark.parametrize("term, parameters", [
    ("-a*abs(theta_dot)*theta_dot", {"a": 0.3}),
    ("-a*signed_power(theta_dot, n)", {"a": 0.3, "n": 1.5}),
    ("-k*max(theta - w, 0)", {"k": 400.0, "w": 0.04}),
    ("a*exp(-theta**2)*tanh(theta_dot) + a**3/(2 + theta**4)", {"a": 0.7}),
    ("-a*sign(theta_dot)", {"a": 0.4}),
], ids=["drag", "power", "wall", "functions", "friction"])
def test_sensitivities_are_derivatives(term: str, parameters: dict[str, float]) -> None:
    model = systems.sloshing().with_term(
        "theta_dot", term, [Parameter(n, v) for n, v in parameters.items()])
    simulator = Translated(model, bind(model, recorded(model)))
    p = values(model)
    active = np.array([0, 1, *range(4, len(p))])
    steps = Steps("explicit", 0.00125)
    exact = simulator.run(p, active, steps).sensitivity
    for column, k in enumerate(active):
        h = 1e-5 * abs(p[k])
        up, down = p.copy(), p.copy()
        up[k] += h
        down[k] -= h
        slope = (simulator.run(up, steps=steps).y - simulator.run(down, steps=steps).y) / (2 * h)
        np.testing.assert_allclose(exact[:, column], slope,
                                   atol=2e-3 * np.abs(slope).max())


@pytest.mark.parametrize("term, parameters", [
    ("-a*abs(theta_dot)*theta_dot", {"a": 0.3}),
    ("-a*signed_power(theta_dot, n)", {"a": 0.3, "n": 1.5}),
    ("-a*abs_power(theta, n)", {"a": 0.3, "n": 2.5}),
], ids=["drag", "power", "power of the angle"])
def test_an_output_that_shows_a_rate_late_agrees_with_its_compiled_self(
        term: str, parameters: dict[str, float]) -> None:
    """Its slope over time has the slopes of what the laws are made of."""
    nominal = systems.sloshing()
    acc = Output("acc", nominal.equations["theta_dot"], "rad/s^2")
    model = nominal.replace(outputs=(*nominal.outputs, acc)).with_term(
        "theta_dot", term, [Parameter(n, v) for n, v in parameters.items()]).map_output(
        "acc", [Parameter("tau", 0.013, "s")], delay="tau")
    experiment, p = bind(model, recorded(model)), values(model)
    active = np.arange(4, len(p))
    tape_run = Translated(model, experiment, estimated=tuple(active)).run(p, active, FINE)
    compiled = Simulator(model, experiment).run(p, active, FINE)
    # a tape runs through corners that the compiled model stops at
    np.testing.assert_allclose(tape_run.y, compiled.y, atol=1e-5 * np.abs(compiled.y).max())
    for ours, theirs in zip(tape_run.sensitivity.T, compiled.sensitivity.T, strict=True):
        np.testing.assert_allclose(ours, theirs, atol=2e-3 * np.abs(theirs).max())
    assert np.abs(compiled.sensitivity[len(compiled.y) // 2:, -1]).max() > 0.1


def sliding_block() -> tuple[Model, Recording]:
    """x'' = -c sgn x': stops at t = v0/c after v0²/2c."""
    model = Model.from_dict({
        "name": "block", "states": {"x": {}, "v": {"initial": "v0"}},
        "parameters": {"c": {"guess": 2.0}, "v0": {"guess": 1.0}},
        "equations": {"x": "v", "v": "-c*sign(v)"}, "outputs": {"x": {"expression": "x"}}})
    t = np.linspace(0, 1.0, 101)
    return model, Recording.from_arrays(t, {"x": t})


def test_dry_friction_stops_exactly_and_stays() -> None:
    model, recording = sliding_block()
    response = Translated(model, bind(model, recording)).run(
        np.array([2.0, 1.0]), np.array([0, 1]), Steps("explicit", 0.01))
    t = recording.t
    moving = np.minimum(t, 0.5)
    np.testing.assert_allclose(response.y, moving - moving**2, atol=1e-12)
    # where it has stopped: x = v0²/2c, so ∂x/∂c = -1/8 and ∂x/∂v0 = 1/2
    np.testing.assert_allclose(response.sensitivity[-1], [-0.125, 0.5], atol=1e-10)


def test_only_jumps_are_stopped_at() -> None:
    def switches(term: str) -> int:
        model = systems.sloshing().with_term("theta_dot", term, [Parameter("a", 1.0)])
        return tape(Structure(model)).sizes[4]

    assert switches("-a*abs(theta_dot)*theta_dot") == 0
    assert switches("-a*clip(theta, -0.1, 0.1)") == 0
    assert switches("-a*sign(theta_dot)") == 1


def test_delay_of_an_output_moves_it_and_is_differentiated() -> None:
    plain = systems.sloshing()
    model = plain.map_output("theta", [Parameter("tau", 0.03)], delay="tau")
    recording = recorded(plain)
    late = Translated(model, bind(model, recording)).run(values(model), np.array([4]), FINE)
    now = Translated(plain, bind(plain, recording)).run(values(plain), steps=FINE)
    np.testing.assert_allclose(late.y[100:], now.y[97:-3], atol=1e-9)
    slope = np.gradient(now.y, recording.t)[97:-3]
    np.testing.assert_allclose(late.sensitivity[100:, 0], -slope, atol=0.05 * np.abs(slope).max())


def test_stopping_at_a_stiff_wall_needs_no_fine_steps() -> None:
    """Contacts with a wall of 1e4/s² last three samples: run through, its corner leaves an error of
    low order.
    """
    model = systems.sloshing().with_term("theta_dot", "-k*max(theta - w, 0)", [
        Parameter("k", 1e4), Parameter("w", 0.03)])
    experiment = bind(model, recorded(model))
    p = values(model)
    through = Translated(model, experiment)
    stopping = Translated(model, experiment, located=True)
    exact = stopping.run(p, steps=Steps("explicit", 2e-5)).y
    coarse, fine = (float(np.abs(s.run(p, steps=Steps("explicit", h)).y - exact).max())
                    for s, h in ((stopping, 0.00125), (through, 0.00125)))
    assert through.corners and not stopping.corners
    assert coarse < 2e-6
    assert fine > 50 * coarse


def test_a_late_input_that_frees_what_sticks_moves_the_start_of_the_motion() -> None:
    """The derivative by the delay, against a finite difference: at rest until the input jumps."""
    model = Model.from_dict({
        "name": "sledge", "states": {"x": {"unit": "m"}, "v": {"unit": "m/s"}},
        "inputs": {"u": {"unit": "m/s^2", "hold": "zero", "delay": "tau"}},
        "parameters": {"c": {"unit": "m/s^2", "value": 0.8}, "d": {"unit": "1/s", "value": 0.3},
                       "tau": {"unit": "s", "guess": 0.013, "bounds": [0.0, 0.2]}},
        "equations": {"x": "v", "v": "u - c*sign(v) - d*v"},
        "outputs": {"x": {"unit": "m", "expression": "x"}}})
    t = np.arange(0, 2.0, 0.05)
    u = np.where(t < 0.5, 0.0, np.where(t < 1.1, 1.6, np.where(t < 1.5, -1.2, 0.2)))
    drive = Recording.from_arrays(t, {"u": u, "x": t}, units={"u": "m/s^2", "x": "m"})
    simulator = Translated(model, bind(model, drive))
    p, k = values(model), model.parameter_names.index("tau")
    step = 1e-6 * np.eye(len(p))[k]
    found = simulator.run(p, np.array([k]), FINE).sensitivity[:, 0]
    ahead, behind = (simulator.run(p + sign * step, steps=FINE).y for sign in (1, -1))
    assert np.abs(found).max() > 0.1
    np.testing.assert_allclose(found, (ahead - behind) / 2e-6, atol=1e-6)
