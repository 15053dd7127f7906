"""The shallow KAN against pykan's own forward pass, torch autograd and SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from pikanid import errors

torch = pytest.importorskip("torch", reason="needs the `kan` extra")
pytest.importorskip("kan.MultKAN", reason="needs the `kan` extra")

from pikanid.approximators import LinearApproximator  # noqa: E402
from pikanid.approximators.kan import ShallowKAN, build_kan  # noqa: E402
from pikanid.approximators.kan.bases import silu  # noqa: E402
from pikanid.approximators.kan.tensors import read, write  # noqa: E402

pytestmark = pytest.mark.kan

Array = NDArray[np.float64]
SWITCHES = (0.2, 0.6, 1.2, 1.6)


def shallow_kan(
    k: int = 3,
    grid: int = 40,
    outputs: int = 1,
    base: str = "zero",
    kinks: tuple[float, ...] = (),
) -> ShallowKAN:
    kan = build_kan([1, outputs], grid=grid, k=k, grid_range=(0.0, 5.0), base=base)  # type: ignore[arg-type]
    shallow = ShallowKAN(kan, kinks)
    rng = np.random.default_rng(k)
    shallow.set_coefficients(rng.normal(size=(shallow.n_basis, outputs)))
    return shallow


def times(extra: tuple[float, ...] = ()) -> Array:
    inner = np.random.default_rng(0).uniform(0.0, 5.0, 120)
    return np.sort(np.concatenate([[0.0, 5.0], inner, extra]))


def by_autograd(shallow: ShallowKAN, t: Array, derivative: int, output: int) -> Array:
    """The derivative of pykan's own forward pass, and of the kinks beside it."""
    column = torch.tensor(t[:, None], requires_grad=True)
    value = shallow.kan(column)[:, output]
    for _ in range(derivative):
        (grad,) = torch.autograd.grad(value.sum(), column, create_graph=True)
        value = grad[:, 0]
    curve: Array = value.detach().numpy().copy()
    for kink in shallow.kinks:
        curve += kink(t, derivative)[:, output]
    return curve


@pytest.mark.parametrize("kinks", [(), SWITCHES], ids=["splines", "kinks"])
@pytest.mark.parametrize("base", ["zero", "silu"])
@pytest.mark.parametrize("k", [2, 3, 4, 5, 7])
def test_curve_and_derivatives_are_pykans(k: int, base: str, kinks: tuple[float, ...]) -> None:
    shallow = shallow_kan(k, 20, outputs=2, base=base, kinks=kinks)
    t = times(kinks)
    c = shallow.coefficients
    for derivative in range(min(k, 4)):
        for output in (0, 1):
            wanted = by_autograd(shallow, t, derivative, output)
            got = shallow.values(t, c, derivative)[:, output]
            scale = np.abs(wanted).max()
            np.testing.assert_allclose(got, wanted, rtol=0.0, atol=2e-12 * scale)
    values = shallow.values(t, c)
    scale = np.abs(values).max()
    np.testing.assert_allclose(shallow.forward(t), values, rtol=0.0, atol=1e-12 * scale)


def test_basis_is_scipys() -> None:
    shallow = shallow_kan()
    t = times()
    theirs = BSpline.design_matrix(t, shallow.knots, 3).toarray()
    np.testing.assert_allclose(shallow.basis(t).toarray(), theirs, atol=1e-15)


def test_top_derivative_at_the_end_comes_from_inside() -> None:
    """pykan's k-th derivative at T is the limit from outside the grid; ours is not."""
    shallow = shallow_kan(k=2, grid=10)
    c = shallow.coefficients
    end = shallow.values(np.array([5.0]), c, 2)[0, 0]
    before = shallow.values(np.array([4.9]), c, 2)[0, 0]
    assert end == pytest.approx(before, rel=1e-9)
    theirs = by_autograd(shallow, np.array([4.9, 5.0]), 2, 0)
    assert theirs[0] == pytest.approx(before, rel=1e-9)
    assert abs(theirs[1] - before) > 0.1 * abs(before)


@pytest.mark.parametrize("kinks", [(), SWITCHES])
def test_rows_are_short_and_equally_long(kinks: tuple[float, ...]) -> None:
    shallow = shallow_kan(k=5, grid=160, kinks=kinks)
    assert isinstance(shallow, LinearApproximator)
    t = np.linspace(0.0, 5.0, 501)
    for derivative in range(4):
        matrix = shallow.basis(t, derivative)
        first, values = shallow.local(t, derivative)
        assert values.shape[1] == (6 if not kinks else 8)  # at most one switch in reach here
        dense = np.zeros(matrix.shape)
        np.put_along_axis(dense, first[:, None] + np.arange(values.shape[1]), values, axis=1)
        assert np.array_equal(dense, matrix.toarray())


def test_kink_columns_span_the_kinks() -> None:
    """Both truncated powers are in the span; without the columns they are not."""
    t = np.linspace(0.0, 5.0, 2001)
    wanted = np.stack([np.clip(t - 0.63, 0, None) ** r for r in (2, 3)], axis=1)
    rich = shallow_kan(k=5, kinks=(0.63,)).basis(t).toarray()
    poor = shallow_kan(k=5).basis(t).toarray()
    for matrix, worst in ((rich, 1e-11), (poor, None)):
        left = wanted - matrix @ np.linalg.lstsq(matrix, wanted, rcond=None)[0]
        if worst is None:
            assert np.abs(left).max() > 1e-6
        else:
            assert np.abs(left).max() < worst
    assert np.linalg.cond(rich) < 1e4


