"""Effects that users write as text: read, checked, added, shown, written back."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pikanid as pk
from pikanid import errors
from pikanid.cli import main
from pikanid.formula.expressions import symbol
from pikanid.mismatch.catalogue.own_effects import own_effects
from pikanid.mismatch.catalogue.sites import sites
from pikanid.mismatch.design.effects_shown import effects_figure, effects_shown
from pikanid.mismatch.design.figure import design_figure
from pikanid.model.effects_file import from_table, read_effects

TANKS = """
name = "tanks"
[states]
x1 = { unit = "cm", initial = 5.0 }
x2 = { unit = "cm", initial = 4.0 }
[inputs]
u = { unit = "V" }
[parameters]
k1 = { unit = "cm^0.5/s", guess = 0.5, bounds = [0, 5] }
k2 = { unit = "cm^0.5/s", guess = 0.5, bounds = [0, 5] }
b = { unit = "cm/s/V", guess = 0.3, bounds = [0, 5] }
[equations]
x1 = "-k1*sqrt(max(x1, 0)) + b*u"
x2 = "k1*sqrt(max(x1, 0)) - k2*sqrt(max(x2, 0))"
[outputs]
y = { unit = "cm", expression = "x2" }
"""
OVERFLOW = """
[effects.overflow]
name = "overflow of the first tank"
parameters.k_o = { unit = "1/s", guess = 0.1, bounds = [0, 10] }
parameters.h = { unit = "cm", guess = 9.0, bounds = [5, 15] }
add = { x1 = "-k_o*max(x1 - h, 0)", x2 = "k_o*max(x1 - h, 0)" }
null = { k_o = 0.0 }
"""
T = np.linspace(0.0, 10.0, 50)
STORE: dict[str, Any] = {"store": {
    "parameters": {"e": {"unit": "1/s", "guess": 0.2, "bounds": [0.0, 9.0]}},
    "null": {"e": 0.0}, "add": {"x1": "e*(z - x1)"},
    "states": {"z": {"unit": "cm", "initial": "5", "equation": "e*(x1 - z)"}}}}


@pytest.fixture
def tanks(tmp_path: Path) -> Path:
    path = tmp_path / "tanks.toml"
    path.write_text(TANKS + OVERFLOW)
    return path


def test_a_model_file_lists_effects_and_keeps_them(tanks: Path, tmp_path: Path) -> None:
    model = pk.Model.load(tanks)
    effect, = model.effects
    assert (effect.key, effect.size, effect.null) == (
        "overflow", pk.Parameter("k_o", 0.0, "1/s", (0, 10)), ("k_o", 0.0))
    assert effect.expression == "x1' += -k_o*max(x1 - h, 0), x2' += k_o*max(x1 - h, 0)"
    model.save(tmp_path / "again.toml")
    assert pk.Model.load(tmp_path / "again.toml") == model
    assert model.with_values(k1=0.4).effects == model.effects


def test_an_effect_is_added_and_no_longer_missing(tanks: Path) -> None:
    model = pk.Model.load(tanks)
    extended = model.with_effect(model.effects[0])
    assert extended.effects == () and extended.parameter_names[-2:] == ("k_o", "h")
    difference = extended.equations["x1"] - model.equations["x1"]
    assert float(difference.subs({symbol("k_o"): 2, symbol("x1"): 10, symbol("h"): 9})) == -2
    with pytest.raises(errors.BadModel, match="'overflow'"):
        model.with_candidates(model.effects[0])


def test_a_parameter_with_a_value_is_not_estimated(tanks: Path, tmp_path: Path) -> None:
    table = {"parameters": {**STORE["store"]["parameters"], "low": {"value": 3.0, "unit": "cm"}},
             "null": {"e": 0.0}, "add": {"x1": "-e*(x1 - low)"}}
    model = pk.Model.load(tanks).with_candidates(*from_table({"leak": table}, "test"))
    leak = model.effects[1]
    assert isinstance(leak, pk.Effect) and [p.free for p in leak.parameters] == [True, False]
    model.save(tmp_path / "again.toml")
    assert pk.Model.load(tmp_path / "again.toml") == model
    extended = model.with_effect(leak)
    assert extended.values["low"] == 3.0 and "low" not in extended.free_names
    site = sites(model, (pk.Recording.from_arrays(T, {"u": T, "y": T}),))
    assert [p.name for p in own_effects([leak], site, {})[0].parameters] == ["e"]


def test_effects_stand_side_by_side(tanks: Path) -> None:
    """What one puts in the place of an equation leaves another one's term there."""
    model = pk.Model.load(tanks).replace(effects=())
    drag, other = from_table({
        "drag": {"parameters": {"d": {"guess": 1.0}}, "null": {"d": 0.0}, "add": {"x1": "-d*x1"}},
        "linear": {"parameters": {"s": {"guess": 1.0}}, "null": {"s": 0.0},
                   "replace": {"x1": "-k1*sqrt(max(x1, 0))*(1 - s) - s*x1 + b*u"}}}, "test")
    for first, second in ((drag, other), (other, drag)):
        both = model.with_effect(first, model).with_effect(second, model)
        assert both.equations["x1"].coeff(symbol("d")) == -symbol("x1")
        left = both.equations["x1"].subs({symbol("d"): 0, symbol("s"): 1})
        assert left.equals(-symbol("x1") + symbol("b") * symbol("u"))


