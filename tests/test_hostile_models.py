"""Model files from strangers: a model or one sentence, whatever stands in them; no code runs."""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy as sp
from hostile import CODE, MARK, VALUES, cut, nothing_evaluated, walk

from pikanid import errors
from pikanid.formula.expressions import parse, to_real
from pikanid.mismatch.catalogue.between import effects_between
from pikanid.mismatch.catalogue.sites import sites
from pikanid.model import Input, Model, Output, Parameter, State
from pikanid.model.rates import in_rates
from pikanid.recording import Recording

__all__ = ["nothing_evaluated"]

FULL: dict[str, Any] = {
    "name": "full",
    "states": {"x": {"unit": "m", "initial": "free", "guess": 0.1, "bounds": [-1.0, 1.0],
                     "scope": "shared"},
               "v": {"unit": "m/s", "initial": "k"}},
    "inputs": {"u": {"unit": "V", "hold": "first", "default": 0.5, "backlash": "k",
                     "backlash_start": 0.5, "rate_limit": 2.0, "past": 0.1, "gain": "k",
                     "offset": 0.1, "saturation": "3*k", "dead_zone": 0.01,
                     "function": "u**3", "lag": "k", "delay": 0.1}},
    "parameters": {"k": {"unit": "1/s", "guess": 0.5, "bounds": [0.0, 10.0], "scope": "recording",
                         "description": "rate"},
                   "c": {"value": 2.0}},
    "equations": {"x": "v", "v": "u - k*x + edge(v)"},
    "outputs": {"y": {"unit": "m", "expression": "x", "sigma": 0.1, "lag": "k", "gain": "c",
                      "offset": 0.0, "drift": "k", "function": "y + 1", "clip": [-1.0, "c"],
                      "delay": "k/10"}},
    "splines": {"edge": {"degree": 1, "knots": [0.0, 0.0, 1.0, 2.0, 2.0]}},
    "effects": {"store": {
        "name": "a hidden store", "family": "mode", "twins": ["second_mode"],
        "parameters": {"e": {"unit": "1/s^2", "guess": 0.1, "bounds": [0.0, 9.0],
                             "scope": "recording", "description": "exchange"}, "a": {"guess": 1.0}},
        "null": {"e": 0.0}, "add": {"v": "e*(z - x)"}, "replace": {"x": "v", "c": "c + e"},
        "states": {"z": {"unit": "m", "initial": "k", "equation": "x - z"}},
        "inputs": {"u": {"gain": "1 + e"}}, "outputs": {"y": {"clip": [-1.0, "a"]}},
        "initial": {"v": "k + e"}},
        "leak": {
            "name": "a leak of {x}", "for": {"x": "state"}, "family": "drag", "twins": [],
            "parameters": {"l": {"unit": "1/s", "guess": "1/duration", "bounds": [0.0, "x_high"]}},
            "null": {"l": 0.0}, "add": {"x": "-l*x"},
            "states": {"w": {"unit": "{x}", "initial": "x_start", "equation": "x"}}}},
}


def used(content: Any) -> None:
    """A model that can be shown, saved and read again, or one sentence of sensible length."""
    try:
        model = Model.from_dict(content)
    except (errors.BadModel, errors.BadUnit) as problem:
        text = str(problem)
        assert 10 < len(text) < 3000, text[:200]
        assert text.isprintable(), text[:200]
        return
    # as text: of numbers below 1e-300 SymPy keeps more digits than a float has
    assert Model.from_dict(model.to_dict()).to_dict() == model.to_dict()
    assert model.latex()
    assert repr(model)


def test_the_example_holds_every_key() -> None:
    from pikanid.model.file_keys import KEYS

    used(FULL)
    assert Model.from_dict(FULL).name == "full"
    for section, keys in KEYS.items():
        present = {key for entry in FULL[section].values() for key in entry}
        # a state that is free has no description of its own
        assert set(keys) - present <= {"description"}, section


