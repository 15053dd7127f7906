"""Models: validation, and operations that mean what they say, by formula and by numbers."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from pikanid import errors
from pikanid.formula.expressions import symbol
from pikanid.model import Input, Model, Output, Parameter, Spline, State, systems
from pikanid.simulation import VectorField

X, U, K = symbol("x"), symbol("u"), symbol("k")


def small(**changes: object) -> Model:
    fields = {"name": "small", "states": (State("x", "m"),), "inputs": (Input("u", "N"),),
              "parameters": (Parameter("k", 2.0, "1/s", (0.0, 9.0)),),
              "equations": {"x": U - K * X}, "outputs": (Output("y", X, "m"),)}
    return Model(**{**fields, **changes})  # type: ignore[arg-type]


def rhs(model: Model, x: np.ndarray, u: np.ndarray, t: np.ndarray | None = None,
        **values: float) -> np.ndarray:
    p = np.array(list({**model.values, **values}.values()))
    return VectorField(model).rhs(np.zeros(len(x)) if t is None else t, x, u, p)


# --- validation ----------------------------------------------------------------------------------


@pytest.mark.parametrize(("changes", "message"), [
    ({"states": (), "equations": {}}, "no states"),
    ({"outputs": ()}, "no outputs"),
    ({"states": (State("x"), State("x"))}, "names both"),
    ({"parameters": (Parameter("x", 1.0),)}, "names both state and parameter"),
    ({"states": (State("t"),), "equations": {"t": 1}}, "built-in"),
    ({"states": (State("_x"),), "equations": {"_x": 1}}, "cannot name"),
    ({"states": (State("a b"),), "equations": {"a b": 1}}, "cannot name"),
    ({"equations": {}}, "no equation"),
    ({"equations": {"x": U, "z": U}}, "not a state"),
    ({"equations": {"x": symbol("q") * X}}, "uses q"),
    ({"equations": {"x": sp.Function("law")(X)}}, "uses law"),
    ({"outputs": (Output("u", X),)}, "names both"),
    ({"outputs": (Output("y", X), Output("y", U))}, "names both"),
    ({"outputs": (Output("y", symbol("q")),)}, "uses q"),
    ({"states": (State("x", initial=X),)}, "uses x"),
    ({"inputs": (Input("u", delay=X),)}, "uses x"),
    ({"outputs": (Output("y", X, delay=U),)}, "uses u"),
    ({"inputs": (Input("u", hold="smooth"),)}, "'zero', 'first' or 'cubic'"),
    ({"parameters": (Parameter("k", 10.0, bounds=(0, 9)),)}, "inside its bounds"),
    ({"parameters": (Parameter("k", 1.0, bounds=(9, 0)),)}, "lower bound below"),
    ({"parameters": (Parameter("k", float("nan")),)}, "finite"),
    ({"parameters": (Parameter("k", 1.0, scope="all"),)}, "'shared' or 'recording'"),
    ({"splines": (Spline("e", 3, (0.0, 1.0)),)}, "knots"),
    ({"splines": (Spline("e", 1, (0.0, 2.0, 1.0, 3.0)),)}, "non-decreasing"),
    ({"equations": {"x": sp.gamma(X)}}, "not allowed"),
    ({"equations": {"x": sp.Piecewise((X, X > 0), (0, True))}}, "not allowed"),
    ({"equations": {"x": sp.I * X}}, "not allowed"),
    ({"outputs": (Output("y", sp.Derivative(X**2, X)),)}, "not allowed"),
])
def test_inconsistent_models_are_refused(changes: dict[str, object], message: str) -> None:
    with pytest.raises(errors.BadModel, match=message):
        small(**changes)


def test_unknown_names_are_answered_with_the_close_ones() -> None:
    model = systems.sloshing()
    for ask in (lambda: model.parameter("l_teta"), lambda: model.fix("l_teta"),
                lambda: model.with_values(l_teta=1.0), lambda: model.per_recording("l_teta"),
                lambda: model.with_bounds(l_teta=(0, 1)),
                lambda: model.substitute(l_teta="m")):
        with pytest.raises(errors.BadModel, match=r"l_teta.*Did you mean 'l_theta'"):
            ask()
    with pytest.raises(errors.BadModel, match="theta_dott"):
        model.with_term("theta_dott", "1")
    with pytest.raises(errors.BadModel, match=r"thet.*Did you mean 'theta'"):
        model.with_term("theta_dot", "sin(thet)")
    with pytest.raises(errors.BadModel, match="mu"):
        model.with_term("theta_dot", -symbol("mu") * symbol("theta"))


# --- immutability and identity -------------------------------------------------------------------


def test_models_cannot_be_changed() -> None:
    model = small()
    with pytest.raises(AttributeError):
        model.name = "other"  # type: ignore[misc]
    with pytest.raises(TypeError):
        model.equations["x"] = U  # type: ignore[index]


def test_operations_leave_the_model_as_it_was() -> None:
    model = systems.sloshing()
    before = model.to_dict()
    model.with_term("theta_dot", "-mu*sign(theta_dot)", [Parameter("mu", 1.0)])
    model.map_input("u_x", gain="m")
    model.map_output("theta", offset=0.1)
    model.fix("l_theta", d_theta=0.2)
    model.with_initial(theta="free")
    model.substitute(l_theta="l_theta*(1 + t)")
    assert model.to_dict() == before


def test_what_is_new_in_a_model_made_from_another_is_checked() -> None:
    model = systems.sloshing()
    first, *others = model.parameters
    for changes, message in (
            ({"parameters": tuple(others)}, first.name),  # equations hold it
            ({"parameters": (Parameter(first.name, float("nan")), *others)}, first.name),
            ({"equations": {**model.equations, "theta": sp.Symbol("nowhere")}}, "nowhere"),
            ({"states": model.states[1:]}, model.states[0].name)):
        with pytest.raises(errors.BadModel, match=message):
            model.replace(**changes)
    with pytest.raises(TypeError, match="colour"):
        model.replace(colour="red")
    assert model.replace(parameters=model.parameters[::-1]).parameters[-1] is first


def test_equal_models_are_equal_and_hash_alike() -> None:
    assert systems.sloshing() == systems.sloshing()
    assert hash(systems.sloshing()) == hash(systems.sloshing())
    assert systems.sloshing() != systems.sloshing().with_values(m=0.31)
    assert systems.sloshing() != systems.pendulum()
    assert small(states=(State("x", "m", 1),)) == small(states=(State("x", "m", 1.0),))
    assert pickle.loads(pickle.dumps(systems.sloshing_2d())) == systems.sloshing_2d()


def test_symbols_made_elsewhere_are_the_models_own() -> None:
    """A user's sp.symbols("x k u") has no assumptions; it means the same."""
    x, k, u = sp.symbols("x k u")
    assert small(equations={"x": u - k * x}) == small()


