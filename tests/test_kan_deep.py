"""The fast evaluation of deep KANs against pykan's forward pass and torch autograd."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from pikanid import errors

torch = pytest.importorskip("torch", reason="needs the `kan` extra")
pytest.importorskip("kan.MultKAN", reason="needs the `kan` extra")

from pikanid.approximators.kan import DeepKAN, build_kan  # noqa: E402
from pikanid.approximators.kan.tensors import write  # noqa: E402

pytestmark = pytest.mark.kan

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Case:
    width: list[Any]
    k: int = 3
    base: str = "zero"
    arity: Any = 2
    masked: bool = False
    affine: bool = False
    order: int = 2


CASES = {
    "1-1": Case([1, 1]),
    "1-5-1": Case([1, 5, 1]),
    "1-5-1 silu": Case([1, 5, 1], 5, "silu"),
    "2-3-2": Case([2, 3, 2]),
    "product": Case([2, [2, 1], 1]),
    "products of three": Case([2, [2, 2], [1, 1], 2], 4, "silu", 3),
    "mixed products": Case([2, [1, 2], 1], arity=[[], [2, 3], []], masked=True),
    "three layers, leaving the grid": Case([1, 4, 3, 1], 3, "silu", 2, True, True),
    "affine products": Case([2, [2, 2], 2], affine=True),
    "quadratic": Case([2, 2, 1], 2, order=1),
}


def build(case: Case) -> Any:
    kan = build_kan(
        case.width,
        grid=8,
        k=case.k,
        base=case.base,  # type: ignore[arg-type]
        mult_arity=case.arity,
        noise=3.0,
        start="waves",
    )
    rng = np.random.default_rng(1)
    if case.masked:
        mask = np.ones(kan.act_fun[0].mask.shape)
        mask[0, 0] = 0.0
        write(kan.act_fun[0].mask, mask)
    if case.affine:
        for layer in range(kan.depth):
            for place in (kan.node_scale, kan.node_bias, kan.subnode_scale, kan.subnode_bias):
                write(place[layer], rng.normal(size=place[layer].shape))
    return kan


def reference(kan: Any, x: Array, first: Array, second: Array, order: int) -> tuple[Any, Any]:
    """Jets along x(s) and their Jacobians, by differentiating pykan again and again."""
    s = torch.zeros(len(x), 1, dtype=torch.float64, requires_grad=True)
    path = torch.tensor(x) + s * torch.tensor(first) + s**2 / 2 * torch.tensor(second)
    parameters = [p for p in kan.parameters() if p.requires_grad]
    names = [n for n, p in kan.named_parameters() if p.requires_grad]
    layers = sorted(range(len(names)), key=lambda i: (names[i].split(".")[1], "scale" in names[i]))
    parameters = [parameters[i] for i in layers]
    outputs = kan(path)
    jets, jacobians = [], []
    for o in range(outputs.shape[1]):
        value = outputs[:, [o]]
        jets.append([])
        jacobians.append([])
        for depth in range(order + 1):
            jets[o].append(value.detach().numpy()[:, 0])
            rows = []
            for row in value[:, 0]:
                grads = torch.autograd.grad(
                    row, parameters, retain_graph=True, allow_unused=True, materialize_grads=True
                )
                rows.append(np.concatenate([g.numpy().ravel() for g in grads]))
            jacobians[o].append(np.array(rows))
            if depth < order:
                (value,) = torch.autograd.grad(value.sum(), s, create_graph=True)
    return np.array(jets), np.array(jacobians)


@pytest.mark.parametrize("name", CASES)
def test_jets_and_jacobians_are_pykans(name: str) -> None:
    case = CASES[name]
    kan = build(case)
    deep = DeepKAN(kan)
    rng = np.random.default_rng(2)
    x = rng.uniform(-1.0, 1.0, (12, deep.plan.nodes(0)))
    x[0], x[1] = -1.0, 1.0
    first, second = rng.normal(size=x.shape), rng.normal(size=x.shape)
    jets, jacobians = reference(kan, x, first, second, case.order)
    c = deep.coefficients
    jet = deep.evaluate(x, c, first=first, second=second, order=case.order, jacobian=True)
    for d in range(case.order + 1):
        wanted = jets[:, d].T
        scale = np.abs(wanted).max()
        np.testing.assert_allclose(jet.values[d], wanted, rtol=0.0, atol=1e-12 * scale)
        wanted = jacobians[:, d].transpose(1, 0, 2)
        if case.masked:
            # Masked edges have zero columns, which the coefficients leave out.
            assert np.all(wanted[..., ~deep._active] == 0.0)
            wanted = wanted[..., deep._active]
        scale = np.abs(wanted).max()
        np.testing.assert_allclose(jet.jacobians[d], wanted, rtol=0.0, atol=1e-12 * scale)


def test_gradient_in_the_inputs() -> None:
    kan = build(CASES["products of three"])
    deep = DeepKAN(kan)
    x = np.random.default_rng(3).uniform(-1, 1, (30, 2))
    jet = deep.evaluate(x, deep.coefficients, order=0, jacobian=True)
    place = torch.tensor(x, requires_grad=True)
    for output in range(2):
        (grad,) = torch.autograd.grad(kan(place)[:, output].sum(), place)
        assert jet.inputs is not None
        np.testing.assert_allclose(jet.inputs[:, output], grad.numpy(), rtol=1e-11, atol=1e-13)


def test_one_input_is_its_own_time() -> None:
    deep = DeepKAN(build(CASES["1-5-1"]))
    t, c = np.linspace(-1, 1, 41), deep.coefficients
    jet = deep.evaluate(t, c, jacobian=True)
    for derivative in range(3):
        close = {"rtol": 1e-13, "atol": 1e-13}
        np.testing.assert_allclose(
            deep.values(t, c, derivative), jet.values[derivative][:, 0], **close
        )
        np.testing.assert_allclose(
            deep.jacobian(t, c, derivative), jet.jacobians[derivative][:, 0], **close
        )


def test_fades_outside_the_grid_as_pykan() -> None:
    kan = build(CASES["1-1"])
    deep = DeepKAN(kan)
    x = np.linspace(-4, 4, 161)
    with torch.no_grad():
        wanted = kan(torch.tensor(x[:, None])).numpy()
    np.testing.assert_allclose(deep.evaluate(x, deep.coefficients).values[0], wanted, atol=1e-14)
    assert np.all(deep.evaluate(np.array([1e300, -1e300]), deep.coefficients).values[0] == 0.0)
    assert np.isnan(deep.evaluate(np.array([np.nan, 0.0]), deep.coefficients).values[0][0, 0])
    assert deep.coverage(x, deep.coefficients)[0] == pytest.approx(np.array([[-1.5, 2.5]]))


def test_coefficients_flow_back() -> None:
    deep = DeepKAN(build(CASES["mixed products"]))
    c = np.random.default_rng(4).normal(size=deep.n_coefficients)
    deep.set_coefficients(c)
    assert np.array_equal(deep.coefficients, c)
    x = np.random.default_rng(5).uniform(-1, 1, (20, 2))
    with torch.no_grad():
        wanted = deep.kan(torch.tensor(x)).numpy()
    np.testing.assert_allclose(deep.evaluate(x, c).values[0], wanted, atol=1e-12)


def test_bad_use_is_explained() -> None:
    kan = build_kan([1, 2, 1])
    deep = DeepKAN(kan)
    with pytest.raises(errors.BadSetting, match="coefficients of shape"):
        deep.evaluate(np.zeros(3), np.zeros(3))
    with pytest.raises(errors.BadSetting, match="order"):
        deep.evaluate(np.zeros(3), deep.coefficients, order=3)
    kan.act_fun[0].grid.data[0, 5] += 0.01
    with pytest.raises(errors.BadSetting, match="not uniform"):
        DeepKAN(kan)
