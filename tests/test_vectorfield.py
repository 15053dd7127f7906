"""The vectorised NumPy functions: values, kinks, and Jacobians against complex steps."""

from __future__ import annotations

import numpy as np
import oracle
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from nonsmooth_terms import TERMS, slosh

from pikanid.model import Model, Parameter, systems
from pikanid.simulation import VectorField

RNG = np.random.default_rng(11)


def values(model: Model) -> np.ndarray:
    return np.array(list(model.values.values()))


@pytest.mark.parametrize("make", [*systems.SYSTEMS.values()], ids=[*systems.SYSTEMS])
def test_jacobians_agree_with_complex_steps(make: object) -> None:
    """For analytic formulas: Im f(x + ih)/h has no cancellation, so that it is exact."""
    model = make()  # type: ignore[operator]
    field, h = VectorField(model), 1e-30
    if field.switches:
        pytest.skip("not analytic: their slopes are in test_systems.py")
    n, m, count = len(model.states), len(model.inputs), 20
    t, x = RNG.uniform(0, 3, count), RNG.normal(size=(count, n))
    u, p = RNG.normal(size=(count, m)), values(model)
    jacobians = (*field.rhs_jacobians(t, x, u, p), *field.output_jacobians(t, x, u, p))
    for function, fx, fp in ((field.rhs, *jacobians[:2]), (field.outputs, *jacobians[2:])):
        for j in range(n):
            shifted = x.astype(complex)
            shifted[:, j] += 1j * h
            np.testing.assert_allclose(
                fx[:, :, j], function(t, shifted, u, p).imag / h, rtol=1e-13, atol=1e-13)
        for j in range(len(p)):
            moved = p.astype(complex)
            moved[j] += 1j * h
            np.testing.assert_allclose(
                fp[:, :, j], function(t, x, u, moved).imag / h, rtol=1e-13, atol=1e-13)


@pytest.mark.parametrize("name", TERMS)
def test_kinked_terms_away_from_their_kinks(name: str) -> None:
    """Value by the reference's own formula of the term, Jacobians by differences."""
    term, count = TERMS[name], 40
    model = slosh(term)
    field, bare, p = VectorField(model), VectorField(systems.sloshing()), values(model)
    rng = np.random.default_rng(1)
    t, x = rng.uniform(0, 2, count), rng.normal(0, 0.5, (count, 2))
    u = np.column_stack([rng.normal(0, 1, count), np.zeros(count)])
    guards = term.guards(model.values)
    signs = np.array([[np.sign(g(t[i], x[i], u[i])) for g in guards] for i in range(count)])
    expected = bare.rhs(t, x, u, p[:4])[:, 1] + [
        term.force(t[i], x[i], u[i], signs[i], model.values) for i in range(count)]
    np.testing.assert_allclose(field.rhs(t, x, u, p)[:, 1], expected, rtol=1e-12, atol=1e-12)
    fx, fp = field.rhs_jacobians(t, x, u, p)
    far = np.all([[abs(g(t[i], x[i], u[i])) > 1e-2 for g in guards] for i in range(count)], axis=1)
    assert far.sum() > count / 2
    for j in range(2):
        step = np.eye(2)[j]
        slope = oracle.derivative(lambda h: field.rhs(t, x + h * step, u, p), 0.0, 1e-4)  # noqa: B023
        np.testing.assert_allclose(fx[far, :, j], slope[far], rtol=1e-6, atol=1e-6)
    for j in range(4, len(p)):
        step = np.eye(len(p))[j]
        slope = oracle.derivative(lambda h: field.rhs(t, x, u, p + h * step), 0.0, 1e-3)  # noqa: B023
        np.testing.assert_allclose(fp[far, :, j], slope[far], rtol=1e-7, atol=1e-6)


