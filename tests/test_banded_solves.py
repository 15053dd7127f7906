"""Compiled solutions of small and of banded systems against dense ones."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pikanid.optimise.banded_solves import USUAL, solve_in_place
from pikanid.optimise.small_matrices import regular_inverse


def banded(rng: np.random.Generator, n: int, reach: int) -> tuple[np.ndarray, np.ndarray]:
    """A positive definite band (n, reach), row j column j of its lower half, and the matrix."""
    lower = np.tril(rng.normal(size=(n, n))) * (
        np.subtract.outer(np.arange(n), np.arange(n)) < reach)
    np.fill_diagonal(lower, rng.uniform(0.5, 2.0, n))
    matrix = lower @ lower.T
    band = np.zeros((n, reach))
    for j in range(n):
        for k in range(min(reach, n - j)):
            band[j, k] = matrix[j + k, j]
    return band, matrix


@settings(max_examples=60, deadline=None)
@given(n=st.integers(1, 15), reach=st.integers(1, USUAL + 2), count=st.integers(0, 3),
       seed=st.integers(0, 999))
def test_a_band_is_solved_as_a_dense_matrix_is(n: int, reach: int, count: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    band, matrix = banded(rng, n, reach)
    right = rng.normal(size=(n, count))
    solved = right.copy()
    assert solve_in_place(band, solved)
    np.testing.assert_allclose(matrix @ solved, right, atol=1e-6 * max(1.0, np.abs(solved).max(
        initial=0.0)))


@pytest.mark.parametrize("reach", [1, 3, USUAL])
def test_a_band_that_is_not_positive_definite_is_refused(reach: int) -> None:
    band, _ = banded(np.random.default_rng(0), 9, reach)
    band[4, 0] = -1.0
    assert not solve_in_place(band, np.ones((9, 1)))
    band[4, 0] = np.nan
    assert not solve_in_place(band, np.ones((9, 1)))


def test_a_regular_part_is_inverted_whatever_its_units() -> None:
    rng = np.random.default_rng(1)
    root = rng.normal(size=(5, 5)) + 4.0 * np.eye(5)
    units = 10.0 ** np.array([-8.0, 0.0, 3.0, 8.0, -2.0])
    matrix = root @ root.T * np.outer(units, units)
    inside = np.array([True, True, False, True, True])
    out = np.full((5, 5), np.nan)
    assert regular_inverse(matrix, inside, out)
    wanted = np.linalg.inv((root @ root.T)[np.ix_(inside, inside)])
    np.testing.assert_allclose(
        out[np.ix_(inside, inside)] * np.outer(units[inside], units[inside]), wanted, rtol=1e-10)
    assert not out[~inside].any() and not out[:, ~inside].any()


def test_a_part_that_is_nearly_singular_is_not_inverted() -> None:
    alike = np.array([[1.0, 1.0 - 1e-9], [1.0 - 1e-9, 1.0]])
    both = np.array([True, True])
    assert not regular_inverse(alike, both, np.empty((2, 2)))
    assert not regular_inverse(np.diag([1.0, -1.0]), both, np.empty((2, 2)))
