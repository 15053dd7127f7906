"""Simulation of smooth models against the reference, in every arrangement of channels."""

from __future__ import annotations

import interpreted
import numpy as np
import oracle
import pytest
from comparing import SIGMA, compare
from hypothesis import given, settings
from hypothesis import strategies as st

import pikanid as pk
from pikanid import errors
from pikanid.model import Model, Parameter, systems
from pikanid.problem.problem import bind
from pikanid.recording import Channel, Recording, excitation
from pikanid.simulation import Simulator, Steps, VectorField
from pikanid.simulation.simulator import SPARE, Response, _foretold

pytestmark = pytest.mark.compiled


def swing(x: np.ndarray, u: float, length: float = 0.045, damping: float = 0.5) -> list[float]:
    return [x[1], u / length * np.cos(x[0]) - 9.81 / length * np.sin(x[0])
            - damping * x[1] * np.cos(x[0]) ** 2]


def slosh_reference(recording: Recording, t: np.ndarray, t0: float | None = None) -> np.ndarray:
    channel = recording["u_x"]
    return oracle.simulate(lambda t, x, u, s: swing(x, u[0]), [0, 0], t, [oracle.Signal(
        channel.time, channel.values, channel.hold or "zero")], t0=t0).x[:, 0]


# --- the reference itself ------------------------------------------------------------------------


def test_reference_solves_a_linear_oscillator() -> None:
    t = np.linspace(0, 5, 101)
    x = oracle.simulate(lambda t, x, u, s: [x[1], -9 * x[0]], [1, 0], t).x[:, 0]
    np.testing.assert_allclose(x, np.cos(3 * t), atol=1e-9)


def test_reference_knows_dry_friction() -> None:
    """x'' = -x - μ sgn x' from 1: every half turn takes 2μ off, then it sticks for good."""
    mu, t = 0.15, np.linspace(0, 14, 281)
    path = oracle.simulate(lambda t, x, u, s: [x[1], -x[0] - mu * s[0]], [1, 0], t,
                           guards=[lambda t, x, u: x[1]])
    turns = np.floor(t / np.pi)
    sign = np.where(turns % 2, -1.0, 1.0)
    expected = sign * (mu + (1 - mu - 2 * mu * turns) * np.cos(t - turns * np.pi))
    moving = t < 3 * np.pi  # after three half turns |x| = 0.1 < μ
    np.testing.assert_allclose(path.x[moving, 0], expected[moving], atol=1e-9)
    np.testing.assert_allclose(path.x[~moving, 0], -0.1, atol=1e-9)
    np.testing.assert_allclose(path.s[~moving, 0], 0.1 / mu, atol=1e-8)  # friction carries the load


# --- the study's profile -------------------------------------------------------------------------


def test_study_profile_compiled_to_the_wanted_accuracy() -> None:
    recording = excitation.two_pulse()
    ours = pk.simulate(systems.sloshing(), recording)["theta"].values
    expected = slosh_reference(recording, recording.t)
    assert np.degrees(np.abs(expected).max()) == pytest.approx(11.34, abs=0.005)
    assert np.abs(ours - expected).max() < 1e-10


def test_step_choice_keeps_its_promise() -> None:
    recording = excitation.two_pulse()
    model = systems.sloshing()
    simulator = Simulator(model, bind(model, recording.with_channels(
        Channel("theta", recording.t, recording.t))))
    p, expected = np.array(list(model.values.values())), slosh_reference(recording, recording.t)
    for tolerance in (1e-3, 1e-5, 1e-8, 1e-10):
        steps = simulator.choose_steps(p, tolerance)
        error = np.abs(simulator.run(p, None, steps).y - expected).max()
        assert error < 1.5 * tolerance
        assert steps.error <= tolerance


def test_a_gap_in_the_samples_does_not_hide_the_error_in_all_other_intervals() -> None:
    t = np.concatenate([[0.0], np.linspace(0.4, 3, 27)])  # 10 Hz, at rest in the gap
    push = Channel("u_x", [0.0, 0.5, 0.8, 3.0], [0.0, 2.0, 0.0, 0.0], hold="zero")
    recording = Recording({"u_x": push, "theta": Channel("theta", t, np.sin(t))})
    model = systems.sloshing().with_values(d_theta=0.9)
    simulator = Simulator(model, bind(model, recording))
    p = np.array(list(model.values.values()))
    expected = oracle.simulate(lambda t, x, u, s: swing(x, u[0], damping=3.0), [0, 0], t,
                               [oracle.Signal(push.time, push.values, "zero")]).x[:, 0]
    for tolerance in (1e-3, 1e-6):
        steps = simulator.choose_steps(p, tolerance)
        assert np.abs(simulator.run(p, None, steps).y - expected).max() < 1.5 * tolerance


