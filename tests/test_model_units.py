"""Units of a model: values in any unit give the physics of the same values in SI units."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w
from hypothesis import given, settings
from hypothesis import strategies as st

import pikanid as pk
from pikanid import Model, Parameter, Recording, State
from pikanid.errors import BadModel, BadUnit
from pikanid.formula.expressions import symbol
from pikanid.formula.units import convert
from pikanid.model import Input, Output
from pikanid.model.checks import Checked
from pikanid.model.units import coherent
from pikanid.simulation import simulate

T = np.linspace(0.0, 2.0, 41)


def decay(unit: str, value: float, state: str = "", **more: Any) -> Model:
    return Model.from_dict({
        "name": "decay", "states": {"x": {"unit": state, "initial": 5.0}},
        "parameters": {"k": {"unit": unit, "guess": value, **more}},
        "equations": {"x": "-k*x"}, "outputs": {"x": {"unit": state, "expression": "x"}}})


def pendulum(angle: str = "rad", rate: str = "rad/s", length: str = "m", push: str = "m/s^2",
             late: str = "s", out: str = "rad") -> Model:
    """A driven pendulum of 45 mm, whatever units its author prefers."""
    def put(value: float, source: str, unit: str) -> float:
        return float(convert(value, source, unit))

    return Model.from_dict({
        "name": "pendulum",
        "states": {"theta": {"unit": angle, "initial": put(0.3, "rad", angle)},
                   "v": {"unit": rate, "initial": "v_0"}},
        "inputs": {"u": {"unit": push, "default": 0.0, "delay": "tau"}},
        "parameters": {"l": {"unit": length, "guess": put(0.045, "m", length)},
                       "g": {"unit": "m/s^2", "value": 9.81},
                       "zeta": {"guess": 0.05},
                       "tau": {"unit": late, "value": put(0.03, "s", late)},
                       "v_0": {"unit": "rad/s", "value": 0.4}},
        "equations": {"theta": "v", "v": "-g/l*sin(theta) - u/l*cos(theta)"
                                         " - 2*zeta*sqrt(g/l)*v"},
        "outputs": {"y": {"unit": out, "expression": "theta"}}})


ALONG = Recording.from_arrays(T, {"u": np.sin(5 * T)}, {"u": "m/s^2"}, hold={"u": "first"})


def numbers(model: Model, **units: str) -> list[float]:
    """Rates, initial values and output at one state in SI units, in SI units."""
    given = {"theta": (0.3, "rad"), "v": (0.4, "rad/s"), "u": (2.0, "m/s^2")}
    table = dict(model.values)
    for part in (*model.states, *model.inputs):
        value, unit = given[part.name]
        table[part.name] = float(convert(value, unit, part.unit))
    swap = {symbol(n): v for n, v in table.items()}
    places = [*((model.equations[s.name], f"({s.unit})/s", si) for s, si in
                zip(model.states, ("rad/s", "rad/s^2"), strict=True)),
              *((s.initial, s.unit, given[s.name][1]) for s in model.states),
              (model.output("y").expression, model.output("y").unit, "rad"),
              (model.input("u").delay, "s", "s")]
    return [float(convert(float(e.xreplace(swap)), own, si)) for e, own, si in places]


@settings(max_examples=40, deadline=None)
@given(st.sampled_from(["rad", "deg", "mrad"]), st.sampled_from(["rad/s", "deg/s", "rpm"]),
       st.sampled_from(["m", "mm", "inch"]), st.sampled_from(["m/s^2", "mm/s^2", "g_0"]),
       st.sampled_from(["s", "ms"]), st.sampled_from(["rad", "deg"]))
def test_the_same_physics_in_any_units(angle: str, rate: str, length: str, push: str, late: str,
                                       out: str) -> None:
    model = pendulum(angle, rate, length, push, late, out)
    np.testing.assert_allclose(numbers(model), numbers(pendulum()), rtol=1e-12)
    assert Model.from_dict(model.to_dict()) == model
    # values stay in the unit of their author
    assert model.parameter("l").unit == length
    assert model.values["l"] == pytest.approx(float(convert(0.045, "m", length)))


def test_a_simulation_in_degrees_and_millimetres() -> None:
    shown = simulate(pendulum("deg", "deg/s", "mm", "mm/s^2", "ms", "deg"), ALONG)["y"]
    plain = simulate(pendulum(), ALONG)["y"]
    np.testing.assert_allclose(shown.converted("rad").values, plain.values, atol=2e-6)


@pytest.mark.parametrize(("unit", "time", "seconds"), [
    ("1/h", "h", 3600.0), ("1/h", "s", 3600.0),
    pytest.param("1/day", "d", 86400.0, marks=pytest.mark.slow),
    pytest.param("1/year", "yr", 31557600.0, marks=pytest.mark.slow)])
def test_rates_per_hour_are_found_per_hour(unit: str, time: str, seconds: float, tmp_path: Path
                                           ) -> None:
    """A time column becomes seconds; what is estimated stays in the unit of its parameter."""
    hours = np.linspace(0.0, 6.0, 25)
    shown = hours if time != "s" else hours * seconds
    rows = "".join(f"{t!r},{5 * math.exp(-0.31 * h)!r}\n"
                   for t, h in zip(shown.tolist(), hours.tolist(), strict=True))
    (tmp_path / "run.csv").write_text(f"t [{time}],x\n{rows}")
    rec = Recording.read(tmp_path / "run.csv")
    est = pk.NLS().fit(decay(unit, 0.5, bounds=[0.0, 10.0]), rec)
    assert est.value("k") == pytest.approx(0.31, rel=1e-6)
    assert est.free[0].unit == unit
    assert "k = 3.1" in str(est) and f" {unit}\n" in str(est)


def test_an_estimate_of_converted_units_is_read_again(tmp_path: Path) -> None:
    rec = Recording.from_arrays(T * 3600, {"x": 5 * np.exp(-0.3 * T)}, sigma={"x": 0.01})
    est = pk.NLS().fit(decay("1/h", 0.5), rec)
    est.save(tmp_path / "e.json")
    again = pk.Estimate.load(tmp_path / "e.json")
    assert again.model == est.model
    assert str(again) == str(est)
    est.fitted_model.save(tmp_path / "m.toml")
    assert Model.load(tmp_path / "m.toml") == est.fitted_model


def test_units_that_agree_leave_formulas_as_they_are() -> None:
    """Millimetres throughout need no factor, and a number among them is in millimetres."""
    model = Model.from_dict({
        "name": "mm", "states": {"x": {"unit": "mm"}, "v": {"unit": "mm/s"}},
        "parameters": {"w": {"unit": "rad/s", "guess": 3.0}, "soft": {"unit": "mm", "value": 0.1}},
        "equations": {"x": "v", "v": "-w**2*(x + 2.5) - 1000*sin(w*t)"},
        "outputs": {"h": {"unit": "mm", "expression": "sqrt(x**2 + soft**2 + 0.1**2)"}}})
    assert model.parameter_names == ("w", "soft")


def test_terms_and_changes_of_a_model_are_converted_too() -> None:
    model = decay("1/h", 0.3, "mg/l").with_term("x", "q", [Parameter("q", 2.0, "mg/l/h")])
    assert model.parameter_names == ("k", "h_per_s", "q")  # one factor serves both
    assert simulate(model, after(3600.0))["x"].values[-1] == pytest.approx(
        5 * np.exp(-0.3) + 2.0 / 0.3 * (1 - np.exp(-0.3)), rel=1e-6)
    # another unit for the same name undoes the factor
    back = model.with_parameters(Parameter("k", 0.3 / 3600, "1/s"))
    assert simulate(back, after(3600.0))["x"].values[-1] == pytest.approx(
        simulate(model, after(3600.0))["x"].values[-1], rel=1e-6)


def after(seconds: float) -> Recording:
    return Recording.from_arrays([0.0, seconds], {"x": [0.0, 1.0]})


def test_parts_made_in_python_are_converted_like_a_file() -> None:
    x, k, u = (symbol(n) for n in ("x", "k", "u"))
    model = Model("m", (State("x", "mm"),), (Input("u", "m"),),
                  (Parameter("k", 0.5, "1/min"), Parameter("lag", 20.0, "ms")),
                  {"x": k * (u - x)}, (Output("y", x, "mm"),))
    seen = model.map_output("y", lag="lag").map_input("u", delay="lag", backlash="0.5")
    swap = {symbol(n): v for n, v in seen.values.items()} | {u: 0.7, x: 100.0}
    # (700 mm - 100 mm) 0.5/min in mm/s, and 100 mm behind a lag of 20 ms
    assert float(seen.equations["x"].xreplace(swap)) == pytest.approx(600 * 0.5 / 60)
    behind = seen.equations["y_lag"].xreplace({**swap, symbol("y_lag"): 40.0})
    assert float(behind) == pytest.approx(60 / 0.02)
    assert float(seen.input("u").delay.xreplace(swap)) == pytest.approx(0.02)
    assert seen.input("u").backlash == 0.5


@pytest.mark.parametrize(("change", "message"), [
    ({"equations": {"x": "-k*x/3600"}}, "leave the number out"),
    ({"equations": {"x": "-2*k*x/3600"}}, "leave the number out"),
    ({"equations": {"x": "a - k*x"}, "parameters": {"a": {"unit": "mg/h", "guess": 1.0}}},
     "declare the unit of x"),
    ({"equations": {"x": "-k*x + a*x"}, "parameters": {"a": {"unit": "mm", "guess": 1.0}}},
     "no factor turns"),
    ({"states": {"x": {"unit": "m"}}, "outputs": {"x": {"unit": "mm", "expression": "1000*x"}}},
     "leave the number out"),
    ({"states": {"x": {"unit": "deg"}}, "equations": {"x": "-k*sin(x*pi/180)"}},
     "leave the number out"),
    ({"states": {"x": {"unit": "m"}}, "equations": {"x": "-k*x - b + 3.5"},
      "parameters": {"b": {"unit": "m/s", "guess": 1.0}}}, "'3.5', which has no unit"),
    ({"states": {"x": {"unit": "degC"}}, "outputs": {"x": {"unit": "K", "expression": "x"}}},
     "different zeros"),
    ({"states": {"x": {"unit": "degC"}}, "equations": {"x": "k*(b - x)"},
      "parameters": {"b": {"unit": "degF", "guess": 1.0}}}, "different zeros"),
    ({"states": {"x": {"unit": "degC"}}, "equations": {"x": "-k*x**4"}}, "different zeros"),
    ({"states": {"x": {"unit": "dBm"}}}, "logarithmic"),
    ({"states": {"x": {"unit": "Vlt"}}}, "state 'x' is unknown.*Did you mean 'volt'"),
    ({"parameters": {"b": {"unit": "kg/sek", "guess": 1.0}}}, "parameter 'b' is unknown"),
    ({"outputs": {"x": {"unit": "degre", "expression": "x"}}}, "output 'x'.*Did you mean 'degree'"),
    ({"inputs": {"u": {"unit": "Newtn"}}}, "input 'u' is unknown"),
])
def test_units_that_cannot_be_followed_are_an_error(change: dict[str, Any], message: str) -> None:
    content = decay("1/h", 0.3).to_dict()
    del content["parameters"]["h_per_s"]
    content["equations"]["x"] = "-k*x"
    for section, entries in change.items():
        content[section] = {**content.get(section, {}), **entries}
    with pytest.raises(BadUnit, match=message):
        Model.from_dict(content)


@pytest.mark.parametrize("make", [
    lambda: State("x", "Vlt"), lambda: Parameter("k", 1.0, "Vlt")])
def test_unknown_units_in_python(make: Any) -> None:
    model = decay("1/s", 0.3)
    part = make()
    with pytest.raises(BadUnit, match=f"'Vlt' of .* '{part.name}' is unknown"):
        if isinstance(part, State):
            model.replace(states=(part,))
        else:
            model.with_parameters(part)
    with pytest.raises(BadModel, match="unit of parameter 'q'"):
        model.with_parameters(Parameter("q", 1.0, 5))  # type: ignore[arg-type]


def test_temperatures_keep_their_zero() -> None:
    """A room in °C, a set point in °C and a difference to it."""
    model = Model.from_dict({
        "name": "room", "states": {"T": {"unit": "degC", "initial": 18.0}},
        "inputs": {"Ta": {"unit": "degC"}},
        "parameters": {"a": {"unit": "1/h", "guess": 0.4},
                       "raised": {"unit": "delta_degC", "value": 3.0},
                       "C": {"unit": "kWh/K", "value": 2.0}, "P": {"unit": "W", "value": 500.0}},
        "equations": {"T": "a*(Ta + raised - T) + P/C"},
        "outputs": {"T": {"unit": "degC", "expression": "T"}}})
    hours = np.linspace(0.0, 3.0, 13)
    rec = Recording.from_arrays(hours * 3600, {"Ta": 0 * hours + 283.15}, {"Ta": "K"})
    end = 10.0 + 3.0 + 0.5 / 2.0 / 0.4
    np.testing.assert_allclose(simulate(model, rec)["T"].values,
                               end + (18.0 - end) * np.exp(-0.4 * hours), rtol=1e-6)


def test_set_takes_both(tmp_path: Path) -> None:
    from pikanid.commands.options import adjusted

    model = adjusted(decay("1/h", 0.3), ["k=0.001/s"])
    assert model.values["k"] == pytest.approx(3.6)
    assert adjusted(model, ["k=0.7"]).values["k"] == 0.7


@pytest.mark.parametrize(("angle", "rate", "out"), [
    ("deg", "deg/s", "deg"), ("mm", "mm/s", "mm"), ("mrad", "mrad/s", "deg")])
def test_every_effect_of_the_catalogue_can_be_added_in_units_that_are_not_si(
        angle: str, rate: str, out: str) -> None:
    """What an effect adds has the unit of its place, whatever the model's units are."""
    from pikanid.mismatch.catalogue.catalogue import candidates
    from pikanid.mismatch.catalogue.sites import sites

    length = {"deg": "rad", "mrad": "rad"}.get(angle, "m")
    model = Model.from_dict({
        "name": "any", "states": {"q": {"unit": angle}, "v": {"unit": rate}},
        "inputs": {"u": {"unit": f"{length}/s^2"}},
        "parameters": {"w": {"unit": "rad/s", "guess": 9.0}, "d": {"unit": "1/s", "guess": 0.3}},
        "equations": {"q": "v", "v": "u - w**2*q - d*v"},
        "outputs": {"y": {"unit": out, "expression": "q"}}})
    rec = Recording.from_arrays(
        T, {"u": np.sin(5 * T), "y": np.sin(4 * T), "tilt": np.cos(T)},
        {"u": f"{length}/s^2", "y": out, "tilt": "deg"}, hold={"u": "first"})
    made = 0
    for candidate in candidates(sites(model, (rec,))):
        if candidate.suits():
            applied = candidate.applied(model)
            assert not coherent(applied, Checked())  # what was kept from the model needs nothing
            made += 1
    assert made > 25


