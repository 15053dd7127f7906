"""Edges of a missing force: splines over what was visited, smoothed as an exact search would."""

from __future__ import annotations

import numpy as np
import pytest

from pikanid.mismatch.beyond.force_shape import (
    GRID,
    _explained,
    _Smoother,
    _Spline,
    _without_constant,
)


@pytest.fixture
def spline() -> _Spline:
    made = _Spline()
    made.visits = np.random.default_rng(0).normal(0.3, 1.0, 500)
    return made


def test_coefficients_at_the_sites_make_a_straight_line(spline: _Spline) -> None:
    x = np.linspace(spline.visits.min(), spline.visits.max(), 50)
    basis = spline.matrix(x)
    assert basis.shape[1] == len(spline.sites())
    np.testing.assert_allclose(basis @ spline.sites(), x, atol=1e-12)
    np.testing.assert_allclose(basis.sum(axis=1), 1.0)
    beyond = spline.matrix(np.array([x[0] - 1.0, x[-1] + 1.0]))
    np.testing.assert_allclose(beyond @ spline.sites(), [x[0], x[-1]])


def test_an_edge_is_drawn_without_its_mean_and_its_line(spline: _Spline) -> None:
    line, seen = spline.sites(), spline.matrix(spline.visits)
    covariance = np.outer(line, line)
    values, std = spline.drawn(line, covariance, False)
    wanted = spline.grid - spline.visits.mean()
    np.testing.assert_allclose(values, wanted, atol=1e-9)
    np.testing.assert_allclose(std, np.abs(wanted), atol=1e-6)
    values, std = spline.drawn(line, covariance, True)
    np.testing.assert_allclose(values, np.zeros(GRID), atol=1e-9)
    np.testing.assert_allclose(std, np.zeros(GRID), atol=1e-6)
    bent = np.random.default_rng(1).normal(size=len(line))
    values, _ = spline.drawn(bent, covariance, True)
    straight = np.column_stack([np.ones(500), spline.visits])
    rest = np.linalg.lstsq(straight, seen @ bent, rcond=None)[0]
    np.testing.assert_allclose(
        values, spline.matrix(spline.grid) @ bent - rest[0] - rest[1] * spline.grid, atol=1e-9)


@pytest.mark.parametrize("noise", [0.01, 0.3, 3.0])
def test_smoothing_is_that_of_generalised_cross_validation(noise: float) -> None:
    rng = np.random.default_rng(2)
    size = rng.uniform(0.5, 2.0, 11)
    columns, x = rng.normal(size=(80, 11)), np.linspace(0.0, 1.0, 11)
    target = (columns * size) @ np.sin(2 * np.pi * x) / 3 + noise * rng.normal(size=80)
    rest, owner = columns, np.zeros(11, int)
    bends = np.diff(np.eye(11), 2, axis=0) / size
    info, penalty = rest.T @ rest, bends.T @ bends
    found = []
    for rho in np.trace(info) / np.trace(penalty) * 10.0 ** np.arange(-9.0, 4.0, 0.5):
        inverse = np.linalg.inv(info + rho * penalty)
        hat = rest @ inverse @ rest.T
        left = target - hat @ target
        found.append((float(left @ left) / (80 - np.trace(hat)) ** 2, inverse))
    inverse = min(found, key=lambda f: f[0])[1]
    smoother = _Smoother(rest, target, owner, size)
    got, covariance = smoother.coefficients(target), smoother.covariance
    np.testing.assert_allclose(got, inverse @ rest.T @ target / size, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(covariance, inverse / np.outer(size, size), rtol=1e-6, atol=1e-9)


def test_what_a_constant_force_can_do_is_taken_out() -> None:
    columns = np.random.default_rng(3).normal(size=(30, 5))
    left = _without_constant(columns)
    np.testing.assert_allclose(columns.sum(axis=1) @ left, 0.0, atol=1e-12)
    assert np.linalg.matrix_rank(left, tol=1e-9) == 4
    np.testing.assert_array_equal(_without_constant(np.zeros((30, 5))), np.zeros((30, 5)))
    target = np.random.default_rng(4).normal(size=30)
    explained, rank = _explained(columns, target)
    rest = target - columns @ np.linalg.lstsq(columns, target, rcond=None)[0]
    assert rank == 5 and explained == pytest.approx(target @ target - rest @ rest)
