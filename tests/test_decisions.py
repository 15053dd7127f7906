"""Comparisons with a dead band: rounding decides nothing."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pikanid.mismatch.fitting.decisions import BAND, RELATIVE, below, in_order, smaller, steady

ULP = 2.0**-52


@pytest.mark.parametrize("seed", range(5))
def test_numbers_that_differ_by_rounding_are_sorted_alike(seed: int) -> None:
    rng = np.random.default_rng(seed)
    exact = np.repeat(np.round(rng.uniform(1, 1e6, 20), 2), 3)
    wanted = np.argsort(-exact, kind="stable")
    for _ in range(20):
        noisy = exact * (1 + 1e-13 * rng.uniform(-1, 1, len(exact)))
        assert np.array_equal(np.argsort(-steady(noisy), kind="stable"), wanted)
    assert np.isfinite(steady(np.array([0.0, 1e-300, -1e300]))).all()
    assert np.allclose(steady(exact), exact, rtol=1e-8)


@given(st.floats(0.0, 1e12), st.floats(-100, 100))
def test_rounding_never_makes_one_criterion_lower(value: float, ulps: float) -> None:
    other = value * (1 + ulps * ULP)
    assert not below(value, other) and not below(other, value)
    assert not smaller(value, other) and not smaller(other, value)


def test_what_a_statistic_can_depend_on_is_far_outside_the_band() -> None:
    for chi2 in (1.0, 1e3, 1e6):
        assert below(chi2, chi2 + 0.01) and not below(chi2 + 0.01, chi2)
    assert BAND < 1e-4 and RELATIVE > 1e3 * ULP


def test_what_failed_is_never_lower_and_always_higher() -> None:
    assert below(1.0, np.inf) and not below(np.inf, 1.0)
    assert not below(np.inf, np.inf)


@pytest.mark.parametrize("seed", range(5))
def test_an_order_stands_under_rounding(seed: int) -> None:
    rng = np.random.default_rng(seed)
    exact = {name: float(rng.integers(990, 1000)) for name in "abcdefghijkl"}

    def noisy(size: float) -> Callable[[str], float]:
        values = {n: v * (1 + size * rng.uniform(-1, 1)) for n, v in exact.items()}
        return lambda name: values[name]

    wanted = in_order(exact, exact.__getitem__, str)
    assert wanted == sorted(exact, key=lambda n: (exact[n], n))
    for _ in range(20):
        names = list(exact)
        rng.shuffle(names)
        assert in_order(names, noisy(1e-12), str) == wanted
