"""The model file: the fixed form, what is refused, and round trips without loss."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from pikanid import errors
from pikanid.formula.expressions import symbol
from pikanid.model import Input, Model, Output, Parameter, Spline, State, systems

DRIVEN = """
name = "driven pendulum"
[states]
theta     = { unit = "rad", initial = 0.0 }            # a number, or "free" = estimated
theta_dot = { unit = "rad/s", initial = 0.0 }
[inputs]
u_x = { unit = "m/s^2", hold = "zero" }                # "zero" | "first"
[parameters]
l = { unit = "m", guess = 0.06, bounds = [0.005, 0.5], description = "pendulum length" }
g = { unit = "m/s^2", value = 9.81 }                   # value: fixed
[equations]                                            # time derivatives
theta     = "theta_dot"
theta_dot = "u_x/l*cos(theta) - g/l*sin(theta)"
[outputs]
theta = { unit = "rad", expression = "theta" }         # optional: sigma = 0.0017
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "model.toml"


def load(text: str, path: Path) -> Model:
    path.write_text(text)
    return Model.load(path)


def test_the_fixed_form_is_read(path: Path) -> None:
    model = load(DRIVEN, path)
    theta, rate, push = symbol("theta"), symbol("theta_dot"), symbol("u_x")
    length, g = symbol("l"), symbol("g")
    assert model == Model(
        "driven pendulum", (State("theta", "rad"), State("theta_dot", "rad/s")),
        (Input("u_x", "m/s^2"),),
        (Parameter("l", 0.06, "m", (0.005, 0.5), description="pendulum length"),
         Parameter("g", 9.81, "m/s^2", free=False)),
        {"theta": rate, "theta_dot": push / length * sp.cos(theta) - g / length * sp.sin(theta)},
        (Output("theta", theta, "rad"),))


def test_free_initial_states_with_guess_and_bounds(path: Path) -> None:
    model = load(DRIVEN.replace('initial = 0.0 }            #',
                                'initial = "free", guess = 0.2, bounds = [-1, 1] } #'), path)
    assert model.parameter("theta_0") == Parameter(
        "theta_0", 0.2, "rad", (-1.0, 1.0), True, "recording", "initial theta")
    assert model.state("theta").initial == symbol("theta_0")
    model.save(path)
    assert Model.load(path) == model


def test_maps_of_channels_stand_in_the_file(path: Path) -> None:
    text = DRIVEN.replace('hold = "zero" }', 'hold = "first", gain = "k", lag = 0.02, '
                          'saturation = 2, delay = "tau" }')
    text = text.replace('expression = "theta" }', 'expression = "theta", offset = "b", '
                        'clip = [-1, "top"], delay = 0.01 }')
    text = text.replace("[equations]", "k = { guess = 1.1 }\ntau = { guess = 0.01 }\n"
                        "b = { guess = 0.0 }\ntop = { value = 2 }\n[equations]")
    model = load(text, path)
    by_hand = load(DRIVEN, path).map_input(
        "u_x", [Parameter("k", 1.1), Parameter("tau", 0.01)], hold="first", gain="k", lag=0.02,
        saturation=2, delay="tau").map_output(
            "theta", [Parameter("b", 0.0), Parameter("top", 2.0, free=False)], offset="b",
            clip=[-1, "top"], delay=0.01)
    assert model.equations == by_hand.equations
    assert (model.inputs, model.outputs, model.states) == (
        by_hand.inputs, by_hand.outputs, by_hand.states)
    model.save(path)
    assert Model.load(path) == model
    assert tomllib.loads(path.read_text())["inputs"]["u_x"]["delay"] == "tau"


@pytest.mark.parametrize("make", [*systems.SYSTEMS.values()], ids=[*systems.SYSTEMS])
def test_ready_made_models_round_trip(make: object, path: Path) -> None:
    model = make()  # type: ignore[operator]
    model.save(path)
    assert Model.load(path) == model
    assert list(path.parent.iterdir()) == [path]  # nothing temporary is left behind


