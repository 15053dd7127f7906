"""Models as files: round trips, and mistakes in one sentence."""

from __future__ import annotations

import contextlib
import pickle
from pathlib import Path

import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

import pikanid as pk
from pikanid import errors
from pikanid.model_parts import Spline

PENDULUM = """
name = "driven pendulum"
[states]
theta     = { unit = "rad", initial = 0.0 }
theta_dot = { unit = "rad/s", initial = "free" }
[inputs]
u_x = { unit = "m/s^2", hold = "zero", delay = "tau", lag = "T" }
[parameters]
l = { unit = "m", guess = 0.06, bounds = [0.005, 0.5], description = "pendulum length" }
g = { unit = "m/s^2", value = 9.81 }
tau = { unit = "s", guess = 0.01, scope = "recording" }
T = { unit = "s", guess = 0.02, bounds = [1e-4, 1.0] }
[equations]
theta     = "theta_dot"
theta_dot = "u_x/l*cos(theta) - g/l*sin(theta)"
[outputs]
theta = { unit = "rad", expression = "theta", sigma = 0.0017, clip = [-0.2, 0.2] }
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    target = tmp_path / "pendulum.toml"
    target.write_text(PENDULUM)
    return target


def test_the_fixed_form_is_read(path: Path) -> None:
    model = pk.Model.load(path)
    assert model.name == "driven pendulum"
    assert model.free_names == ("l", "tau", "T", "theta_dot_0")
    assert model.parameter("l").bounds == (0.005, 0.5)
    assert model.parameter("tau").scope == "recording"
    assert str(model.input("u_x").delay) == "tau"
    assert model.state_names == ("theta", "theta_dot", "u_x_lag")  # the lag became a state
    assert model.output("theta").sigma == 0.0017


def test_every_operation_comes_back_from_a_file(path: Path, tmp_path: Path) -> None:
    model = pk.Model.load(path)
    model = model.with_term("theta_dot", "-c*sign(theta_dot)", [pk.Parameter("c", 0.1)])
    model = model.with_edge("theta_dot", "theta*theta_dot", Spline("delta", 3, tuple(range(9))))
    model, half = model.with_half_derivative("theta_dot", "memory", (1.0, 100.0), 4)
    model = model.with_term("theta_dot", -sp.Float(0.25) * half)
    model = model.substitute([pk.Parameter("r", 0.01)], l="l*(1 + r*t)")
    model = model.map_input("u_x", gain=1.1, saturation=2.0, dead_zone=0.01, hold="first")
    model = model.map_output("theta", [pk.Parameter("b", 0.0)], offset="b", drift=1e-3, delay=0.004)
    model = model.fix("T").with_bounds(c=(0.0, 5.0)).with_initial(theta="l")
    model.save(tmp_path / "again.toml")
    back = pk.Model.load(tmp_path / "again.toml")
    assert back == model
    assert hash(back) == hash(model)
    assert pickle.loads(pickle.dumps(model)) == model
    assert sorted(p.name for p in tmp_path.iterdir()) == ["again.toml", "pendulum.toml"]


MISTAKES = {
    "unknown symbol": ('"u_x/l*cos(theta)', '"u_x/ll*cos(theta)', "ll"),
    "unknown function": ("cos(theta)", "kos(theta)", "kos"),
    "caret": ("g/l", "g^l", r"\*\*"),
    "code": ("sin(theta)", "__import__('os')", "not allowed"),
    "attribute": ("sin(theta)", "theta.real", "not allowed"),
    "unknown key": ("description", "descripton", "descripton"),
    "no guess": ("guess = 0.06, ", "", "guess"),
    "guess and value": ("value = 9.81", "value = 9.81, guess = 9.0", "either"),
    "text for a number": ("value = 9.81", 'value = "9.81"', "number"),
    "bounds beside the guess": ("[0.005, 0.5]", "[0.1, 0.5]", "bounds"),
    "one bound": ("[0.005, 0.5]", "[0.1]", "bounds"),
    "hold": ('"zero"', '"second"', "hold"),
    "stray equation": ('theta     = "theta_dot"', 'psi = "theta_dot"', "psi"),
    "reserved name": ("g = {", "sin = {", "built-in"),
    "used twice": ("value = 9.81 }", "value = 9.81 }\ntheta = { value = 1.0 }", "both"),
    "no output": ('expression = "theta", ', "", "expression"),
    "negative sigma": ("sigma = 0.0017", "sigma = -1.0", "positive"),
    "not TOML": ("[states]", "[states", "cannot be read"),
    "infinite": ("value = 9.81", "value = inf", "finite"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_one_sentence(path: Path, mistake: str) -> None:
    old, new, expected = MISTAKES[mistake]
    assert old in PENDULUM
    path.write_text(PENDULUM.replace(old, new, 1))
    with pytest.raises(errors.BadModel, match=expected) as failure:
        pk.Model.load(path)
    assert "\n" not in str(failure.value).strip() or mistake == "not TOML"


@pytest.mark.parametrize("content", [b"\x00\xff\x80", b"", b"[" * 5000, "theta = 'θ'".encode()])
def test_junk_is_no_model(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "junk.toml").write_bytes(content)
    with pytest.raises(errors.BadModel):
        pk.Model.load(tmp_path / "junk.toml")
    with pytest.raises(errors.BadModel, match="absent"):
        pk.Model.load(tmp_path / "absent.toml")
    with pytest.raises(errors.BadModel):
        pk.Model.load(tmp_path)


@settings(max_examples=150)
@given(st.binary(max_size=60), st.integers(0, len(PENDULUM) - 1))
def test_no_mutation_of_a_good_file_escapes_as_another_error(junk: bytes, at: int) -> None:
    import tomllib

    text = PENDULUM[:at] + junk.decode("latin-1") + PENDULUM[at + len(junk) // 2:]
    try:
        content = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError):
        return
    with contextlib.suppress(errors.PikanidError):
        pk.Model.from_dict(content)


@pytest.mark.parametrize("name", pk.systems.SYSTEMS)
def test_ready_made_models_round_trip(name: str) -> None:
    model = pk.systems.find(name)
    assert pk.Model.from_dict(model.to_dict()) == model
    assert model.latex().startswith(r"\begin{aligned}")


def test_unknown_system_is_suggested() -> None:
    with pytest.raises(errors.BadModel, match="Did you mean 'sloshing'"):
        pk.systems.find("slushing")
