"""Binding models to recordings: units, holds, missing samples, joint layouts, initial states."""

from __future__ import annotations

import numpy as np
import oracle
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pikanid import errors
from pikanid.model import Model, Parameter, Spline, systems
from pikanid.problem.held import HeldInput
from pikanid.problem.problem import Problem, bind
from pikanid.recording import Channel, Recording, excitation

T = np.array([0.0, 0.1, 0.25, 0.4, 0.5])
PUSH = np.array([0.0, 1.0, 1.0, -2.0, 3.0])
ANGLE = np.array([0.0, 0.1, np.nan, 0.3, 0.2])


def recording(**units: str) -> Recording:
    return Recording.from_arrays(T, {"u_x": PUSH, "theta": ANGLE, "spare": T}, units,
                                 hold={"u_x": "zero"})


# --- held inputs ---------------------------------------------------------------------------------


def test_zero_order_hold_is_right_continuous_and_has_left_limits() -> None:
    held = HeldInput("u", T, PUSH, "zero")
    np.testing.assert_array_equal(held.at(np.array([-1, 0.1, 0.2, 0.4, 0.5, 9])),
                                  [0, 1, 1, -2, 3, 3])
    np.testing.assert_array_equal(held.at(T, side="left"), [0, 0, 1, 1, -2])
    np.testing.assert_array_equal(held.at(T + 0.03, 0.03), PUSH)  # rounding decides nothing
    np.testing.assert_array_equal(held.switches, [0.1, 0.4, 0.5])
    np.testing.assert_array_equal(held.slope(T), 0)


def test_first_order_hold_is_a_line_between_samples_and_constant_outside() -> None:
    held = HeldInput("u", T, PUSH, "first")
    t = np.array([-1, 0.05, 0.2, 0.35, 0.45, 9])
    np.testing.assert_allclose(held.at(t), [0, 0.5, 1, -1, 0.5, 3])
    np.testing.assert_allclose(held.slope(t), [0, 10, 0, -20, 50, 0])
    np.testing.assert_array_equal(held.switches, T)
    straight = HeldInput("u", T, 2 * T + 1, "first")
    np.testing.assert_array_equal(straight.switches, [0.0, 0.5])  # kinks only where it begins, ends


@pytest.mark.parametrize("hold", ["zero", "first"])
def test_an_input_of_one_sample_is_constant(hold: str) -> None:
    held = HeldInput("u", np.array([0.3]), np.array([7.0]), hold)
    np.testing.assert_array_equal(held.at(np.array([-1.0, 0.3, 5.0])), 7)
    np.testing.assert_array_equal(held.slope(np.array([0.0, 1.0])), 0)
    assert len(held.switches) == 0


# --- one recording -------------------------------------------------------------------------------


def test_experiment_as_the_model_sees_it() -> None:
    e = bind(systems.sloshing(), recording())
    assert (e.t0, e.t1, e.n_samples, e.unused) == (0.0, 0.5, 4, ("spare",))
    np.testing.assert_array_equal(e.samples[0].t, [0, 0.1, 0.4, 0.5])
    np.testing.assert_array_equal(e.samples[0].y, [0, 0.1, 0.3, 0.2])
    assert e.samples[0].sigma is None
    np.testing.assert_array_equal(e.inputs(T), np.column_stack([PUSH, np.zeros(5)]))
    np.testing.assert_array_equal(e.breakpoints(), [0.1, 0.4])
    late = bind(systems.sloshing().map_input("u_x", delay=0.02), recording())
    np.testing.assert_allclose(late.breakpoints(), [0.12, 0.42])
    np.testing.assert_array_equal(late.inputs(T)[:, 0], [0, 0, 1, 1, -2])


def test_hold_of_the_recording_comes_before_the_models() -> None:
    model = systems.sloshing().map_input("u_x", hold="first")
    assert bind(model, recording()).held[0].hold == "zero"
    undeclared = Recording.from_arrays(T, {"u_x": PUSH, "theta": ANGLE})
    assert bind(model, undeclared).held[0].hold == "first"
    assert bind(systems.sloshing(), undeclared).held[0].hold == "zero"