BROKEN = [
    ("", "no states"),
    ("name = ", "cannot be read"),
    ("name = -k*x", "stands in quotes"),
    ("x" * 100, "cannot be read"),
    (DRIVEN.replace("[equations]", "[equation]"), r"Did you mean 'equations'\?"),
    (DRIVEN.replace("[states]", "[state]"), r"unknown key 'state' .* Did you mean 'states'\?"),
    (DRIVEN.replace("unit = \"rad\", initial", "units = \"rad\", initial"), "'units'"),
    (DRIVEN.replace("guess = 0.06", "gues = 0.06"), "'gues'"),
    *((DRIVEN.replace('unit = "rad", initial', f'{key} = "theta_dot", unit = "rad", initial'),
       rf"states.theta has the unknown key '{key}': .* under \[equations\], as theta = ")
      for key in ("equation", "rhs", "Derivative", "expression")),
    *((DRIVEN.replace(there, written), rf"'{written.split()[0]}' .* Did you mean '{meant}'\?")
      for there, written, meant in (
          ("initial = 0.0 }            #", "start = 0.0 } #", "initial"),
          ("initial = 0.0 }            #", "value = 0.0 } #", "initial"),
          ("initial = 0.0 }            #", "Initial = 0.0 } #", "initial"),
          ("guess = 0.06", "initial = 0.06", "guess"), ("value = 9.81", "constant = 9.81", "value"),
          ("bounds = [", "limits = [", "bounds"), ("description = ", "comment = ", "description"),
          ('expression = "theta"', 'equation = "theta"', "expression"),
          ('expression = "theta"', 'std = 0.1, expression = "theta"', "sigma"),
          ('hold = "zero"', 'interpolation = "zero"', "hold"))),
    (DRIVEN.replace("guess = 0.06, ", ""), "either 'guess'"),
    (DRIVEN.replace("guess = 0.06", "guess = 0.06, value = 1"), "a 'guess' and a 'value'"),
    (DRIVEN.replace("guess = 0.06", "guess = \"0.06\""), "a number"),
    (DRIVEN.replace("guess = 0.06", "guess = true"), "a number"),
    (DRIVEN.replace("guess = 0.06", "guess = nan"), "finite"),
    (DRIVEN.replace("guess = 0.06", "guess = 1" + "0" * 400), "a number"),
    (DRIVEN.replace("[0.005, 0.5]", "[0.005]"), "lower, upper"),
    (DRIVEN.replace("[0.005, 0.5]", "0.5"), "lower, upper"),
    (DRIVEN.replace("[0.005, 0.5]", "[0.1, 0.5]"), "inside its bounds"),
    (DRIVEN.replace("[0.005, 0.5]", "[\"a\", 0.5]"), "a number"),
    (DRIVEN.replace("unit = \"m\"", "unit = 3"), "text in quotes"),
    (DRIVEN.replace('hold = "zero"', 'hold = "none"'), "'zero', 'first' or 'cubic'"),
    (DRIVEN.replace('hold = "zero"', "hold = 1"), "'zero', 'first' or 'cubic'"),
    (DRIVEN.replace('theta_dot = "u_x', 'theta_dott = "u_x'), "not a state"),
    (DRIVEN.replace('theta     = "theta_dot"', ""), "no equation"),
    (DRIVEN.replace('"theta_dot"\n', '"theta_dott"\n'), "theta_dott"),
    (DRIVEN.replace("g/l*sin(theta)", "__import__('os')"), "not allowed"),
    (DRIVEN.replace('theta     = "theta_dot"', "theta = [1]"), "a number"),
    (DRIVEN.replace('expression = "theta"', "sigma = 0.1"), "'expression'"),
    (DRIVEN.replace('expression = "theta"', 'expression = "theta", sigma = 0'), "positive"),
    (DRIVEN.replace('expression = "theta"', 'expression = "theta", sigma = "a"'), "a number"),
    (DRIVEN.replace('expression = "theta"', 'expression = "theta", clip = "a"'), "lo, hi"),
    (DRIVEN.replace('expression = "theta"', 'expression = "theta", clip = 3'), "lo, hi"),
    (DRIVEN.replace('initial = 0.0 }            #', 'initial = "fre" } #'), "fre"),
    (DRIVEN.replace('initial = 0.0 }            #', "initial = [0] } #"), "a number"),
    (DRIVEN.replace("theta     = {", "t = {"), "built-in"),
    (DRIVEN.replace("l = {", "sin = {"), "built-in"),
    (DRIVEN.replace('initial = 0.0 }            #', 'initial = "free" } #').replace(
        "l = {", "theta_0 = {"), "which .parameters. has as well"),
    ("states = 3\n[equations]\nx = \"1\"", "table"),
    ("equations = 3\n[states]\nx = {}", "table"),
    ("[states]\nx = 1\n[equations]\nx = \"1\"", r"'x' under \[states\] is no table"),
    ("[states]\nx = {}\n[outputs]\nx = \"x\"", r"like x = { expression = "),
    *((DRIVEN.replace(f"[{section}]", f"[{section}]\ndomain = \"mechanics\"\n"),
       rf"'domain' stands under \[{section}\].* before the first")
      for section in ("states", "inputs", "parameters", "equations", "outputs")),
    (DRIVEN + "[splines]\ne = { degree = 3 }", "knots"),
    (DRIVEN + "[splines]\ne = { degree = 3.5, knots = [0, 1, 2] }", "integer"),
    (DRIVEN + "[splines]\ne = { degree = 0, knots = [0, 1, 2] }", "degree >= 1"),
    (DRIVEN + "[splines]\ne = { degree = 1, knots = [0, 1, nan] }", "knots"),
    (DRIVEN.replace('name = "driven pendulum"', "name = 3"), "name"),
]


