"""Refinement keeps the function, where pykan's own does not; pruning keeps what matters."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pikanid import errors

torch = pytest.importorskip("torch", reason="needs the `kan` extra")
pytest.importorskip("kan.MultKAN", reason="needs the `kan` extra")

from pikanid.approximators.kan import DeepKAN, build_kan, prune, refine, regrid  # noqa: E402
from pikanid.approximators.kan.prune import scores  # noqa: E402
from pikanid.approximators.kan.quiet import pykan_module, undisturbed  # noqa: E402
from pikanid.approximators.kan.tensors import write  # noqa: E402

pytestmark = pytest.mark.kan


def values(kan: Any, x: Any) -> Any:
    with torch.no_grad():
        return kan(torch.as_tensor(x, dtype=torch.float64).reshape(len(x), -1)).numpy()


@pytest.mark.parametrize("k", [1, 2, 3, 5, 7])
@pytest.mark.parametrize("path", [(10, 20, 40, 80), (7, 21, 63), (1, 2, 4, 8)])
def test_chain_of_grids_keeps_the_function(path: tuple[int, ...], k: int) -> None:
    kan = build_kan([1, 1], grid=path[0], k=k, grid_range=(0.0, 5.0), noise=path[0])
    t = np.linspace(0.0, 5.0, 501)
    before = values(kan, t)
    for grid in path[1:]:
        result = refine(kan, grid)
        kan = result.kan
        assert result.exact and result.error < 1e-12 and kan.grid == grid
    np.testing.assert_allclose(values(kan, t), before, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("width", [[1, 5, 1], [2, [2, 1], 2], [1, 3, 3, 1]])
def test_multilayer_networks_keep_the_function(width: list[Any]) -> None:
    kan = build_kan(width, grid=10, base="silu", noise=2.0, start="waves")
    x = np.random.default_rng(0).uniform(-1, 1, (300, width[0]))
    before, finer = values(kan, x), kan.refine(20)
    deep = DeepKAN(kan)
    inside = [c.min() >= 0 and c.max() <= 1 for c in deep.coverage(x, deep.coefficients)]
    if not all(inside):  # w_b can carry hidden values past the grid; start from a wider one
        ranges = [(-3.0, 3.0)] * kan.depth
        kan = regrid(kan, ranges, 30).kan
        before, finer = values(kan, x), kan.refine(60)
    np.testing.assert_allclose(values(finer, x), before, rtol=0.0, atol=1e-12)


def test_pykans_own_refinement_destroys_the_function(tmp_path: Path, monkeypatch: Any) -> None:
    """The trap: 51 points at 40 -> 80 intervals."""
    monkeypatch.chdir(tmp_path)
    kan = build_kan([1, 1], grid=40, grid_range=(0.0, 5.0), noise=40.0)
    t = np.linspace(0.0, 5.0, 501)
    before = values(kan, t)
    values(kan, t[::10])
    with undisturbed(double=True):
        (tmp_path / "model").mkdir()
        theirs = pykan_module().MultKAN.refine(kan, 80)
    assert np.abs(values(theirs, t) - before).max() > 0.05
    assert np.abs(values(kan.refine(80), t) - before).max() < 1e-12


def test_uneven_ratio_reports_its_error() -> None:
    kan = build_kan([1, 1], grid=10, noise=10.0)
    t = np.linspace(-1, 1, 1001)
    result = refine(kan, 15)
    change = np.abs(values(result.kan, t) - values(kan, t)).max()
    assert not result.exact and 0.0 < change <= result.error * 1.05
    assert refine(kan, 150).exact


def test_uneven_knots_are_refined_exactly() -> None:
    kan = build_kan([1, 1], grid=4, noise=4.0)
    write(kan.act_fun[0].grid, np.array([[-2.5, -2, -1.5, -1, -0.7, 0.1, 0.4, 1, 1.5, 2, 2.5]]))
    result = refine(kan, 12)
    t = np.linspace(-1, 1, 301)
    assert result.exact
    np.testing.assert_allclose(values(result.kan, t), values(kan, t), atol=1e-12)


def test_regrid_widens_hidden_grids() -> None:
    kan = build_kan([1, 3, 1], grid=10, start="waves")
    wide = regrid(kan, [(-1.0, 1.0), (-2.0, 2.0)])
    t = np.linspace(-1, 1, 101)
    assert wide.kan.grid == [10, 20] and wide.error < 0.05
    np.testing.assert_allclose(values(wide.kan, t), values(kan, t), atol=0.05)
    with pytest.raises(errors.BadSetting, match="ranges"):
        regrid(kan, [(0, 1)])
    with pytest.raises(errors.BadSetting, match="grid"):
        refine(kan, 0)


@pytest.mark.parametrize("arity", [2, [[], [2, 3], []]])
def test_prune_drops_what_does_nothing(arity: Any) -> None:
    kan = build_kan([2, [3, 2], 1], noise=2.0, start="waves", mult_arity=arity)
    kan.act_fun[1].coef.data[[1, 4]] = 0.0
    x = np.random.default_rng(0).uniform(-1, 1, (200, 2))
    before = values(kan, x)
    smaller = prune(kan, x, edge_threshold=0.0)
    assert smaller.width == [[2, 0], [2, 1], [1, 0]]
    np.testing.assert_allclose(values(smaller, x), before, atol=1e-12)
    assert kan.width == [[2, 0], [3, 2], [1, 0]]


def test_scores_and_nodes_are_pykans(tmp_path: Path, monkeypatch: Any) -> None:
    kan = build_kan([2, 4, 1], noise=2.0, start="waves")
    kan.act_fun[1].coef.data[2:] *= 1e-3
    found = scores(kan)
    kan.attribute()
    assert np.array_equal(found.nodes[1], kan.node_scores[1].detach().numpy())
    assert prune(kan).width == kan.prune_node().width == kan.prune().width
    weak = prune(kan, edge_threshold=1e9)
    assert all(float(layer.mask.sum()) == 0.0 for layer in weak.act_fun)
    assert prune(kan, node_threshold=1e9).width[1] == [1, 0]
