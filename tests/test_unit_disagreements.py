"""SI units of different kinds in one sum or equation: said, and no reason to refuse the model."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from commandline import Run

import pikanid as pk
from pikanid.model.systems import SYSTEMS

T = np.linspace(0.0, 6.0, 121)


def room(loss: str = "W/K", **more: str) -> pk.Model:
    """A heated room; `more` are formulas of its equation."""
    return pk.Model.from_dict({
        "name": "room", "states": {"T": {"unit": "degC", "initial": 15.0}},
        "inputs": {"P": {"unit": "W"}, "T_a": {"unit": "degC"}},
        "parameters": {"UA": {"guess": 5.0, "unit": loss, "bounds": [0.0, 100.0]},
                       "C": {"value": 20.0, "unit": "J/K"}, "s": {"value": 1.0}},
        "equations": {"T": more.get("T", "(P - UA*(T - T_a))/C")},
        **({"splines": {"f": {"degree": 1, "knots": [0.0, 0.0, 50.0, 100.0, 100.0]}}}
           if "f(T)" in more.get("T", "") else {}),
        "outputs": {"T": {"unit": "degC", "expression": "T", "sigma": 0.1}}})


def measured(model: pk.Model) -> pk.Recording:
    heat = pk.Recording.from_arrays(T, {"P": 30.0 * (T > 1.0), "T_a": 15.0 + np.sin(T)},
                                    {"P": "W", "T_a": "degC"}, hold={"P": "zero"})
    return pk.simulate(model, heat, sigma=0.1, seed=3)


@pytest.mark.parametrize("name", SYSTEMS)
def test_units_of_the_ready_made_models_agree(name: str) -> None:
    assert SYSTEMS[name]().unit_disagreements == ()


@pytest.mark.parametrize("unit", ["W", "kg", "m", "kg^7", "1/s"])
def test_what_does_not_fit_is_said(unit: str) -> None:
    (sentence,) = room(unit).unit_disagreements
    assert sentence.startswith("The equation of 'T': '-UA*(T - T_a)' comes out in '")
    assert "'W' is needed" in sentence


@pytest.mark.parametrize("unit", ["W/K", "J/(s*K)", "W/delta_degC", "kW/K", ""])
def test_what_fits_or_has_no_unit_is_not(unit: str) -> None:
    assert room(unit).unit_disagreements == ()


@pytest.mark.parametrize(("formula", "said"), [
    ("(P - 4.7*(T - T_a))/C", False), ("(P - s*(T - T_a))/C", False), ("P/UA/C", True),
    ("(P - UA*(T - T_a)*sin(P))/C", True), ("(P - UA*(T - T_a)*sin(s*P))/C", False),
    ("P/C - 2*(T - T_a)", False), ("P/C - (T - T_a)/5", False),
    ("(P - UA*abs(T - T_a)**s)/C", False),
    ("(P - UA*signed_power(T - T_a, s))/C", False), ("P/C*tanh(10*P)", False),
    ("P/C*f(T)", False), ("P/C - f(T)*T", False), ("P/C - (T - T_a)", True)],
    ids=["a number", "no unit", "a quotient", "a sine", "a sine without", "two", "a fifth",
         "a power", "a power with a sign", "ten", "a spline", "a spline for a rate", "none"])
def test_a_number_or_a_name_without_a_unit_may_have_any(formula: str, said: bool) -> None:
    assert bool(room(T=formula).unit_disagreements) == said


def test_the_term_that_is_wrong_is_told_and_once() -> None:
    """Whatever the order of the terms, the one in another unit than the equation's."""
    model = pk.Model.from_dict({
        "states": {"x": {"unit": "m"}, "v": {"unit": "m/s"}},
        "parameters": {"c": {"guess": 1.0, "unit": "1/s"}},
        "equations": {"x": "v", "v": "-x - c*v"},
        "outputs": {"x": {"unit": "m", "expression": "x"}}})
    (sentence,) = model.unit_disagreements
    assert "'-x' comes out in 'm' where 'm/s^2' is needed" in sentence


def test_a_lag_of_a_tenth_of_a_second_is_a_time() -> None:
    model = pk.systems.sloshing().map_input("u_x", lag="0.1")
    assert model.unit_disagreements == ()


def test_results_say_so_and_are_the_same() -> None:
    right, odd = room(), room("kg")
    seen = measured(right)
    fits = [pk.NLS().fit(m, seen) for m in (right, odd)]
    assert fits[0].value("UA") == fits[1].value("UA")
    assert odd.unit_disagreements[0] in fits[1].warnings and not fits[0].warnings
    found = [pk.diagnose(m, seen) for m in (right, odd)]
    assert odd.unit_disagreements[0] in found[1].notes
    assert not any("is needed" in note for note in found[0].notes)


def test_the_command_that_shows_a_model_says_so(run: Run, tmp_path: Path) -> None:
    room("kg").save(tmp_path / "odd.toml")
    room().save(tmp_path / "right.toml")
    assert "Units: The equation of 'T'" in run("models", "odd.toml")[1]
    assert "Units:" not in run("models", "right.toml")[1]