@pytest.mark.parametrize(("text", "message"), BROKEN, ids=[str(k) for k in range(len(BROKEN))])
def test_broken_files_get_one_sentence(text: str, message: str, path: Path) -> None:
    with pytest.raises(errors.BadModel, match=message) as caught:
        load(text, path)
    assert len(str(caught.value).splitlines()) == 1


def test_what_is_no_file_or_no_text(tmp_path: Path) -> None:
    for make in (lambda p: None, lambda p: p.mkdir(), lambda p: p.write_bytes(b"\xff\xfe\x00\x01"),
                 lambda p: p.write_text("a = " + "[" * 5000)):
        target = tmp_path / f"{len(list(tmp_path.iterdir()))}.toml"
        make(target)
        with pytest.raises(errors.BadModel, match="cannot be read"):
            Model.load(target)


def test_numbers_of_numpy_are_saved_as_numbers(path: Path) -> None:
    model = systems.sloshing().with_parameters(
        Parameter("a", np.float64(1.5), bounds=(np.float64(0), np.float64(np.inf))),
        Parameter("b", np.int64(2)))
    model = model.with_spline(Spline("e", 1, tuple(np.linspace(0, 1, 5))))
    model.save(path)
    assert Model.load(path) == model


def test_saving_over_a_file_that_cannot_be_written_leaves_it(tmp_path: Path) -> None:
    with pytest.raises(errors.BadRecording, match="cannot be written"):
        systems.sloshing().save(tmp_path / "absent" / "model.toml")
    assert list(tmp_path.iterdir()) == []


JUNK = st.recursive(
    st.one_of(st.none(), st.booleans(), st.integers(-3, 3), st.floats(), st.text(max_size=8),
              st.sampled_from(["x", "free", "zero", "shared", "x*k", "-k*x", "sin(x)"])),
    lambda inner: st.one_of(st.lists(inner, max_size=3),
                            st.dictionaries(st.sampled_from(
                                ["x", "k", "unit", "initial", "guess", "value", "bounds", "hold",
                                 "expression", "sigma", "degree", "knots", "delay", "gain", "lag",
                                 "clip", "scope", "default", "description"]), inner, max_size=4)),
    max_leaves=8)


@settings(max_examples=150)
@given(st.dictionaries(st.sampled_from(
    ["name", "states", "inputs", "parameters", "equations", "outputs", "splines", "other"]), JUNK,
    max_size=6))
def test_any_content_is_a_model_or_one_kind_of_error(content: dict[str, object]) -> None:
    good = {"states": {"x": {}}, "parameters": {"k": {"guess": 1.0}}, "equations": {"x": "-k*x"},
            "outputs": {"x": {"expression": "x"}}}
    try:
        model = Model.from_dict({**good, **content})
    except errors.BadModel:
        return
    assert Model.from_dict(model.to_dict()) == model


@settings(max_examples=60)
@given(st.floats(-1e12, 1e12), st.floats(0, 1e9), st.booleans(),
       st.sampled_from(["shared", "recording"]),
       # control characters could steer a terminal: they are refused, see test_hostile_models
       st.text(st.characters(exclude_categories=["Cc", "Cs"]), max_size=20),
       st.sampled_from(["", "m", "m/s^2", "rad"]))
def test_parameters_round_trip_to_the_last_bit(value: float, room: float, free: bool, scope: str,
                                               description: str, unit: str) -> None:
    bounds = (value - room - 1, math.inf)
    model = systems.sloshing().with_parameters(
        Parameter("extra", value, unit, bounds, free, scope, description))  # type: ignore[arg-type]
    assert Model.from_dict(model.to_dict()) == model
    text = tomllib.loads(_toml(model))
    assert Model.from_dict(text) == model


def _toml(model: Model) -> str:
    import tomli_w

    return tomli_w.dumps(model.to_dict())
