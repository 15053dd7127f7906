"""Spline functions inside the ODE: values, extrapolation and sensitivities of every coefficient."""

from __future__ import annotations

import interpreted
import numpy as np
import oracle
import pytest
from comparing import compare
from scipy.interpolate import BSpline

from pikanid.model import Model, Output, Parameter, Spline, State, systems
from pikanid.recording import Recording, excitation
from pikanid.simulation import VectorField
from pikanid.simulation.simulator import Steps
from pikanid.simulation.structure import Structure

DRAG = Spline("drag", 3, (-4.0,) * 4 + (-2.0, -0.5, 0.5, 2.0) + (4.0,) * 4)
COEFFICIENTS = (3.0, 1.8, 1.4, 0.3, -0.3, -1.2, -2.0, -2.9)
TIMES = np.linspace(0, 2, 101)


def curve(spline: Spline, coefficients: tuple[float, ...] | list[float]) -> BSpline:
    return BSpline(np.array(spline.knots), np.array(coefficients), spline.degree, extrapolate=True)


def with_drag(spline: Spline = DRAG) -> Model:
    model = systems.sloshing().with_edge("theta_dot", "theta_dot", spline)
    return model.with_values(dict(zip(spline.coefficient_names, COEFFICIENTS, strict=False)))


def swing(theta: float, rate: float, u: float, p: dict[str, float]) -> float:
    return (u / p["l_theta"] * np.cos(theta) - p["g"] / p["l_theta"] * np.sin(theta)
            - p["d_theta"] / p["m"] * rate * np.cos(theta) ** 2)


@pytest.mark.parametrize("name", [None, "drag_0", "drag_3", "drag_6"])
def test_edge_agrees_with_scipys_spline_inside_and_outside_its_interval(name: str | None) -> None:
    """The angular rate reaches 2.7 rad/s: also a spline on [-1, 1] only is followed."""
    narrow = Spline("drag", 3, tuple(k / 4 for k in DRAG.knots))
    spline = DRAG if name is None else narrow
    model, recording = with_drag(spline), excitation.two_pulse(2.0, 0.02)
    signal = oracle.Signal(recording.t, recording["u_x"].values)

    def reference(p: dict[str, float]) -> np.ndarray:
        law = curve(spline, [p[n] for n in spline.coefficient_names])
        return oracle.simulate(
            lambda t, x, u, s: [x[1], swing(x[0], x[1], u[0], p) + float(law(x[1]))],
            [0, 0], TIMES, [signal], max_step=0.05).x[:, 0]

    found = compare(model, recording, reference, direction=None if name is None else {name: 0.1})
    assert found.error < 1e-6
    # third derivatives jump at the knots, where a step of order four loses an order
    assert found.slope_error < 1e-4


def two_splines() -> Model:
    """Splines of time, of splines, of |x|, and a coefficient that also stands by itself."""
    inner = Spline("inner", 2, (0.0, 0.0, 0.0, 1.0, 2.0, 2.0, 2.0))
    outer = Spline("outer", 3, (-1.0,) * 4 + (0.5,) + (2.0,) * 4)
    model = Model("nested", (State("x"), State("y")), (), (Parameter("a", 0.7),),
                  {"x": -0.5, "y": 0.0}, (Output("x", "x"), Output("y", "y")))
    model = model.with_spline(inner).with_spline(outer)
    model = model.with_values(
        {**dict(zip(inner.coefficient_names, (0.1, 0.9, 0.4, 0.7), strict=True)),
         **dict(zip(outer.coefficient_names, (0.2, -0.3, 0.5, 0.1, 0.6), strict=True))})
    model = model.with_term("x", "outer(inner(t)) + outer_1*x")
    return model.with_term("y", "outer(abs(y - a)*inner(x)) - inner_2*y")


