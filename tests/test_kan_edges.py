"""Edges of a KAN one by one: masked ones are none, wherever networks are read or changed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="needs the `kan` extra")
pytest.importorskip("kan.MultKAN", reason="needs the `kan` extra")

from pikanid.approximators.kan.build import build_kan  # noqa: E402
from pikanid.approximators.kan.deep import DeepKAN  # noqa: E402
from pikanid.approximators.kan.edges import (  # noqa: E402
    arguments,
    beside,
    edges_of,
    plain,
    without_edge,
)
from pikanid.approximators.kan.tensors import write  # noqa: E402

pytestmark = pytest.mark.kan

X = np.random.default_rng(0).uniform(-0.9, 0.9, (200, 2))
MASKED = {(0, 1, 0), (1, 2, 0)}


def network(base: str) -> Any:
    kan = build_kan([2, 3, 1], grid=8, base=base, noise=1.0, start="waves",
                    grid_range=[(-1, 1), (-6, 6)])  # type: ignore[arg-type]
    for number, edges in enumerate(kan.act_fun):
        mask = np.ones(tuple(edges.mask.shape))
        for layer, source, target in MASKED:
            if layer == number:
                mask[source, target] = 0.0
        write(edges.mask, mask)
        rng = np.random.default_rng(number)
        write(edges.scale_sp, rng.uniform(0.5, 1.5, tuple(edges.mask.shape)))
        if base == "silu":
            write(edges.scale_base, rng.normal(size=tuple(edges.mask.shape)))
    return kan


def output(kan: Any) -> np.ndarray:
    with torch.no_grad():
        return np.array(kan(torch.tensor(X)).numpy()[:, 0])


@pytest.mark.parametrize("base", ["zero", "silu"])
def test_edges_add_up_to_the_network(base: str) -> None:
    kan = network(base)
    deep = DeepKAN(kan)
    edges, c = edges_of(deep), deep.coefficients
    assert {(e.layer, e.source, e.target) for e in edges} == {
        *((0, i, s) for i in range(2) for s in range(3)), *((1, i, 0) for i in range(3))} - MASKED
    assert sorted(np.concatenate([e.at for e in edges])) == list(range(deep.n_coefficients))
    layers = [X, np.zeros((200, 3)), np.zeros((200, 1))]
    for e in edges:
        layers[e.layer + 1][:, e.target] += e.basis(layers[e.layer][:, e.source]) @ c[e.at]
        assert len(e.splines) == 8 + 3
    np.testing.assert_allclose(layers[2][:, 0], output(kan), atol=1e-12)
    np.testing.assert_allclose(arguments(kan, X)[1], layers[1], atol=1e-12)
    own = next(e for e in edges if (e.layer, e.target) == (1, 0))
    together = [e.at for e in edges if e.layer == 1]
    np.testing.assert_array_equal(np.sort(beside(edges, own)), np.sort(np.concatenate(together)))


@pytest.mark.parametrize("base", ["zero", "silu"])
def test_a_plain_network_is_the_same_without_what_is_masked(base: str) -> None:
    kan = network(base)
    same = plain(kan, X)
    # edges over the base function are refitted by splines on 12 intervals
    np.testing.assert_allclose(output(same), output(kan), atol=1e-12 if base == "zero" else 2e-2)
    found = {(e.layer, e.source, e.target) for e in edges_of(DeepKAN(same))}
    assert not found & MASKED and len(found) == 7


def test_without_an_edge_the_others_stay() -> None:
    kan = network("zero")
    less = without_edge(kan, 0, 0, 2)
    left = {(e.layer, e.source, e.target) for e in edges_of(DeepKAN(kan))} - {(0, 0, 2)}
    assert {(e.layer, e.source, e.target) for e in edges_of(DeepKAN(less))} == left
    np.testing.assert_allclose(arguments(less, X)[1][:, :2], arguments(kan, X)[1][:, :2])