def test_sigma_of_the_recording_comes_before_the_models() -> None:
    model = Model.from_dict({**systems.sloshing().to_dict(), "outputs": {
        "theta": {"unit": "rad", "expression": "theta", "sigma": 0.01}}})
    np.testing.assert_array_equal(bind(model, recording()).samples[0].sigma, [0.01] * 4)
    own = recording().with_sigma(theta=np.array([1.0, 2.0, np.nan, 4.0, 5.0]))
    np.testing.assert_array_equal(bind(model, own).samples[0].sigma, [1, 2, 4, 5])


@pytest.mark.parametrize(("change", "error", "message"), [
    (lambda r: r.rename({"u_x": "ux"}), errors.BadRecording, "u_x.*Did you mean 'ux'"),
    (lambda r: r.rename({"theta": "teta"}), errors.BadRecording, "theta.*Did you mean 'teta'"),
    (lambda r: r.with_unit("theta", "m"), errors.BadUnit, "theta"),
    (lambda r: r.with_channels(Channel("u_x", T, ANGLE)), errors.BadRecording, "u_x"),
    (lambda r: r.with_channels(Channel("u_x", T[::-1], PUSH)), errors.BadRecording, "goes back"),
    (lambda r: r.with_channels(Channel("theta", T, np.ones(5))), errors.BadRecording, "theta"),
    (lambda r: r.with_channels(Channel("theta", T, np.full(5, np.nan))), errors.BadRecording,
     "theta"),
    (lambda r: r.with_channels(Channel("theta", T[:1], ANGLE[:1])), errors.BadRecording,
     "theta|sample"),
])
def test_recordings_that_cannot_be_used(change: object, error: type, message: str) -> None:
    with pytest.raises(error, match=message):
        Problem(systems.sloshing(), change(recording()))  # type: ignore[operator]


def test_no_recording_is_an_error() -> None:
    with pytest.raises(errors.BadRecording):
        Problem(systems.sloshing(), [])


# --- several recordings --------------------------------------------------------------------------


def test_layout_of_shared_and_own_parameters() -> None:
    model = systems.sloshing().per_recording("d_theta").with_initial(theta="free")
    problem = Problem(model, [recording(), recording(), recording()])
    assert [f.label for f in problem.free] == [
        "l_theta", "d_theta[0]", "d_theta[1]", "d_theta[2]", "theta_0[0]", "theta_0[1]",
        "theta_0[2]"]
    theta = np.arange(1.0, 8.0)
    np.testing.assert_array_equal(problem.parameters(theta, 1), [1, 3, 0.3, 9.81, 6])
    inside, outside = problem.columns(2)
    np.testing.assert_array_equal(inside, [0, 1, 4])
    np.testing.assert_array_equal(outside, [0, 3, 6])
    np.testing.assert_array_equal(problem.guess, [0.045, 0.15, 0.15, 0.15, 0, 0, 0])
    assert problem.n_samples == 12
    assert problem.lower[0] == 0.002
    assert problem.upper[-1] == np.inf


def test_fixed_parameters_of_every_recording_are_not_estimated() -> None:
    model = systems.sloshing().per_recording("d_theta").fix("d_theta")
    assert [f.label for f in Problem(model, [recording(), recording()]).free] == ["l_theta"]


# --- initial states ------------------------------------------------------------------------------

STARTS = {
    "number": ("0.1", lambda p, u: 0.1),
    "parameters": ("sin(m)*g - m**2", lambda p, u: np.sin(p["m"]) * p["g"] - p["m"] ** 2),
    "inputs": ("atan2(u_x, g)", lambda p, u: np.arctan2(u, p["g"])),
    "clipped": ("clip(u_x, -m, m)", lambda p, u: np.clip(u, -p["m"], p["m"])),
    "kinked": ("abs(max(u_x, m)) - sign(g)", lambda p, u: abs(max(u, p["m"])) - 1),
    "power": ("signed_power(u_x, m)", lambda p, u: np.sign(u) * abs(u) ** p["m"]),
    "negative power": ("signed_power(u_x - 2, m)", lambda p, u: -((2 - u) ** p["m"])),
    "size": ("abs_power(u_x - 2, m)", lambda p, u: (2 - u) ** p["m"]),
}