@pytest.mark.usefixtures("nothing_evaluated")
@pytest.mark.parametrize("value", VALUES)
def test_every_place_of_a_model(value: str, tmp_path: Path,
                                monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for _, content in walk(FULL, VALUES[value]):
        used(content)
    assert list(tmp_path.iterdir()) == []


def test_every_entry_may_lack() -> None:
    for _, content in cut(FULL):
        used(content)


@pytest.mark.parametrize("line", [
    f'delay = ["{CODE}"]', f'gain = {{ a = "{CODE}" }}', "delay = [1]", "gain = true",
    "gain = nan", "gain = inf", "hold = ['zero']", "lag = 2020-02-29",
    "offset = 1979-05-27T07:32:00",
])
def test_what_ran_or_crashed_in_a_model_file(line: str, tmp_path: Path,
                                             monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "model.toml"
    path.write_text("[states]\nx = {}\n[equations]\nx = 'u - x'\n[outputs]\n"
                    "x = { expression = 'x' }\n[inputs.u]\n" + line)
    with pytest.raises(errors.BadModel, match="must be"):
        Model.load(path)
    assert not (tmp_path / MARK).exists()


@pytest.mark.parametrize("degree", [-(10**400), 10**400, -1, 0, 21, True, 1.5])
def test_degree_of_a_spline_makes_no_endless_list(degree: Any) -> None:
    content = {**FULL, "splines": {"edge": {"degree": degree, "knots": [0.0, 1.0, 2.0, 3.0]}}}
    with pytest.raises(errors.BadModel, match="spline 'edge'"):
        Model.from_dict(content)


@pytest.mark.usefixtures("nothing_evaluated")
@pytest.mark.parametrize("value", [
    [CODE], {"a": CODE}, {CODE}, (CODE,), None, True, float("nan"), float("inf"), 10**400, object(),
    sp.true, sp.Symbol("x") > 0])
def test_only_formulas_become_formulas(value: Any) -> None:
    with pytest.raises(errors.BadModel, match="formula"):
        to_real(value)
    x = sp.Symbol("x", real=True)
    for make in (
            lambda: Model("m", (State("x", initial=value),), (), (), {"x": x}, (Output("x", x),)),
            lambda: Model("m", (State("x"),), (), (), {"x": value}, (Output("x", x),)),
            lambda: Model("m", (State("x"),), (), (), {"x": x}, (Output("x", value),)),
            lambda: Model("m", (State("x"),), (Input("u", delay=value),), (), {"x": x},
                          (Output("x", x),))):
        with pytest.raises(errors.BadModel):
            make()


@pytest.mark.parametrize("parameter", [
    Parameter("k", "1"), Parameter("k", True), Parameter("k", 10**400),  # type: ignore[arg-type]
    Parameter("k", 1.0, unit=3), Parameter("k", 1.0, bounds=(0,)),  # type: ignore[arg-type]
    Parameter("k", 1.0, bounds=("0", 2)), Parameter(["k"], 1.0),  # type: ignore[arg-type]
    Parameter("k" * 1000, 1.0), Parameter("k", 1.0, description="\x1b[2J")])
def test_parts_of_a_model_made_in_python(parameter: Parameter) -> None:
    x = sp.Symbol("x", real=True)
    with pytest.raises(errors.BadModel) as caught:
        Model("m", (State("x"),), (), (parameter,), {"x": x}, (Output("x", x),))
    assert len(str(caught.value)) < 600


NAMES = [f"p{k}" for k in range(2500)]


@pytest.mark.parametrize("text", [
    "*".join(NAMES), "/".join(NAMES[:1500]),
    "".join(f"max({n}*x, " for n in NAMES[:60]) + "x" + ")" * 60,
    "dead_zone(" * 30 + "x" + ", p1)" * 30,
    "+".join("log(" * 20 + n + ")" * 20 for n in NAMES[:200]),
    "(" * 30 + "2*x" + ")**8*3" * 30,
    "(" * 100 + "2*x" + "**1000)" * 100,
    "abs(x*p1 - " * 40 + "x" + ")" * 40,
])
def test_formulas_that_would_take_for_ever(text: str) -> None:
    with pytest.raises(errors.BadModel, match="formula of f"):
        parse(text, {*NAMES, "x"}, "f")


def test_many_formulas_cost_together() -> None:
    """Each is fine alone: the file as a whole would keep SymPy busy for minutes."""
    names = [f"x{k}" for k in range(300)]
    rhs = " + ".join(f"max(min({n}, p), -p)*abs({n})" for n in names[:4])
    content = {"states": {n: {} for n in names}, "parameters": {"p": {"value": 1.0}},
               "equations": {n: f"-{n} + {rhs}*{k}" for k, n in enumerate(names)},
               "outputs": {"x0": {"expression": "x0"}}}
    with pytest.raises(errors.BadModel, match="too complicated"):
        Model.from_dict(content)


def test_a_large_model_of_a_person_still_loads() -> None:
    """A chain of 40 masses with dry friction: far within the limits."""
    n = 40
    states = {f"x{k}": {} for k in range(n)} | {f"v{k}": {} for k in range(n)}
    rhs = {f"x{k}": f"v{k}" for k in range(n)} | {
        f"v{k}": f"(x{max(k - 1, 0)} - 2*x{k} + x{min(k + 1, n - 1)})*c - d*sign(v{k}) - "
                 f"g*sin(x{k})*cos(v{k})" for k in range(n)}
    model = Model.from_dict({
        "states": states, "equations": rhs, "outputs": {"x0": {"expression": "x0"}},
        "parameters": {"c": {"guess": 1.0}, "d": {"guess": 1.0}, "g": {"value": 9.81}}})
    assert len(model.states) == 2 * n


def test_every_sentence_shortens_what_others_wrote() -> None:
    """Also those of tomorrow: whatever is put into a message comes out short and printable."""
    awful = ["a" * 10**6, CODE * 1000, "\x1b]0;title\x07\n\u202e", [CODE] * 10_000, 10**400,
             [["a" * 10**6] * 100] * 100]
    checked = 0
    for name, sentence in vars(errors).items():
        if not hasattr(sentence, "__wrapped__"):  # see test_errors: every sentence is
            continue
        count = len([p for p in inspect.signature(sentence).parameters.values()
                     if p.kind is not p.KEYWORD_ONLY])
        for value in awful:
            try:
                text = sentence(*[value] * count)
            except (TypeError, ValueError, AttributeError, KeyError, IndexError):
                continue  # a number was wanted where a text stands: no caller does that
            assert len(text) < 6000, name
            assert text.isprintable(), (name, text[:100])
            checked += 1
    assert checked > 300


def test_toml_nested_without_end(tmp_path: Path) -> None:
    path = tmp_path / "model.toml"
    for text in ("a = " + "[" * 100_000, "a = " + "{a=" * 3000 + "1" + "}" * 3000,
                 "[" + "a." * 3000 + "a]\n", 'name = "' + "x" * 10**6 + '"',
                 "x = 0x" + "f" * 10**5, "name = " + "9" * 5000):
        path.write_text(text)
        with pytest.raises(errors.BadModel) as caught:
            Model.load(path)
        assert len(str(caught.value)) < 1000


def endless(rate: str) -> Model:
    """Two masses; the second one's rate is what a file says."""
    return Model.from_dict({
        "states": {n: {"unit": u} for n, u in
                   (("x", "m"), ("v", "m/s"), ("y", "m"), ("w", "m/s"))},
        "parameters": {n: {"guess": 1.5} for n in ("k", "c", "a", "b")},
        "equations": {"x": "v", "v": "-a*x - k*(x - y) - c*(v - w)", "y": "w", "w": rate},
        "outputs": {n: {"expression": n, "unit": "m"} for n in ("x", "y")}})


@pytest.mark.parametrize("rate", [
    "k*(x - y) + c*(v - w) + 1e-90*(a + b + k + c + x + y + v + w)**60",
    "k*(x - y)*(a + b + c + 1)**99 + c*(v - w)*(a + b + k + 2)**98/(a + 2*b + k)**99",
    "-b*w*(a + k + c + 1 + x + y + v)**70", "-w/(b*w + (a + k + c + 1 + x + y + v)**70)"],
    ids=["force", "between", "lever", "denominator"])
def test_no_site_multiplies_out_what_has_no_end(rate: str) -> None:
    """Looking for levers and couplings must not ask for a million terms: it would not come back."""
    model = endless(rate)
    t = np.linspace(0.0, 1.0, 20)
    seen = Recording.from_arrays(t, {"x": np.sin(t), "y": np.cos(t)})
    motion = dict.fromkeys(model.state_names, t)
    assert {s.v for s in sites(model, (seen,))} >= {"v", "w"}
    assert in_rates(model)[0].state_names == model.state_names
    list(effects_between(model, [("x", "v"), ("y", "w")], lambda: motion))