def test_splines_of_splines_of_time_and_of_kinks() -> None:
    model = two_splines()
    recording = Recording.from_arrays(TIMES, {"ignored": TIMES})
    names = [s.coefficient_names for s in model.splines]

    def reference(p: dict[str, float]) -> np.ndarray:
        inner, outer = (curve(s, [p[n] for n in own])
                        for s, own in zip(model.splines, names, strict=True))

        def rhs(t: float, x: np.ndarray, u: np.ndarray, s: np.ndarray) -> list[float]:
            return [-0.5 + float(outer(inner(t))) + p["outer_1"] * x[0],
                    float(outer(s[0] * (x[1] - p["a"]) * inner(x[0]))) - p["inner_2"] * x[1]]

        x = oracle.simulate(rhs, [0, 0], TIMES, guards=[lambda t, x, u: x[1] - p["a"]]).x
        return x.T.ravel()

    found = compare(model, recording, reference, tolerance=1e-7)
    assert found.error < 1e-6
    assert found.slope_error < 1e-5


def test_vector_field_has_the_same_spline_and_its_exact_jacobians() -> None:
    model = with_drag()
    field, rng = VectorField(model), np.random.default_rng(3)
    t, x, u = np.zeros(40), rng.uniform(-6, 6, (40, 2)), rng.normal(size=(40, 2))
    p = np.array(list(model.values.values()))
    bare = VectorField(systems.sloshing()).rhs(t, x, u, p[:4])
    expected = bare[:, 1] + curve(DRAG, COEFFICIENTS)(x[:, 1])
    np.testing.assert_allclose(field.rhs(t, x, u, p)[:, 1], expected, rtol=1e-12, atol=1e-12)
    fx, fp = field.rhs_jacobians(t, x, u, p)
    slope = curve(DRAG, COEFFICIENTS).derivative()(x[:, 1])
    bare_fx, _ = VectorField(systems.sloshing()).rhs_jacobians(t, x, u, p[:4])
    np.testing.assert_allclose(fx[:, 1, 1], bare_fx[:, 1, 1] + slope, rtol=1e-12, atol=1e-12)
    basis = BSpline(np.array(DRAG.knots), np.eye(8), 3)(x[:, 1])
    np.testing.assert_allclose(fp[:, 1, 4:], basis, rtol=1e-10, atol=1e-10)


def test_edge_of_degree_one_has_kinks_but_exact_values() -> None:
    """A broken line is only continuous: its kinks cost the step its order, not its correctness."""
    hat = Spline("hat", 1, (-4.0, -4.0, -0.7, 0.0, 0.7, 4.0, 4.0))
    model = systems.sloshing().with_edge("theta_dot", "theta_dot", hat)
    model = model.with_values(dict(zip(hat.coefficient_names, (2.0, 1.0, 0.0, -1.0, -2.0),
                                       strict=True)))
    recording = excitation.two_pulse(1.0, 0.02)
    made = interpreted.simulator(model, recording)
    p = np.array(list(model.values.values()))
    law, signal = curve(hat, (2.0, 1.0, 0.0, -1.0, -2.0)), oracle.Signal(
        recording.t, recording["u_x"].values)
    expected = oracle.simulate(
        lambda t, x, u, s: [x[1], swing(x[0], x[1], u[0], model.values) + float(law(x[1]))],
        [0, 0], recording.t, [signal]).x[:, 0]
    errors = [np.abs(made.run(p, None, Steps("explicit", h)).y - expected).max()
              for h in (0.01, 0.0025)]
    assert errors[1] < 2e-6
    assert errors[1] < errors[0] / 8


def test_edges_survive_the_model_file() -> None:
    for model in (with_drag(), two_splines()):
        assert Model.from_dict(model.to_dict()) == model


def test_models_that_differ_in_knots_alone_are_told_apart() -> None:
    """Their formulas are the same; what is compiled for one must not be used for the other."""
    wide = with_drag(Spline("drag", 3, tuple(2.0 * k for k in DRAG.knots)))
    x, u, t = np.array([[0.1, 1.5]]), np.zeros((1, 2)), np.zeros(1)
    found = []
    for model in (with_drag(), wide):
        p = np.array(list(model.values.values()))
        found.append(float(VectorField(model).rhs(t, x, u, p)[0, 1]))
        rate = found[-1] - float(VectorField(systems.sloshing()).rhs(t, x, u, p[:4])[0, 1])
        spline = model.splines[0]
        assert rate == pytest.approx(float(curve(spline, COEFFICIENTS)(1.5)), abs=1e-12)
    assert Structure(with_drag()) != Structure(wide) and abs(found[0] - found[1]) > 0.1