@pytest.mark.parametrize("name", STARTS)
def test_initial_states_and_their_jacobians(name: str) -> None:
    text, meaning = STARTS[name]
    model = systems.sloshing().with_initial(theta=text)
    e = bind(model, recording().with_channels(Channel("u_x", T, PUSH + 0.5)))
    p = np.array(list(model.values.values()))

    def by_hand(q: np.ndarray) -> float:
        return float(meaning(dict(zip(model.parameter_names, q, strict=True)), 0.5))

    np.testing.assert_allclose(e.initial(p), [by_hand(p), 0], rtol=1e-14)
    jacobian = e.initial_jacobian(p)
    assert jacobian.shape == (2, len(p))
    for k in range(len(p)):
        expected = oracle.derivative(lambda h, k=k: by_hand(p + h * np.eye(len(p))[k]), 0.0, 1e-4)
        assert jacobian[0, k] == pytest.approx(expected, rel=1e-7, abs=1e-9)


def test_a_spline_is_no_initial_value() -> None:
    model = systems.sloshing().with_spline(Spline("law", 1, (0.0, 0.0, 1.0, 1.0)), scale=0.4)
    with pytest.raises(errors.BadModel, match="initial value of 'theta' uses law"):
        model.with_initial(theta="law(m)")


# --- units ---------------------------------------------------------------------------------------


@settings(max_examples=30)
@given(st.sampled_from([("deg", np.pi / 180), ("rad", 1.0), ("mrad", 1e-3),
                        ("arcmin", np.pi / 10800)]),
       st.sampled_from([("m/s^2", 1.0), ("mm/s^2", 1e-3), ("km/h/s", 1 / 3.6), ("g_0", 9.80665)]),
       st.floats(1e-3, 1e3))
def test_units_are_converted_on_the_way_in(angle: tuple[str, float], push: tuple[str, float],
                                           size: float) -> None:
    given_ = Recording.from_arrays(
        T, {"u_x": PUSH * size, "theta": ANGLE * size}, {"u_x": push[0], "theta": angle[0]},
        sigma={"theta": 0.2})
    e = bind(systems.sloshing(), given_)
    np.testing.assert_allclose(e.held[0].values, PUSH * size * push[1], rtol=1e-12)
    np.testing.assert_allclose(e.samples[0].y, ANGLE[np.isfinite(ANGLE)] * size * angle[1],
                               rtol=1e-12)
    np.testing.assert_allclose(e.samples[0].sigma, 0.2 * angle[1], rtol=1e-12)


def test_where_one_side_states_no_unit_numbers_are_taken_as_they_are() -> None:
    bare = Recording.from_arrays(T, {"u_x": PUSH, "theta": ANGLE})
    np.testing.assert_array_equal(bind(systems.sloshing(), bare).held[0].values, PUSH)
    stated = recording(u_x="mm/s^2", theta="deg")
    unitless = Model.from_dict({
        "states": {"theta": {}}, "inputs": {"u_x": {}}, "parameters": {"k": {"guess": 1.0}},
        "equations": {"theta": "k*u_x"}, "outputs": {"theta": {"expression": "theta"}}})
    np.testing.assert_array_equal(bind(unitless, stated).held[0].values, PUSH)


def test_bounds_are_in_the_unit_of_their_parameter() -> None:
    with pytest.raises(errors.BadModel):
        systems.sloshing().with_parameters(Parameter("l_theta", 45.0, "mm", (0.002, 2.0)))
    model = systems.sloshing().with_parameters(Parameter("l_theta", 45.0, "mm", (2.0, 2000.0)))
    assert model.parameter("l_theta").bounds == (2.0, 2000.0)


def test_excitation_alone_binds_without_outputs() -> None:
    e = bind(systems.sloshing(), excitation.two_pulse(), need_outputs=False)
    assert e.samples == ()
    assert (e.t0, e.t1) == (0.0, 5.0)


def test_whole_numbers_as_bounds_and_guesses_are_numbers_like_any() -> None:
    model = Model.from_dict({
        "name": "whole", "states": {"x": {"unit": "m"}}, "equations": {"x": "-k*x"},
        "parameters": {"k": {"guess": 2, "bounds": [0, 100]}},
        "outputs": {"x": {"unit": "m", "expression": "x"}}})
    t = np.arange(9) * 0.1
    problem = Problem(model, Recording.from_arrays(t, {"x": np.exp(-t)}, {"x": "m"}))
    assert {a.dtype for a in (problem.guess, problem.lower, problem.upper)} == {np.dtype(float)}