REAL = [("theophylline", "h", 3600.0), *(pytest.param(*case, marks=pytest.mark.slow) for case in (
    ("buildings", "h", 3600.0), ("populations/lynx_hare", "year", 31557600.0),
    ("populations/boarding_school_flu", "d", 86400.0)))]


@pytest.mark.parametrize(("folder", "unit", "seconds"), REAL)
def test_real_recordings_in_hours_days_and_years(recordings_folder: Path, folder: str, unit: str,
                                                 seconds: float, tmp_path: Path) -> None:
    """Rates declared per hour, day or year: the same fit as of the same rates per second."""
    place = recordings_folder / folder
    content = tomllib.loads((place / "model.toml").read_text())
    if folder == "theophylline":
        rows = [line.split(",") for line in (place / "Theoph.csv").read_text().splitlines()]
        body = "".join(f"{r[4]},{r[5]}\n" for r in rows[1:] if r[1] == "1" and float(r[4]) > 1)
        (tmp_path / "run.csv").write_text("t [h],conc [mg/l]\n" + body)
        rec = Recording.read(tmp_path / "run.csv")
    else:
        rec = Recording.read(place / "train.csv")
    plain = pk.NLS().fit(Model.from_dict(content), rec)
    rates = [n for n, p in content["parameters"].items() if p["unit"] == "1/s"]
    for name in rates:
        entry = content["parameters"][name]
        entry["unit"] = f"1/{unit}"
        for key in {"guess", "value"} & {*entry}:
            entry[key] *= seconds
        entry["bounds"] = [b * seconds for b in entry["bounds"]]
    (tmp_path / "model.toml").write_text(tomli_w.dumps(content))
    est = pk.NLS().fit(Model.load(tmp_path / "model.toml"), rec)
    assert est.rmse == pytest.approx(plain.rmse, rel=1e-5)
    for name in rates:
        assert est.value(name) == pytest.approx(plain.value(name) * seconds, rel=1e-3)
        assert est.std(name) == pytest.approx(plain.std(name) * seconds, rel=1e-2)