def test_replaced_symbols_act_everywhere(tanks: Path) -> None:
    model = pk.Model.load(tanks)
    drift, = from_table({"drift": {"parameters": {"r": {"guess": 0.1, "unit": "1/s"}},
                                   "null": {"r": 0.0}, "replace": {"k1": "k1*(1 + r*t)"}}}, "test")
    found = model.with_effect(drift).equations
    assert symbol("r") in found["x1"].free_symbols & found["x2"].free_symbols


def test_names_are_no_others(tanks: Path) -> None:
    model = pk.Model.load(tanks)
    loss = {"null": {"k_o": 0.0}, "parameters": {"k_o": {"guess": 1.0}}, "add": {"x1": "-k_o*x1"}}
    with pytest.raises(errors.BadModel, match="'k_o', which effect 'overflow' has already"):
        model.with_candidates(*from_table({"loss": loss}, "test"))
    own = {"null": {"b": 0.0}, "parameters": {"b": {"guess": 1.0}}, "add": {"x1": "-b*x1"}}
    with pytest.raises(errors.BadModel, match="'b', which the model has already"):
        model.with_candidates(*from_table({"loss": own}, "test"))


@pytest.mark.parametrize(("change", "said"), [
    ({"null": {}}, "'null' must name one of its parameters"),
    ({"null": {"h": 0.0}}, "'null' must name one of its parameters"),
    ({"null": {"e": -1.0}}, "'e': its guess -1 must lie inside"),
    ({"null": {"e": "0"}}, "null of 'e' is '0'"),
    ({"add": {}, "states": {}}, "changes nothing"),
    ({"add": {"x3": "e"}}, "no state 'x3'"),
    ({"add": {"x1": "e*q"}}, "'q'"),
    ({"add": {"x1": ["__import__('os')"]}}, "must be"),
    ({"replace": {"nothing": "e"}}, "no symbol 'nothing'"),
    ({"inputs": {"u": {"gains": "e"}}}, "gains"),
    ({"parameters": {"e": {"guess": 0.1, "unit": "1/s", "bounds": [1, 0]}}}, "'e'"),
    ({"parameters": {"e": {"guess": 0.1, "unit": "1/s", "scope": "all"}}}, "'shared' or"),
    ({"parameters": {"e": {"value": 0.1, "unit": "1/s"}}}, "'null' must name one"),
    ({"parameters": {"e": {"value": 0.1, "guess": 0.1}}}, "value"),
    ({"colour": "red"}, "colour"),
])
def test_what_is_wrong_is_said(tanks: Path, change: dict[str, Any], said: str) -> None:
    model = pk.Model.load(tanks)
    with pytest.raises(errors.BadModel, match=said):
        model.with_candidates(*from_table({"store": {**STORE["store"], **change}}, "test"))


