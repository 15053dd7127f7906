"""The torch functions of a model against the NumPy ones, values and gradients."""

from __future__ import annotations

import numpy as np
import pytest

import pikanid as pk
from pikanid.simulation.vectorfield import VectorField

torch = pytest.importorskip("torch")
torch_field = pytest.importorskip("pikanid.simulation.torch_field")

pytestmark = pytest.mark.kan

FORMULAS = {
    "smooth": "a*sin(x) - b*cos(v)*u + exp(-x**2)/3 + tanh(v)*atan2(x, 2) + sqrt(2 + x**2)",
    "switches": "-a*sign(v) - b*abs(v)*v + max(x, v) - min(x, 0.1) + step(x)*u",
    "clipped": "clip(a*x, -0.3, 0.4) + dead_zone(v, 0.2) + pi*b",
    "powers": "-a*signed_power(v, 1.5) + abs_power(x, b) + log_abs(v)*x**2",
    "rough": "signed_power(v, b)",
    "numbers": "sin(1)*x + exp(1)*sqrt(2) + 0*v",
    "time": "a*sin(3*t) + b",
}


def made(formula: str, **extra: object) -> pk.Model:
    return pk.Model.from_dict({
        "name": "test", "states": {"x": {}, "v": {}}, "inputs": {"u": {}},
        "parameters": {"a": {"guess": 0.7}, "b": {"guess": 0.6}, **extra.pop("parameters", {})},
        "equations": {"x": "v", "v": formula},
        "outputs": {"y": {"expression": f"x + 0.5*({formula})"}, "z": {"expression": "x"}},
        **extra})


def points(model: pk.Model, count: int = 40) -> tuple[np.ndarray, ...]:
    rng = np.random.default_rng(0)
    return (np.linspace(0.0, 2.0, count), rng.normal(size=(count, 2)), rng.normal(size=(count, 1)),
            np.array(list(model.values.values())))


def compare(model: pk.Model) -> None:
    t, x, u, p = points(model)
    numpy, field = VectorField(model), torch_field.TorchField(model)
    tt, tu = torch.tensor(t), torch.tensor(u)
    tx, tp = torch.tensor(x, requires_grad=True), torch.tensor(p, requires_grad=True)
    for ours, theirs, slopes in (
            (field.rhs, numpy.rhs, numpy.rhs_jacobians),
            (field.outputs, numpy.outputs, numpy.output_jacobians)):
        values = ours(tt, tx, tu, tp)
        np.testing.assert_allclose(values.detach(), theirs(t, x, u, p), rtol=1e-12, atol=1e-12)
        by_x, by_p = slopes(t, x, u, p)
        for column in range(2):
            gx, gp = torch.autograd.grad(values[:, column].sum(), (tx, tp), retain_graph=True,
                                         allow_unused=True)
            gp = torch.zeros_like(tp) if gp is None else gp
            np.testing.assert_allclose(gx, by_x[:, column], rtol=1e-10, atol=1e-10)
            np.testing.assert_allclose(gp, by_p[:, column].sum(axis=0), rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("formula", FORMULAS.values(), ids=FORMULAS)
def test_values_and_gradients(formula: str) -> None:
    compare(made(formula))


def test_slosh_with_parameters_given_as_numbers() -> None:
    model = pk.systems.sloshing()
    field, numpy = torch_field.TorchField(model), VectorField(model)
    rng = np.random.default_rng(1)
    t, x, u = np.zeros(30), rng.normal(size=(30, 2)), rng.normal(size=(30, 2))
    p = np.array([0.05, 0.2, 0.3, 9.81])
    got = field.rhs(*map(torch.tensor, (t, x, u)), 
                    [0.05, torch.tensor(0.2, dtype=torch.float64), 0.3, 9.81])
    np.testing.assert_allclose(got, numpy.rhs(t, x, u, p), rtol=1e-12)
    only = field.rhs(*map(torch.tensor, (t, x, u, p)), only=(1,))
    np.testing.assert_allclose(only, numpy.rhs(t, x, u, p)[:, 1:], rtol=1e-12)


def test_spline_edges_beyond_their_knots_too() -> None:
    knots = [-1.0] * 4 + [-0.4, 0.1, 0.1, 0.5] + [1.0] * 4
    values = np.random.default_rng(2).normal(size=len(knots) - 4)
    compare(made("law(x) - a*law(v)*b", splines={"law": {"degree": 3, "knots": knots}},
                 parameters={f"law_{k}": {"guess": float(v)} for k, v in enumerate(values)}))


def test_power_of_zero_has_no_infinite_gradient() -> None:
    field = torch_field.TorchField(made("-a*signed_power(v, 0.5) + abs_power(x, b)"))
    x = torch.zeros(3, 2, dtype=torch.float64, requires_grad=True)
    p = torch.tensor([0.7, 0.6], dtype=torch.float64, requires_grad=True)
    f = field.rhs(torch.zeros(3), x, torch.zeros(3, 1), p)
    gx, gp = torch.autograd.grad(f.sum(), (x, p))
    assert torch.isfinite(gx).all() and torch.isfinite(gp).all()


def test_initial_state_depends_on_parameters() -> None:
    model = pk.Model.from_dict({
        "name": "test", "states": {"x": {"initial": "2*a"}, "v": {}}, "inputs": {"u": {}},
        "parameters": {"a": {"guess": 0.7}}, "equations": {"x": "v", "v": "-x + u"},
        "outputs": {"x": {"expression": "x"}}})
    p = torch.tensor([0.7], dtype=torch.float64, requires_grad=True)
    x0 = torch_field.TorchField(model).initial(torch.zeros(1, dtype=torch.float64), p)
    (slope,) = torch.autograd.grad(x0[0], p)
    assert x0.tolist() == [1.4, 0.0] and slope.tolist() == [2.0]