# --- operations ----------------------------------------------------------------------------------

RNG = np.random.default_rng(5)
STATES, INPUTS = RNG.normal(0, 1.5, (30, 2)), RNG.normal(0, 2.0, (30, 2))


def test_terms_add_up() -> None:
    model = systems.sloshing()
    more = model.with_term("theta_dot", "-c*theta_dot**3", [Parameter("c", 0.7)])
    more = more.with_term("theta_dot", 0.25)
    expected = rhs(model, STATES, INPUTS)
    expected[:, 1] += -0.7 * STATES[:, 1] ** 3 + 0.25
    np.testing.assert_allclose(rhs(more, STATES, INPUTS), expected, rtol=1e-13)
    assert more.free_names == ("l_theta", "d_theta", "c")


def test_a_new_state_couples() -> None:
    model = systems.sloshing().with_state(State("heat", "J"), "theta_dot**2 - heat/tau",
                                          [Parameter("tau", 2.0)])
    model = model.with_term("theta_dot", "0.1*heat")
    x = np.column_stack([STATES, RNG.normal(size=30)])
    expected = rhs(systems.sloshing(), STATES, INPUTS)
    expected[:, 1] += 0.1 * x[:, 2]
    found = rhs(model, x, INPUTS)
    np.testing.assert_allclose(found[:, :2], expected, rtol=1e-13)
    np.testing.assert_allclose(found[:, 2], x[:, 1] ** 2 - x[:, 2] / 2, rtol=1e-13)


def test_substitution_reaches_equations_and_outputs() -> None:
    model = systems.sloshing().map_output("theta", function="theta*l_theta")
    model = model.substitute([Parameter("r", 0.1)], l_theta="l_theta*(1 + r*t)")
    t = np.linspace(0, 3, 30)
    p = np.array(list(model.values.values()))
    y = VectorField(model).outputs(t, STATES, INPUTS, p)[:, 0]
    np.testing.assert_allclose(y, STATES[:, 0] * 0.045 * (1 + 0.1 * t), rtol=1e-13)
    expected = [rhs(systems.sloshing(), STATES[i:i + 1], INPUTS[i:i + 1],
                    l_theta=0.045 * (1 + 0.1 * t[i]))[0] for i in range(30)]
    np.testing.assert_allclose(rhs(model, STATES, INPUTS, t), expected, rtol=1e-12)