def test_pulse_shorter_than_a_sample_is_not_stepped_over() -> None:
    """An input of its own, finer time base: 3 ms of push between samples 0.1 s apart."""
    push = Channel("u_x", [0.0, 0.3141, 0.3171, 2.0], [0.0, 40.0, 0.0, 0.0], hold="zero")
    t = np.linspace(0, 2, 21)
    recording = Recording({"u_x": push})
    ours = pk.simulate(systems.sloshing(), recording, t=t)["theta"].values
    assert np.abs(ours).max() > 0.1
    np.testing.assert_allclose(ours, slosh_reference(recording, t, 0.0), atol=1e-8)


def test_hold_is_physics() -> None:
    t = excitation.grid(2.0, 0.05)
    wave = np.sin(9 * t)
    found = {}
    for hold in ("zero", "first"):
        recording = Recording.from_arrays(t, {"u_x": wave}, hold={"u_x": hold})
        found[hold] = pk.simulate(systems.sloshing(), recording)["theta"].values
        np.testing.assert_allclose(found[hold], slosh_reference(recording, t), atol=1e-8)
    assert np.abs(found["zero"] - found["first"]).max() > 20 * SIGMA


def test_output_that_shows_an_input_jumps_with_it_also_at_the_last_sample() -> None:
    t = np.arange(6) * 0.1
    u = np.array([0.0, 1.0, 1.0, -2.0, 3.0, 7.0])
    model = Model.from_dict({
        "states": {"x": {}}, "inputs": {"u": {}}, "equations": {"x": "u"},
        "outputs": {"y": {"expression": "u"}, "x": {"expression": "x"}}})
    made = interpreted.simulator(model, Recording.from_arrays(t, {"u": u}, hold={"u": "zero"}))
    y = made.run(np.empty(0)).y
    np.testing.assert_allclose(y[:6], u)
    np.testing.assert_allclose(y[6:], np.concatenate([[0], np.cumsum(u[:-1]) * 0.1]), atol=1e-14)


# --- arrangements of channels --------------------------------------------------------------------


def test_outputs_on_their_own_time_bases_with_gaps() -> None:
    """A 500 Hz motion, a 60 Hz camera that drops frames, and a gyroscope that starts late."""
    motion = excitation.two_pulse(1.5, 0.002)
    camera, gyro = np.arange(0.004, 1.5, 1 / 60), 0.3 + np.arange(400) * 0.0031
    model = Model.from_dict({**systems.sloshing().to_dict(), "outputs": {
        "rate": {"expression": "theta_dot"}, "theta": {"expression": "theta"}}})
    seen = np.sin(camera)
    seen[[0, 5, 6, 40]] = np.nan
    recording = motion.with_channels(Channel("rate", gyro, np.sin(gyro)),
                                     Channel("theta", camera, seen))
    simulator = interpreted.simulator(model, recording)
    y = simulator.run(np.array(list(model.values.values())), None, Steps("explicit", 0.002)).y
    kept = camera[np.isfinite(seen)]
    assert len(y) == len(gyro) + len(kept)
    signal = [oracle.Signal(motion.t, motion["u_x"].values)]
    for times, k, part in ((gyro, 1, y[:len(gyro)]), (kept, 0, y[len(gyro):])):
        expected = oracle.simulate(lambda t, x, u, s: swing(x, u[0]), [0, 0], times, signal,
                                   t0=0.0).x[:, k]
        np.testing.assert_allclose(part, expected, atol=1e-7)


def test_start_is_the_first_instant_of_anything_used() -> None:
    t = 3.0 + excitation.grid(1.0, 0.02)
    recording = Recording.from_arrays(t, {"u_x": np.sin(5 * t), "theta": np.cos(t),
                                          "other": t}, hold={"u_x": "zero"})
    experiment = bind(systems.sloshing(), recording.shift("other", -2.0).shift("theta", 0.5))
    assert (experiment.t0, experiment.t1) == (3.0, 4.5)
    assert experiment.unused == ("other",)