@pytest.mark.parametrize("name", TERMS)
def test_a_slope_by_one_parameter_is_that_of_all(name: str) -> None:
    model, count = slosh(TERMS[name]), 15
    t, x = RNG.uniform(0, 3, count), RNG.uniform(0.2, 1.0, (count, 2))
    u, p = RNG.normal(size=(count, 2)), values(model)
    field = VectorField(model)
    every = field.rhs_jacobians(t, x, u, p)[1]
    for k, parameter in enumerate(model.parameter_names):
        np.testing.assert_allclose(
            field.rhs_by(parameter, t, x, u, p), every[:, :, k], rtol=1e-12, atol=1e-14)


def test_at_a_kink_the_sign_is_zero() -> None:
    model = systems.sloshing().with_term("theta_dot", "-mu*sign(theta_dot)", [Parameter("mu", 2.0)])
    f = VectorField(model).rhs(np.zeros(1), np.array([[0.1, 0.0]]), np.zeros((1, 2)), values(model))
    assert f[0, 1] == pytest.approx(-9.81 / 0.045 * np.sin(0.1))


def test_shapes_for_no_one_and_many_times() -> None:
    model = systems.sloshing_2d()
    field, p = VectorField(model), values(model)
    for count in (0, 1, 7):
        t, x, u = np.zeros(count), np.zeros((count, 4)), np.zeros((count, 3))
        assert field.rhs(t, x, u, p).shape == (count, 4)
        assert field.outputs(t, x, u, p).shape == (count, 2)
        fx, fp = field.rhs_jacobians(t, x, u, p)
        hx, hp = field.output_jacobians(t, x, u, p)
        assert (fx.shape, fp.shape) == ((count, 4, 4), (count, 4, 4))
        assert (hx.shape, hp.shape) == ((count, 2, 4), (count, 2, 4))


def test_constant_and_vanishing_entries() -> None:
    model = Model.from_dict({"states": {"x": {}}, "equations": {"x": "1"},
                             "outputs": {"y": {"expression": "2"}}})
    field = VectorField(model)
    none = np.empty((5, 0))
    np.testing.assert_array_equal(field.rhs(np.zeros(5), np.zeros((5, 1)), none, np.empty(0)), 1)
    fx, fp = field.rhs_jacobians(np.zeros(5), np.zeros((5, 1)), none, np.empty(0))
    assert not fx.any()
    assert fp.shape == (5, 1, 0)


def test_non_finite_results_come_back_silently() -> None:
    model = Model.from_dict({"states": {"x": {}}, "parameters": {"k": {"guess": 1.0}},
                             "equations": {"x": "log(x) + 1/k"},
                             "outputs": {"x": {"expression": "x"}}})
    field = VectorField(model)
    f = field.rhs(np.zeros(2), np.array([[-1.0], [0.0]]), np.empty((2, 0)), np.array([0.0]))
    assert not np.isfinite(f).any()


@settings(max_examples=20)
@given(st.floats(0.2, 3.0), st.floats(-2, 2).filter(lambda v: abs(v) > 0.05))
def test_powers_and_their_slopes(n: float, v: float) -> None:
    model = Model.from_dict({
        "states": {"v": {}}, "parameters": {"n": {"guess": n}},
        "equations": {"v": "signed_power(v, n) + 2*abs_power(v, n)"},
        "outputs": {"v": {"expression": "v"}}})
    field = VectorField(model)
    t, x, u, p = np.zeros(1), np.array([[v]]), np.empty((1, 0)), np.array([n])
    weight = np.sign(v) + 2
    assert field.rhs(t, x, u, p)[0, 0] == pytest.approx(weight * abs(v) ** n, rel=1e-13)
    fx, fp = field.rhs_jacobians(t, x, u, p)
    slope = weight * np.sign(v) * n * abs(v) ** (n - 1)
    assert fx[0, 0, 0] == pytest.approx(slope, rel=1e-12)
    assert fp[0, 0, 0] == pytest.approx(weight * abs(v) ** n * np.log(abs(v)), rel=1e-12, abs=1e-12)
