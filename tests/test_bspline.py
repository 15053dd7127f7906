"""B-splines against SciPy's own evaluation, and where the knots go."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BSpline as SciPyBSpline

from pikanid import errors
from pikanid.approximators import LinearApproximator
from pikanid.approximators.bspline import (
    BSpline,
    aligned_breakpoints,
    curvature_breakpoints,
    knots_from_breakpoints,
    sample_breakpoints,
    split_breakpoints,
    uniform_knots,
)
from pikanid.approximators.tables import Bases, Shown, Table, anchor, gauss_nodes


def repeated(degree: int, multiplicity: int) -> BSpline:
    """A spline on uneven breakpoints whose interior knots are repeated."""
    edges = np.array([0.0, 0.3, 1.0, 1.2, 2.5, 3.0])
    return BSpline(degree, knots_from_breakpoints(edges, degree, multiplicity))


@pytest.mark.parametrize(
    ("degree", "multiplicity"), [(1, 1), (2, 1), (2, 2), (3, 1), (3, 2), (5, 1), (5, 4), (7, 4)])
def test_derivatives_agree_with_scipy(degree: int, multiplicity: int) -> None:
    spline = repeated(degree, multiplicity)
    c = np.random.default_rng(degree).normal(size=spline.n_basis)
    t = np.concatenate([np.linspace(0.0, 2.999, 301), spline.breakpoints[:-1]])
    for q in range(degree + 1):
        wanted = SciPyBSpline(spline.knots, c, degree)(t, nu=q)
        scale = max(1.0, np.abs(wanted).max())
        assert np.allclose(spline.values(t, c, q), wanted, atol=1e-11 * scale, rtol=0)
        assert np.allclose(spline.basis(t, q) @ c, wanted, atol=1e-11 * scale, rtol=0)


def test_right_continuous_inside_left_continuous_at_the_end() -> None:
    spline = repeated(3, 2)  # second derivative jumps at the breakpoints
    c = np.random.default_rng(0).normal(size=spline.n_basis)
    for edge in spline.breakpoints[1:-1]:
        at, after = spline.values(np.array([edge, edge + 1e-9]), c, 2)
        assert at == pytest.approx(after, rel=1e-5)
    end, before = spline.values(np.array([3.0, 3.0 - 1e-9]), c, 3)
    assert end == pytest.approx(before)


def test_derivative_above_the_degree_is_zero() -> None:
    spline = repeated(2, 1)
    assert np.all(spline.values(np.linspace(0, 3, 7), np.ones(spline.n_basis), 3) == 0.0)


@pytest.mark.parametrize("t", [-1e-9, 3.0 + 1e-9, np.nan])
def test_a_time_outside_is_refused(t: float) -> None:
    with pytest.raises(ValueError, match="no value outside"):
        repeated(3, 1).basis(np.array([1.0, t]))


def test_times_need_no_order() -> None:
    spline, t = repeated(5, 4), np.random.default_rng(4).uniform(0.0, 3.0, 50)
    c = np.random.default_rng(5).normal(size=spline.n_basis)
    assert np.allclose(spline.values(t, c, 2), SciPyBSpline(spline.knots, c, 5)(t, nu=2))


@given(degree=st.integers(1, 6), intervals=st.integers(1, 30), seed=st.integers(0, 99))
def test_partition_of_unity_and_local_rows(degree: int, intervals: int, seed: int) -> None:
    spline = BSpline(degree, uniform_knots(-1.0, 4.0, intervals=intervals, degree=degree))
    t = np.sort(np.random.default_rng(seed).uniform(-1.0, 4.0, 20))
    basis = spline.basis(t)
    assert basis.nnz == t.size * (degree + 1)
    assert np.allclose(basis.sum(axis=1), 1.0)
    assert np.allclose(spline.basis(t, 1).sum(axis=1), 0.0, atol=1e-9)
    assert isinstance(spline, LinearApproximator)


def test_unclamped_knots() -> None:
    step = 0.25
    spline = BSpline(3, np.arange(-3, 8) * step)
    c = np.random.default_rng(1).normal(size=spline.n_basis)
    t = np.linspace(spline.start, spline.stop, 50)
    assert (spline.start, spline.stop) == (0.0, 1.0)
    assert np.allclose(spline.values(t, c, 1), SciPyBSpline(spline.knots, c, 3)(t, nu=1))
    assert anchor((spline,), (2,), 0.0) is None


def test_anchor_holds_value_and_slope() -> None:
    splines = (repeated(5, 4), repeated(4, 4))
    held, matrix = anchor(splines, (2, 1), 0.0) or (None, None)
    assert held is not None and matrix is not None
    c = np.random.default_rng(2).normal(size=splines[0].n_basis + splines[1].n_basis)
    c[held] = matrix @ np.array([0.3, -2.0, 7.0])
    start = np.array([0.0])
    first, second = c[:splines[0].n_basis], c[splines[0].n_basis:]
    assert splines[0].values(start, first)[0] == pytest.approx(0.3)
    assert splines[0].values(start, first, 1)[0] == pytest.approx(-2.0)
    assert splines[1].values(start, second)[0] == pytest.approx(7.0)


@given(st.lists(st.floats(0.01, 9.99), max_size=12, unique=True), st.floats(0.05, 20.0))
def test_aligned_breakpoints_hold_every_switch(switches: list[float], spacing: float) -> None:
    times = np.sort(np.array(switches))
    edges = aligned_breakpoints(0.0, 10.0, times, spacing)
    assert edges[0] == 0.0 and edges[-1] == 10.0
    assert np.all(np.diff(edges) > 0.0)
    assert np.diff(edges).max() <= spacing * (1 + 1e-6)
    assert np.all(np.isin(times, edges))


def test_breakpoints_follow_samples_and_curvature() -> None:
    t = np.linspace(0.0, 5.0, 501)
    assert np.allclose(sample_breakpoints(t, 0.0, 5.0, 80), np.linspace(0.0, 5.0, 81))
    y = np.where(t < 4.0, 0.0, np.sin(30 * t))
    edges = curvature_breakpoints(t, y, 0.0, 5.0, 40)
    assert edges.size == 41 and np.all(np.diff(edges) > 0.0)
    assert np.mean(edges > 4.0) > 0.4
    assert np.allclose(curvature_breakpoints(t, 0 * t, 0.0, 5.0, 10), np.linspace(0, 5, 11))
    assert np.allclose(split_breakpoints(np.array([0.0, 1.0, 3.0])), [0.0, 0.5, 1.0, 2.0, 3.0])


def test_gauss_nodes_never_touch_a_breakpoint() -> None:
    edges = np.array([0.0, 0.2, 0.6, 1.2])
    times, weights = gauss_nodes(edges, 4)
    assert np.all(np.diff(times) > 0.0)
    assert np.all(np.histogram(times, edges)[0] == 4)
    assert np.abs(times[:, None] - edges[None]).min() > 1e-3
    assert weights.sum() == pytest.approx(1.2)


def test_table_is_the_basis_at_fixed_times() -> None:
    spline = repeated(4, 2)
    c = np.random.default_rng(3).normal(size=spline.n_basis + 5)
    t = np.linspace(0.0, 3.0, 11)
    table = Table.of(spline, t, 2, slice(5, 5 + spline.n_basis))
    assert np.allclose(table.values(c), spline.values(t, c[5:], 2))
    first, local = table.window
    assert first.min() >= 5 and local.shape == (11, 5)


def test_bases_in_one_piece_of_memory_are_the_tables() -> None:
    """Splines of different degrees behind each other, each with its own derivative."""
    splines, t = (repeated(4, 2), repeated(3, 1)), np.linspace(0.0, 3.0, 13)
    ends = np.cumsum([0, *(spline.n_basis for spline in splines)]).tolist()
    parts = [slice(ends[0], ends[1]), slice(ends[1], ends[2])]
    shown = [Shown(splines[i], q, parts[i]) for i, q in ((0, 0), (1, 1), (0, 2))]
    tables = [Table.of(spline, t, q, part) for spline, q, part in shown]
    shared, bases = Bases.of(shown, t)
    c = np.random.default_rng(4).normal(size=ends[-1])
    assert bases is not None
    values = bases.values(c)
    for k, (own, table) in enumerate(zip(shared, tables, strict=True)):
        np.testing.assert_array_equal(values[k], table.values(c))
        np.testing.assert_array_equal(own.values(c), table.values(c))
        assert np.shares_memory(own.window[1], bases.local)


@pytest.mark.parametrize("knots", [np.zeros(3), np.array([0.0, 0, 1, 0.5, 2, 2]),
                                   np.array([0.0, 0, 0, 1, np.nan, 1])])
def test_bad_knots_are_refused(knots: np.ndarray) -> None:
    with pytest.raises(errors.BadSetting):
        BSpline(2, knots)