def test_model_without_inputs_and_without_parameters() -> None:
    model = Model.from_dict({"states": {"a": {"initial": 1.0}, "b": {"initial": 0.0}},
                             "equations": {"a": "b", "b": "-4*a"},
                             "outputs": {"y": {"expression": "a"}}})
    t = np.linspace(1.0, 3.0, 41)
    made = interpreted.simulator(model, Recording.from_arrays(t, {"anything": t}), t)
    response = made.run(np.empty(0), states=True)
    np.testing.assert_allclose(response.y, np.cos(2 * (t - 1)), atol=1e-7)
    assert response.sensitivity.shape == (41, 0)
    np.testing.assert_allclose(VectorField(model).rhs(
        t, response.states, np.empty((41, 0)), np.empty(0)), np.stack(
            [response.states[:, 1], -4 * response.states[:, 0]], axis=1))


CLASHING = ("p", "s", "f", "g", "S", "b", "w", "y", "J", "h", "a", "k", "n", "act", "mode", "math",
            "np", "sgn", "rhs", "called", "T", "U", "V", "N", "fp", "dS", "ud", "begin", "log_abs_",
            "spline_basis", "KNOTS_0", "Work", "lambda_", "E", "I", "Q", "beta", "gamma", "zeta",
            "v", "q_x", "e0", "int", "float", "abs_", "range", "len")


def test_names_of_the_generated_code_are_free_to_the_user() -> None:
    """A state x, an input u, and parameters named like everything inside the generated module."""
    sums = " + ".join(CLASHING)
    model = Model.from_dict({
        "states": {"x": {"initial": 0.1}, "s0": {}}, "inputs": {"u": {}},
        "parameters": {n: {"guess": 0.01 * (k + 1)} for k, n in enumerate(CLASHING)},
        "equations": {"x": f"s0 - ({sums})*x + a*abs(x - S)", "s0": "u - p*x - y*s0*b"},
        "outputs": {"x": {"expression": "x + J*s0*w"}}})
    t = np.linspace(0, 1, 26)
    recording = Recording.from_arrays(t, {"u": np.sin(4 * t)}, hold={"u": "zero"})

    def reference(p: dict[str, float]) -> np.ndarray:
        total = sum(p[n] for n in CLASHING)
        path = oracle.simulate(
            lambda t, x, u, s: [x[1] - total * x[0] + p["a"] * s[0] * (x[0] - p["S"]),
                                u[0] - p["p"] * x[0] - p["y"] * x[1] * p["b"]],
            [0.1, 0], t, [oracle.Signal(t, np.sin(4 * t))],
            [lambda t, x, u: x[0] - p["S"]])
        return path.x[:, 0] + p["J"] * path.x[:, 1] * p["w"]

    found = compare(model, recording, reference, tolerance=1e-9)
    assert found.error < 1e-8
    assert found.slope_error < 1e-7


def test_parameters_that_depend_on_time() -> None:
    model = systems.sloshing().substitute([Parameter("drain", -0.1)],
                                          l_theta="l_theta*(1 + drain*t)")
    recording = excitation.two_pulse(2.0, 0.02)
    signal = oracle.Signal(recording.t, recording["u_x"].values)

    def reference(p: dict[str, float]) -> np.ndarray:
        return oracle.simulate(
            lambda t, x, u, s: swing(x, u[0], p["l_theta"] * (1 + p["drain"] * t),
                                     p["d_theta"] / p["m"]), [0, 0], recording.t, [signal]).x[:, 0]

    found = compare(model, recording, reference)
    assert found.error < 0.05 * SIGMA
    assert found.slope_error < 5e-5


# --- failures ------------------------------------------------------------------------------------


def test_steps_after_an_escape_are_not_foretold() -> None:
    """An error of 1e83 says nothing of the order's steps, some 1e-23 of those in use."""
    def refuse(steps: Steps, _: bool) -> Response:
        raise AssertionError(steps)

    assert _foretold(refuse, 4e-7, Steps("explicit", 1e-3, 1.5e83), 0.0, 1.0) is None


def test_steps_are_foretold_again_from_the_error_that_is_found() -> None:
    """The error of the known steps was worked out too small: the first answer is not enough."""
    tried: list[float] = []

    def trial(steps: Steps, likely: bool) -> Response:
        tried.append(steps.longest)
        return Response(np.array([1.0 + steps.longest**4]), *[np.empty(0)] * 3)

    known = Steps("explicit", 0.1, 0.1**4 / 5)
    found = _foretold(trial, 1e-6, known, 0.0, 1.0)
    assert found is not None and found.error == pytest.approx(found.longest**4) and (
        found.error <= 1e-6)
    assert sorted(set(tried)) == pytest.approx(
        [0.1 * (1e-6 / (SPARE * e)) ** 0.25 for e in (0.1**4, known.error)] + [0.1])


