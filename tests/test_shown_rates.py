"""Outputs that show the rate of a state follow its equation; rigs that SciPy simulates."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp

import pikanid as pk
from pikanid import errors
from pikanid.formula.expressions import symbol
from pikanid.model.shown_rates import shown_rates

SPRING = {
    "name": "mass on a spring",
    "states": {"x": {"unit": "m"}, "v": {"unit": "m/s"}},
    "inputs": {"F": {"unit": "N"}},
    "parameters": {"m": {"unit": "kg", "value": 2.0}, "g": {"unit": "m/s^2", "value": 9.81},
                   "k": {"unit": "N/m", "guess": 70.0, "bounds": [1.0, 1e4]},
                   "c": {"unit": "N*s/m", "guess": 1.0, "bounds": [0.0, 100.0]}},
    "equations": {"x": "v", "v": "(F - c*v - k*x)/m"}}


def model(acc: str = "(F - c*v - k*x)/m", unit: str = "m/s^2", **more: object) -> pk.Model:
    return pk.Model.from_dict({**SPRING, "outputs": {"acc": {
        "unit": unit, "expression": acc}}, **more})


def added(found: pk.Model, nominal: pk.Model) -> sp.Expr:
    return sp.expand(found.output("acc").expression - nominal.output("acc").expression)


@pytest.mark.parametrize("formula", [
    "(F - c*v - k*x)/m", "F/m - k/m*x - c/m*v", "derivative(v)", "v'", "v' + g", "v' - 2*g"])
def test_what_acts_on_a_state_acts_on_what_shows_its_rate(formula: str) -> None:
    nominal = model(formula)
    assert shown_rates(nominal) == {"acc": "v"}
    found = nominal.with_term("v", "-b*x**3", [pk.Parameter("b", 1.0, "1/(s^2*m^2)")])
    assert added(found, nominal) == -symbol("b") * symbol("x") ** 3
    slower = found.with_term("v", "-2*v")
    assert added(slower, found) == -2 * symbol("v")
    assert shown_rates(slower) == {"acc": "v"}


@pytest.mark.parametrize(("formula", "unit", "factor"), [
    ("v'", "mm/s^2", 1e3), ("v' + g*sin(x/2)", "m/s^2", 1.0), ("0.5*v' - v*x", "", 0.5),
    ("abs(v')", "m/s^2", None), ("x + m*derivative(v)/k", "m", 2.0 / 70.0)])
def test_a_rate_that_is_written_follows_in_any_unit_and_beside_anything(
        formula: str, unit: str, factor: float | None) -> None:
    nominal = model(formula, unit)
    assert shown_rates(nominal) == {"acc": "v"}
    found = nominal.with_term("v", "-b*x**3", [pk.Parameter("b", 3.0, "1/(s^2*m^2)")])
    again = pk.Model.from_dict(found.to_dict())
    assert again.output("acc") == found.output("acc")
    gone = found.map_output("acc", gain=2.0).with_term("v", "b*x**3").map_input("F", offset=0.0)
    values = {symbol(n): p for n, p in found.values.items()}
    at = {**values, symbol("x"): 0.7, symbol("v"): -0.2, symbol("F"): 3.0}
    here, there, back = (float(m.output("acc").expression.subs(at)) for m in (nominal, found, gone))
    assert back == pytest.approx(2 * here)
    if factor is not None:
        assert there - here == pytest.approx(-factor * 3.0 * 0.7**3)
    else:
        assert there != pytest.approx(here)


@pytest.mark.parametrize("formula", ["x", "v", "(F - c*v)/m", "-k*x/m", "(k*x + c*v - F)/m"])
def test_other_outputs_stay_as_they_are(formula: str) -> None:
    """A force in the equation is not the force in a spring, nor is a state the rate of another."""
    nominal = model(formula, unit="")
    assert shown_rates(nominal) == {}
    for state in ("x", "v"):
        assert added(nominal.with_term(state, "-0.5*x"), nominal) == 0


def test_it_follows_effects_maps_of_inputs_and_parameters_that_change() -> None:
    nominal = model("v' + g")
    drag = pk.Effect("drag", "drag", (pk.Parameter("q", 0.0, "1/m"),), add={
        "v": "-q*v*abs(v)"}, null={"q": 0.0})
    v, F, m, t = (symbol(n) for n in ("v", "F", "m", "t"))
    assert added(nominal.with_effect(drag), nominal) == -symbol("q") * v * sp.Abs(v)
    louder = nominal.map_input("F", gain=3)
    assert added(louder, nominal) == 2 * F / m
    drifting = nominal.substitute(c="c*(1 + 0.1*t)")
    assert sp.nsimplify(added(drifting, nominal) + symbol("c") * v * t / m / 10) == 0
    assert shown_rates(drifting) == shown_rates(louder) == {"acc": "v"}


def test_a_sensor_that_lags_shows_the_rate_late_and_nothing_else() -> None:
    late = model("v'").map_output("acc", [pk.Parameter("tau", 0.01, "s")], lag="tau")
    assert shown_rates(late) == {}
    assert added(late.with_term("v", "-0.5*x"), late) == 0


def test_a_file_keeps_what_an_output_shows() -> None:
    nominal = model("v' + g")
    again = pk.Model.from_dict(nominal.to_dict())
    assert shown_rates(again) == {"acc": "v"}
    assert added(again, nominal) == 0


@pytest.mark.parametrize("formula", [
    "(F + c + k + x + v + m)**900", "sin((F + c + k + x + v + m)**900)",
    "*".join(f"(F + {n}*c + k + x + v + m)" for n in range(1, 30))], ids=["power", "in", "product"])
def test_what_is_endless_multiplied_out_is_not_compared(formula: str) -> None:
    """A file must not ask for a million terms: this would not come back."""
    long = model(formula, unit="")
    assert shown_rates(long) == {}
    assert long.with_term("v", "-2*x").output("acc") == long.output("acc")


@pytest.mark.parametrize("formula", ["w'", "derivative(F)", "derivative(2*x)", "(x*v)'"])
def test_only_states_have_a_derivative(formula: str) -> None:
    with pytest.raises(errors.BadModel, match=r"no state|syntax|formula"):
        model(formula)


def hardened(seed: int, b: float) -> pk.Recording:
    """Spring of 80 N/m that hardens by b, seen by an accelerometer with gravity on it."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0.0, 10.0, 1001)
    levels = 20 * rng.uniform(-1, 1, 21)

    def rate(_: float, s: np.ndarray, force: float) -> list[float]:
        return [s[1], (force - 1.5 * s[1] - 80 * s[0]) / 2 - b * s[0] ** 3]

    seen, start = [], np.zeros(2)
    for k, force in enumerate(levels[:20]):
        own = t[50 * k:50 * k + 51]
        run = solve_ivp(rate, (own[0], own[-1]), start, "DOP853", own, rtol=1e-10, atol=1e-12,
                        args=(force,))
        seen += [rate(0.0, s, force)[1] + 9.81 for s in run.y.T[:-1]]
        start = run.y[:, -1]
    seen.append(rate(0.0, start, levels[19])[1] + 9.81)
    y = np.array(seen) + 0.05 * rng.standard_normal(len(t))
    F = np.append(np.repeat(levels[:20], 50), levels[19])
    return pk.Recording.from_arrays(t, {"F": F, "acc": y}, {"F": "N", "acc": "m/s^2"},
                                    hold={"F": "zero"})


@pytest.mark.parametrize("formula", ["(F - c*v - k*x)/m + g", "v' + g"])
def test_a_hidden_spring_is_named_by_an_accelerometer(formula: str) -> None:
    answer = pk.diagnose(model(formula), hardened(1, 60.0), hardened(2, 60.0), workers=1)
    assert answer.verdict == "named"
    [effect] = answer.hypotheses[0].effects
    assert effect.ids == ("cubic_stiffness",)
    k3 = effect.parameters["k3"]
    assert abs(k3.value - 60.0) < 4 * k3.std < 10
    assert any("'acc' shows the rate of 'v'" in note for note in answer.notes)
