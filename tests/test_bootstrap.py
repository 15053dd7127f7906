"""The block bootstrap: widths of correlated series, and how often it calls chance a difference."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import binomtest

from pikanid.comparison.bootstrap import block_length, pairs, resampled_means


def ar1(rho: float, n: int, seed: int) -> np.ndarray:
    e = np.random.default_rng(seed).standard_normal(n + 500)
    return lfilter([1.0], [1.0, -rho], e)[500:]


@pytest.mark.parametrize("rho", [0.0, 0.5, 0.8])
def test_the_spread_of_a_mean_is_that_of_the_process(rho: float) -> None:
    n = 4000
    widths = [resampled_means([ar1(rho, n, seed)], 300, seed).std() for seed in range(20)]
    assert np.mean(widths) == pytest.approx(1 / (1 - rho) / np.sqrt(n), rel=0.15)


def test_blocks_grow_with_the_correlation() -> None:
    lengths = [np.median([block_length(ar1(rho, 2000, s)) for s in range(9)])
               for rho in (0.0, 0.5, 0.9)]
    assert lengths[0] < lengths[1] < lengths[2]


def test_equal_models_are_called_different_at_the_stated_rate() -> None:
    """Correlated errors: a bootstrap of single samples would call every third a difference."""
    rejected = 0
    for seed in range(200):
        a, b = ar1(0.6, 1500, seed) ** 2, ar1(0.6, 1500, 10_000 + seed) ** 2
        rejected += pairs({"a": [a], "b": [b]}, seed, draws=400)[0].p_value < 0.05
    low, high = binomtest(rejected, 200).proportion_ci(0.99, "wilson")
    assert low < 0.05 < high


def test_a_real_difference_is_seen_and_p_values_count_the_pairs() -> None:
    errors = {name: [scale * ar1(0.6, 1500, 50 + k) ** 2] for k, (name, scale) in enumerate(
        {"good": 1.0, "bad": 2.0, "alike": 1.9}.items())}
    found = {(p.better, p.worse): p for p in pairs(errors)}
    assert found["good", "bad"].p_value < 0.01
    assert found["good", "bad"].interval[0] > 0
    (chance,) = (p for (better, _), p in found.items() if better != "good")
    assert chance.p_value > 0.05 and chance.interval[0] < 0 < chance.interval[1]
    single = pairs({name: errors[name] for name in ("good", "bad")})[0]
    assert found["good", "bad"].p_value == pytest.approx(3 * single.p_value, rel=0.5, abs=2e-3)
    assert pairs(errors, seed=3) == pairs(errors, seed=3)
