"""Inputs as functions of time, against an event-exact reference; what a model sees of them."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import oracle
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from pikanid import errors, simulate
from pikanid.model import Model
from pikanid.problem.held import PIECES, HeldInput, PiecewiseInput, acting, held_input
from pikanid.problem.problem import Problem, bind
from pikanid.recording import Channel, Recording
from pikanid.recording.resampling import held
from pikanid.validation.concealed import signals

T = np.array([0.2, 0.5, 0.6, 1.1, 1.3])
U = np.array([1.0, -2.0, -2.0, 3.0, 0.5])


@pytest.mark.parametrize("hold", ["zero", "first"])
@pytest.mark.parametrize("delay", [0.0, 0.13])
def test_held_inputs_are_those_of_the_reference(hold: str, delay: float) -> None:
    ours, theirs = HeldInput("u", T, U, hold), oracle.Signal(T, U, hold, delay)  # type: ignore[arg-type]
    t = np.linspace(0.0, 2.0, 401) + 1e-4
    np.testing.assert_allclose(ours.at(t, delay), [theirs.at(x) for x in t], atol=1e-9)
    lines = [theirs.line(x - 1e-7, x + 1e-7) for x in t]
    np.testing.assert_allclose(ours.slope(t, delay), [slope for _, slope in lines], atol=1e-9)
    # between switches the input is a line
    ends = np.concatenate([[0.0], ours.switches + delay, [2.0]])
    for a, b in itertools.pairwise(ends):
        inside = a + (b - a) * np.array([0.05, 0.5, 0.95])
        left, middle, right = ours.at(inside, delay)
        assert middle == pytest.approx((left + right) / 2)
        assert len(set(ours.slope(inside, delay).round(9))) == 1
    np.testing.assert_array_equal(ours.switches, T[[1, 3, 4]] if hold == "zero" else T)


def test_sides_of_a_switch() -> None:
    held = HeldInput("u", T, U, "zero")
    np.testing.assert_array_equal(held.at(T), U)
    np.testing.assert_array_equal(held.at(T, side="left"), [1.0, 1.0, -2.0, -2.0, 3.0])
    pieces = PiecewiseInput(T, U, np.array([1.0, 0.0, 2.0, -1.0, 0.0]))
    np.testing.assert_allclose(pieces.at(T + 0.2, 0.2), U)
    np.testing.assert_allclose(pieces.at(T, side="left"), [1.0, 1.3, -2.0, -1.0, 2.8])
    np.testing.assert_allclose(pieces.at(np.array([0.0, 0.3, 1.0, 9.0])), [1.0, 1.1, -1.2, 0.5])
    np.testing.assert_allclose(pieces.slope(np.array([0.0, 0.35, 1.1, 1.35]), 0.1), [0, 1, 2, -1])
    np.testing.assert_array_equal(pieces.switches, T[1:])
    same = PiecewiseInput(np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0, 2.0]), np.ones(3))
    assert len(same.switches) == 0


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10**6), st.sampled_from(["zero", "first"]), st.floats(0.01, 0.3),
       st.floats(0.0, 1.0), st.floats(0.5, 20.0))
def test_a_model_sees_its_late_input_behind_play_and_limited_rate(
        seed: int, hold: str, delay: float, half: float, rate: float) -> None:
    """Experiment.inputs against the signals of the concealed simulator."""
    t = np.arange(12) * 0.1
    u = np.random.default_rng(seed).normal(size=12)
    model = Model.from_dict({
        "states": {"x": {}}, "equations": {"x": "u*b + r + w"},
        "inputs": {"u": {"delay": "tau", "backlash": "b", "rate_limit": "r"},
                   "w": {"default": 0.7, "delay": "2*tau"}},
        "parameters": {"tau": {"guess": delay}, "b": {"guess": half}, "r": {"guess": rate}},
        "outputs": {"x": {"expression": "x"}}})
    recording = Recording({"u": Channel("u", t, u, hold=hold)})  # type: ignore[arg-type]
    experiment = bind(model, recording, need_outputs=False)
    made = signals.zero_order(t, u) if hold == "zero" else signals.first_order(t, u)
    expected = signals.slewed(signals.played(made, half), rate)
    probe = np.random.default_rng(seed + 1).uniform(0.0, 1.09, 100) + delay
    found = experiment.inputs(probe)
    np.testing.assert_allclose(found[:, 0], expected.at(probe - delay), atol=1e-7)
    np.testing.assert_array_equal(found[:, 1], 0.7)
    breaks = experiment.breakpoints()
    carrier, side, _, ramp, _ = acting(experiment.held[0], half, rate)
    every = np.unique(np.concatenate([p.switches for p in (carrier, side, ramp)]) + delay)
    np.testing.assert_array_equal(breaks, every[(every > 0.0) & (every < 1.1)])


def test_a_simulation_begins_with_the_first_and_ends_with_the_last_of_what_is_used() -> None:
    model = Model.from_dict({
        "states": {"x": {"initial": "u"}}, "equations": {"x": "k*u"}, "inputs": {"u": {}},
        "parameters": {"k": {"guess": 1.0}}, "outputs": {"x": {"expression": "x"}}})
    spare = Channel("spare", [-5.0, 50.0], [0.0, 1.0])
    for first, last in ((0.1, 3.0), (0.3, 0.9)):
        x = Channel("x", np.linspace(first, last, 9), np.arange(9.0))
        e = bind(model, Recording({"u": Channel("u", T, U), "x": x, "spare": spare}))
        assert (e.t0, e.t1) == (min(first, 0.2), max(last, 1.3))
        assert e.unused == ("spare",)
        np.testing.assert_array_equal(e.initial(np.array([1.0])), [1.0])
    alone = bind(model, Recording({"u": Channel("u", T, U)}), need_outputs=False)
    assert (alone.t0, alone.t1) == (0.2, 1.3)
    none = model.replace(inputs=(replace(model.inputs[0], default=2.0),))
    idle = bind(none, Recording({"spare": spare}), need_outputs=False)
    assert (idle.t0, idle.t1) == (-5.0, 50.0)
    np.testing.assert_array_equal(idle.inputs(np.array([0.0])), [[2.0]])


def test_fewer_samples_than_parameters_are_refused() -> None:
    model = Model.from_dict({
        "states": {"x": {"initial": "a"}}, "equations": {"x": "b + c*x"},
        "parameters": {n: {"guess": 1.0} for n in "abc"}, "outputs": {"x": {"expression": "x"}}})
    few = Recording.from_arrays(np.arange(4.0), {"x": np.array([1.0, np.nan, 2.0, np.nan])})
    with pytest.raises(errors.BadRecording, match=r"2.*3|3.*2"):
        Problem(model, few)
    Problem(model, [few, few])


def test_a_smooth_input_is_the_spline_through_its_samples() -> None:
    t = np.sort(np.random.default_rng(3).uniform(0.0, 4.0, 40))
    u = np.sin(5 * t)
    spline = CubicSpline(t, u)
    smooth = held_input("u", t, u, "cubic")
    np.testing.assert_allclose(smooth.at(t), u, atol=1e-12)
    between = np.linspace(t[0], t[-1], 999)
    bend = np.abs(spline(between, 2)).max() * np.diff(t).max() ** 2 / 8
    straight = np.abs(np.interp(between, t, u) - spline(between)).max()
    off = np.abs(smooth.at(between) - spline(between)).max()
    assert off < bend / PIECES**2 and off < straight / 10
    np.testing.assert_allclose(held(t, u, between, "cubic"), spline(between), atol=1e-12)
    assert smooth.at(np.array([t[0] - 1, t[-1] + 1])) == pytest.approx([u[0], u[-1]])


def test_one_sample_is_a_constant_whatever_its_hold() -> None:
    assert held_input("u", np.array([0.3]), np.array([7.0]), "cubic").at(T).tolist() == [7.0] * 5
    assert held([0.3], [7.0], [0.0, 1.0], "cubic").tolist() == [7.0, 7.0]


def test_a_band_limited_input_is_followed_by_a_cubic_hold() -> None:
    """Against DOP853 with the sines themselves, three to ten samples to a period."""
    model = Model.from_dict({
        "states": {"x": {"unit": "m"}, "v": {"unit": "m/s"}}, "inputs": {"u": {"unit": "m/s^2"}},
        "parameters": {"k": {"unit": "1/s^2", "value": 90.0}, "d": {"unit": "1/s", "value": 0.8}},
        "equations": {"x": "v", "v": "u - k*x - d*v"},
        "outputs": {"x": {"unit": "m", "expression": "x"}}})
    rates, t = np.array([6.0, 11.0, 20.0]), 0.1 * np.arange(101)

    def push(s: np.ndarray | float) -> np.ndarray:
        return np.sin(np.multiply.outer(np.asarray(s), rates)).sum(-1)

    truth = solve_ivp(lambda s, z: [z[1], push(s) - 90.0 * z[0] - 0.8 * z[1]], (0, 10), [0.0, 0.0],
                      "DOP853", t, rtol=1e-10, atol=1e-12).y[0]
    off = {hold: np.std(simulate(model, Recording.from_arrays(
        t, {"u": push(t)}, {"u": "m/s^2"}, hold={"u": hold}))["x"].values - truth) / np.std(truth)
        for hold in ("zero", "first", "cubic")}
    assert off["zero"] > 0.3 and off["first"] > 0.05 and off["cubic"] < 0.02