def test_kinks_stand_beside_with_their_jumps() -> None:
    shallow = shallow_kan(k=5, grid=40, kinks=SWITCHES)
    assert [(q.time, q.order) for q in shallow.kinks] == [(t, o) for t in SWITCHES for o in (2, 3)]
    jump = shallow.kinks[2].jump[0]
    c = shallow.coefficients
    after = shallow.values(np.array([0.6]), c, 2)[0, 0]  # from the right
    before = shallow.values(np.array([0.6 - 1e-12]), c, 2)[0, 0]
    assert after - before == pytest.approx(jump, rel=1e-7)


def test_kinks_are_local_and_as_large_as_the_curve() -> None:
    """Truncated powers grow with time, and the network against them: what is left is rounding."""
    shallow = shallow_kan(k=5, grid=320, kinks=SWITCHES)
    t, cell = np.linspace(0.0, 5.0, 4001), 5.0 / 320
    for kink in shallow.kinks:
        values = kink(t)[:, 0]
        assert np.all(values[np.abs(t - kink.time) > 5 * cell] == 0.0)
        assert np.abs(values).max() <= 5 * np.abs(kink.jump[0]) * cell**kink.order


def test_kinks_of_other_knots_are_refused() -> None:
    coarse = shallow_kan(k=5, grid=20, kinks=(0.2,))
    with pytest.raises(errors.BadSetting, match="other knots"):
        ShallowKAN(build_kan([1, 1], grid=40, k=5, grid_range=(0.0, 5.0)), coarse.kinks)


def test_coefficients_round_trip() -> None:
    shallow = shallow_kan(k=5, grid=30, outputs=3, base="silu", kinks=SWITCHES)
    c = np.random.default_rng(5).normal(size=(shallow.n_basis, 3))
    shallow.set_coefficients(c)
    np.testing.assert_allclose(shallow.coefficients, c, atol=1e-12)


@pytest.mark.parametrize("grids", [(20, 40), (40, 120)])
@pytest.mark.parametrize("k", [3, 5])
def test_refined_curve_is_the_same(k: int, grids: tuple[int, int]) -> None:
    """At k = 3 the kink of order 3 at 1.25 falls on a knot when refined: the spline takes it."""
    coarse = shallow_kan(k=k, grid=grids[0], kinks=(0.2, 0.63, 1.3125))
    fine = coarse.refined(grids[1])
    t = times()
    for derivative in range(3):
        a = coarse.values(t, coarse.coefficients, derivative)
        b = fine.values(t, fine.coefficients, derivative)
        np.testing.assert_allclose(b, a, rtol=0.0, atol=1e-12 * np.abs(a).max())


def test_silu_derivatives() -> None:
    x = torch.linspace(-4, 6, 41, dtype=torch.float64).requires_grad_(True)
    value = torch.nn.functional.silu(x)
    for derivative in range(5):
        wanted = value.detach().numpy()
        np.testing.assert_allclose(silu(x.detach().numpy(), derivative), wanted, atol=1e-13)
        (value,) = torch.autograd.grad(value.sum(), x, create_graph=True)


def test_bad_use_is_explained() -> None:
    shallow = shallow_kan(k=3, grid=10)
    with pytest.raises(errors.BadSetting, match="leave the KAN's grid"):
        shallow.basis(np.array([5.1]))
    with pytest.raises(errors.BadSetting, match="coefficients of shape"):
        shallow.set_coefficients(np.zeros(4))
    with pytest.raises(errors.BadSetting, match="kink at t = 5"):
        ShallowKAN(shallow.kan, [5.0])
    with pytest.raises(errors.BadSetting, match="order of a kink"):
        ShallowKAN(shallow.kan, [1.0], [4])
    with pytest.raises(errors.BadSetting, match="not shallow"):
        ShallowKAN(build_kan([1, 2, 1]))
    shallow.kan.fix_symbolic(0, 0, 0, "x", fit_params_bool=False, verbose=False)
    with pytest.raises(errors.BadSetting, match="symbolic"):
        ShallowKAN(shallow.kan)


@pytest.mark.parametrize("base", ["zero", "silu"])
def test_a_masked_output_is_zero_whatever_its_coefficients_are(base: str) -> None:
    shallow = shallow_kan(outputs=3, base=base)
    edges = shallow.kan.act_fun[0]
    rng = np.random.default_rng(1)
    write(edges.scale_sp, rng.uniform(0.5, 2.0, (1, 3)))
    write(edges.mask, np.array([[1.0, 0.0, 1.0]]))
    t, c = times(), shallow.coefficients
    assert not c[:, 1].any() and c[:, [0, 2]].any(axis=0).all()
    np.testing.assert_allclose(shallow.values(t, c), shallow.forward(t), atol=1e-12)
    before = read(edges.coef)[0, [0, 2]]
    shallow.set_coefficients(np.column_stack([c[:, 0], np.ones(len(c)), 2 * c[:, 2]]))
    np.testing.assert_allclose(read(edges.coef)[0, [0, 2]], before * [[1.0], [2.0]])
    np.testing.assert_allclose(shallow.coefficients, c * [1.0, 0.0, 2.0], atol=1e-12)
    assert not shallow.forward(t)[:, 1].any()
