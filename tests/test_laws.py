"""Laws of several edges as one answer: what they leave is added up over all of them."""

from __future__ import annotations

import numpy as np
import pytest

import pikanid as pk
from pikanid.symbolic.curve import Curve
from pikanid.symbolic.laws import chosen, reading_of_laws, sum_of_laws
from pikanid.symbolic.library import LIBRARY
from pikanid.symbolic.named import NamedEdge
from pikanid.symbolic.naming import name_curve
from pikanid.symbolic.reading import Reading

X = np.linspace(-1.0, 1.0, 200)
FEW = [form for form in LIBRARY if form.name in ("linear", "quadratic", "cubic")]


def edge(law: np.ndarray, noise: float, free: np.ndarray | None = None) -> NamedEdge:
    """A law with a constant and some noise on it; `free` columns count for nothing."""
    y = law + 0.4 + noise * np.random.default_rng(0).normal(size=X.size)
    curve = Curve.of_covariance(X, y, noise**2 * np.eye(X.size), free=free)
    return name_curve(curve, FEW)


def read(*edges: NamedEdge) -> Reading:
    named = {(0, k, 0): e for k, e in enumerate(edges)}
    arguments, ranges = ["theta", "theta_dot"][: len(edges)], [(-1.0, 1.0)] * len(edges)
    laws = sum_of_laws(pk.systems.sloshing(), arguments, chosen(named), ranges)
    return reading_of_laws(laws, named, arguments, ranges, (), np.array([1.0]), [laws.label],
                           laws.covariance)


def test_what_laws_leave_is_added_up() -> None:
    cubic, square = edge(X**3, 0.02), edge(0.7 * X**2, 0.05)
    one, other, both = read(cubic), read(square), read(cubic, square)
    assert dict(both.forms) == {(0, 0, 0): "cubic", (0, 1, 0): "quadratic"}
    assert both.error_network == pytest.approx(np.hypot(one.error_network, other.error_network))
    assert both.spread == pytest.approx(np.hypot(one.spread, other.spread))
    # the best law of one edge alone leaves what a straight line through its points would
    for reading, named, law in ((one, cubic, X**3), (other, square, X**2)):
        columns = np.column_stack([law, np.ones(X.size)])
        left = np.linalg.lstsq(columns, named.curve.y, rcond=None)[1][0] / X.size
        assert reading.error_network == pytest.approx(np.sqrt(left), rel=1e-6)
        assert reading.spread == pytest.approx(np.std(named.curve.y), rel=1e-9)


def test_free_columns_count_neither_as_law_nor_as_error() -> None:
    bare, tilted = edge(X**3, 0.02, X[:, None]), edge(X**3 + 5.0 * X, 0.02, X[:, None])
    one, other = read(bare), read(tilted)
    assert set(one.forms.values()) == set(other.forms.values()) == {"cubic"}
    assert other.error_network == pytest.approx(one.error_network, rel=1e-6)
    assert other.spread == pytest.approx(one.spread, rel=1e-6)