def test_units_of_effects_are_checked(tanks: Path) -> None:
    wrong = from_table({"loss": {"parameters": {"d": {"unit": "cm", "guess": 1.0}},
                                 "null": {"d": 0.0}, "add": {"x1": "-d*x1"}}}, "test")
    with pytest.raises(errors.PikanidError, match="unit"):
        pk.Model.load(tanks).with_candidates(*wrong)


def test_what_effects_do_is_simulated_and_their_derivative_checked(tanks: Path) -> None:
    model = pk.Model.load(tanks).with_candidates(*from_table(STORE, "test"))
    t = np.arange(0.0, 60.0)
    drive = pk.Recording.from_arrays(t, {"u": np.where(t < 20, 8.0, 1.0)}, units={"u": "V"})
    overflow, store, *others = effects_shown(model, drive)
    assert [one.effect.key for one in others] == ["feedthrough"]
    assert overflow.largest["y"] > 0.1 and store.largest["y"] > 0.01
    assert overflow.derivative < 1e-3 and store.derivative < 1e-3
    quiet = effects_shown(model, drive.with_channels(
        pk.Channel("u", t, np.ones(60), "V", hold="zero")))
    assert np.isnan(quiet[0].derivative) and quiet[0].largest["y"] == 0.0  # it never runs over


def test_a_legend_covers_no_curve(tanks: Path) -> None:
    model = pk.Model.load(tanks).with_candidates(*from_table(STORE, "test"))
    t = np.arange(0.0, 60.0)
    drive = pk.Recording.from_arrays(t, {"u": np.where(t < 20, 8.0, 1.0)}, units={"u": "V"})
    run = pk.simulate(model, drive)["y"]
    two = {"without": {"y": (run.time, run.values)}, "with it": {"y": (run.time, run.values + 1)}}
    for figure in (effects_figure(effects_shown(model, drive), model),
                   design_figure(drive, two, {"y": "V"})):
        figure.draw_without_rendering()
        legends = [a.get_legend() for a in figure.axes if a.get_legend()] + figure.legends
        assert legends
        for legend in legends:
            place = legend.get_window_extent()
            for axis in figure.axes:
                frame = axis.get_window_extent()
                assert place.y0 >= frame.y1 - 1 or place.y1 <= frame.y0 + 1


def test_command(tanks: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    t = np.arange(0.0, 60.0)
    pk.Recording.from_arrays(t, {"u": np.where(t < 20, 8.0, 1.0)}, units={"u": "V"}).write(
        tmp_path / "run.csv")
    usual = ["effects", "--model", str(tanks), "--excitation", str(tmp_path / "run.csv")]
    assert main([*usual, "--plot", str(tmp_path / "e.png")]) == 0
    said = capsys.readouterr().out
    assert "overflow" in said and "agrees" in said and (tmp_path / "e.png").stat().st_size > 5000
    (tmp_path / "more.toml").write_text(OVERFLOW)
    assert read_effects(tmp_path / "more.toml") == pk.Model.load(tanks).effects
    assert main([*usual, "--catalogue", str(tmp_path / "more.toml")]) == 2
    assert "has already" in capsys.readouterr().err
    (tmp_path / "more.toml").write_text(OVERFLOW.replace("h, 0)", "hh, 0)"))
    plain = tmp_path / "plain.toml"
    plain.write_text(TANKS.replace('expression = "x2"', 'expression = "x1"'))
    assert main(["effects", "--model", str(plain)]) == 2
    assert "lists no effects" in capsys.readouterr().err
    assert main(["effects", "--model", str(plain), "--catalogue", str(tmp_path / "more.toml")]) == 2
    assert "'hh'" in capsys.readouterr().err