def test_steps_below_the_finest_are_not_foretold() -> None:
    """One start of many that asks for far shorter steps would take most of a fit's time."""
    def steps(finest: float) -> Steps | None:
        return _foretold(lambda s, _: Response(np.array([1.0 + s.longest**4]), *[np.empty(0)] * 3),
                         1e-13, Steps("explicit", 1e-2, 1e-8), finest, 1.0)

    found = steps(0.0)
    assert found is not None and 1e-4 < found.longest < 1e-3
    assert steps(0.99 * found.longest) == found
    assert steps(1.01 * found.longest) is None


def test_trajectory_that_escapes_is_a_bad_step_not_a_crash(
        monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pikanid.simulation.simulator.FINEST", 8)  # give up sooner
    model = Model.from_dict({"states": {"x": {"initial": 1.0}}, "parameters": {"k": {"guess": 1.0}},
                             "equations": {"x": "k*x**2"}, "outputs": {"x": {"expression": "x"}}})
    t = np.linspace(0, 2, 41)
    recording = Recording.from_arrays(t, {"x": t})
    made = interpreted.simulator(model, recording)
    response = made.run(np.array([1.0]), np.array([0]), Steps("explicit", 0.01))
    assert not response.finished
    assert 0.9 < response.stopped_at < 1.3  # x = 1/(1 - t)
    with pytest.raises(errors.SimulationFailed, match=r"near t = .* s at k = 1"):
        made.choose_steps(np.array([1.0]), method="explicit")


def test_noise_and_its_seed() -> None:
    model, recording = systems.sloshing(), excitation.two_pulse()
    clean = pk.simulate(model, recording)
    noisy = pk.simulate(model, recording, sigma=SIGMA, seed=3)
    assert clean["theta"].sigma is None
    assert noisy["theta"].sigma == SIGMA
    assert pk.simulate(model, recording, sigma={"theta": SIGMA}, seed=3) == noisy
    assert pk.simulate(model, recording, sigma=SIGMA, seed=4) != noisy
    added = noisy["theta"].values - clean["theta"].values
    np.testing.assert_allclose(added, np.random.default_rng(3).normal(0, SIGMA, 501), atol=1e-12)


def test_missing_input_is_an_error_unless_it_has_a_default() -> None:
    recording = excitation.two_pulse().rename({"u_x": "u_xx"})
    with pytest.raises(errors.BadRecording, match=r"u_x.*Did you mean 'u_xx'"):
        pk.simulate(systems.sloshing(), recording)
    assert "u_z" not in pk.simulate(systems.sloshing(), excitation.two_pulse())


@settings(max_examples=15)
@given(st.integers(0, 2**31), st.sampled_from(["zero", "first"]), st.floats(0.004, 0.05))
def test_random_inputs_on_random_times_agree_with_the_reference(
        seed: int, hold: str, step: float) -> None:
    rng = np.random.default_rng(seed)
    times = np.cumsum(rng.uniform(0.002, 0.08, 30))
    recording = Recording.from_arrays(times, {"u_x": rng.normal(0, 3, 30)}, hold={"u_x": hold})
    t = np.sort(rng.uniform(times[0], times[-1] + 0.1, 25))
    made = interpreted.simulator(systems.sloshing(), recording, t)
    ours = made.run(np.array([0.045, 0.15, 0.3, 9.81]), None, Steps("explicit", step)).y
    expected = slosh_reference(recording, t, min(times[0], t[0]))
    # the classical Runge-Kutta error at this frequency: (ωh)^4 of the amplitude, per 120
    limit = 1e-8 + (14.8 * step) ** 4 / 20 * np.abs(expected).max()
    assert np.abs(ours - expected).max() < limit


def test_stops_that_no_parameter_moves_are_laid_out_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a model that only equals one that was simulated before, too."""
    recording = excitation.two_pulse()
    first, second = (Simulator(m, bind(m, recording, need_outputs=False))
                     for m in (systems.sloshing(), systems.sloshing()))
    p = np.array([0.045, 0.15, 0.3, 9.81])
    assert first.acting == second.model and first.acting is not second.model
    monkeypatch.setattr("pikanid.simulation.simulator.delays", None)
    assert second.grid(p) is second.grid(1.1 * p)
