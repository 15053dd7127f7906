"""What an edge contributes: its size, standard error and Wald test by hand."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import binom, chi2

pytest.importorskip("torch", reason="needs the `kan` extra")

from pikanid.symbolic.significance import _size

RNG = np.random.default_rng(0)
A = RNG.normal(size=(50, 6)) @ np.diag([1.0, 2.0, 0.5, 1.0, 1.0, 0.0])
A[:, 4] = A[:, 3] - A[:, 0]  # four directions that the data see, of six coefficients
ROOT = 0.3 * RNG.normal(size=(6, 6))
V = ROOT @ ROOT.T
C = RNG.normal(size=6)


def test_size_and_its_error_by_differences() -> None:
    def size(c: np.ndarray) -> float:
        return float(np.sqrt(np.mean((A @ c) ** 2)))

    slope = np.array([(size(C + h) - size(C - h)) / 2e-6 for h in 1e-6 * np.eye(6)])
    found = _size(A, C, V)
    assert found[:2] == pytest.approx((size(C), np.sqrt(slope @ V @ slope)), rel=1e-6)
    assert _size(A, np.zeros(6), V) == (0.0, 0.0, 1.0)


def test_wald_has_as_many_degrees_as_directions_are_seen() -> None:
    for scale in (0.3, 1.0, 2.0):
        seen = A @ (scale * C)
        statistic = float(seen @ np.linalg.pinv(A @ V @ A.T, 1e-10) @ seen)
        assert _size(A, scale * C, V)[2] == pytest.approx(chi2.sf(statistic, 4), rel=1e-6)


def test_without_an_effect_p_values_are_uniform() -> None:
    p = np.array([_size(A, c, V)[2] for c in RNG.normal(size=(600, 6)) @ ROOT.T])
    for alpha in (0.05, 0.3, 0.7):
        assert binom.ppf(0.001, 600, alpha) <= np.sum(p < alpha) <= binom.ppf(0.999, 600, alpha)


def test_what_the_data_do_not_see_is_nothing() -> None:
    assert _size(np.zeros((50, 6)), C, V) == (0.0, 0.0, 1.0)