def test_a_name_may_be_substituted_by_itself_and_two_be_swapped() -> None:
    model = small(parameters=(Parameter("k", 2.0), Parameter("j", 3.0)),
                  equations={"x": U - K * X + symbol("j")})
    swapped = model.substitute(k="j", j="k")
    assert swapped.equations["x"] == U - symbol("j") * X + K


def test_fixing_freeing_and_setting() -> None:
    model = systems.sloshing()
    assert model.fix("l_theta").free_names == ("d_theta",)
    assert model.fix(l_theta=0.05).values["l_theta"] == 0.05
    assert model.free("m", g=9.8).free_names == ("l_theta", "d_theta", "m", "g")
    assert model.free(g=9.8).values["g"] == 9.8
    assert model.with_values({"m": 0.4}, d_theta=0.2).values == {
        "l_theta": 0.045, "d_theta": 0.2, "m": 0.4, "g": 9.81}
    assert model.with_bounds(l_theta=(0.01, 0.1)).parameter("l_theta").bounds == (0.01, 0.1)
    with pytest.raises(errors.BadModel, match="inside its bounds"):
        model.with_values(l_theta=50.0)
    assert model.per_recording("d_theta").parameter("d_theta").scope == "recording"


def test_initial_values_given_free_and_by_formula() -> None:
    model = systems.sloshing().with_initial(theta=0.1, theta_dot="free")
    assert model.state("theta").initial == sp.Float(0.1)
    assert model.parameter("theta_dot_0").free
    assert model.parameter("theta_dot_0").scope == "recording"
    assert model.with_initial(theta="free").values["theta_0"] == 0.1
    assert model.with_initial(theta="m*2").state("theta").initial == 2 * symbol("m")
    with pytest.raises(errors.BadModel, match="theta_dot"):
        model.with_initial(theta="theta_dot")


def test_latex_of_every_ready_made_model_and_function() -> None:
    for make in systems.SYSTEMS.values():
        assert r"\dot{" in make().latex()
    odd = small().with_term("x", "clip(x, -1, 1) + signed_power(x, k) + abs_power(x, 0.5)")
    assert r"\operatorname{clip}" in odd.latex()
    assert odd._repr_latex_().startswith("$$")


# --- property test: random chains of operations against numbers ----------------------------------

OPERATIONS = {
    "term": (lambda m: m.with_term("theta_dot", "-0.3*theta_dot*abs(theta_dot)"),
             lambda f: lambda x, u: f(x, u) + np.array([0, -0.3 * x[1] * abs(x[1])])),
    "gain": (lambda m: m.map_input("u_x", gain=1.7),
             lambda f: lambda x, u: f(x, np.array([1.7 * u[0], u[1]]))),
    "offset": (lambda m: m.map_input("u_z", offset="-0.4*m"),
               lambda f: lambda x, u: f(x, np.array([u[0], u[1] - 0.12]))),
    "saturation": (lambda m: m.map_input("u_x", saturation=0.9),
                   lambda f: lambda x, u: f(x, np.array([np.clip(u[0], -0.9, 0.9), u[1]]))),
    "dead zone": (lambda m: m.map_input("u_x", dead_zone=0.5),
                  lambda f: lambda x, u: f(
                      x, np.array([u[0] - np.clip(u[0], -0.5, 0.5), u[1]]))),
    "function": (lambda m: m.map_input("u_x", function="u_x + 0.2*u_x**3"),
                 lambda f: lambda x, u: f(x, np.array([u[0] + 0.2 * u[0] ** 3, u[1]]))),
    "sign": (lambda m: m.with_term("theta_dot", "-0.8*sign(theta_dot) + 0.5*max(theta, 0.1)"),
             lambda f: lambda x, u: f(x, u) + np.array(
                 [0, -0.8 * np.sign(x[1]) + 0.5 * max(x[0], 0.1)])),
    "file": (lambda m: Model.from_dict(m.to_dict()), lambda f: f),
}


@settings(max_examples=25)
@given(st.lists(st.sampled_from(sorted(OPERATIONS)), max_size=5))
def test_chains_of_operations_mean_what_they_mean_one_by_one(chain: list[str]) -> None:
    """A map of an input acts on the recorded signal first; what was mapped before comes after."""
    model = systems.sloshing()

    def base(x: np.ndarray, u: np.ndarray) -> np.ndarray:
        return rhs(systems.sloshing(), x[None], u[None])[0]

    meaning = base
    for name in chain:
        change, wrap = OPERATIONS[name]
        model, meaning = change(model), wrap(meaning)
    expected = np.array([meaning(x, u) for x, u in zip(STATES, INPUTS, strict=True)])
    np.testing.assert_allclose(rhs(model, STATES, INPUTS), expected, rtol=1e-11, atol=1e-11)
    assert Model.from_dict(model.to_dict()) == model
