"""Standard errors of pictures: few degrees of freedom, coloured errors, errors seen by none."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import binom

from pikanid.tracking.deviation import deviations, restlessness, squeezed
from pikanid.tracking.settings import USUAL

N, FREE = 2000, USUAL.independent


def drawn(spread: np.ndarray, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    chi = [spread**2 * rng.chisquare(FREE, N) / FREE for _ in range(2)]
    return spread * rng.standard_normal(N), *chi


@pytest.mark.parametrize("spread", [np.full(N, 0.01), 0.01 * np.exp(
    np.random.default_rng(5).normal(0, 0.5, N))], ids=["alike", "unlike"])
def test_bands_hold_what_they_say(spread: np.ndarray) -> None:
    theta, variance, finer = drawn(spread, 0)
    sigma = deviations(theta, variance, finer, np.ones(N), USUAL)
    inside = int(np.sum(np.abs(theta) < 1.96 * sigma))
    assert binom.ppf(0.001, N, 0.94) < inside < binom.ppf(0.999, N, 0.965)


def test_pictures_that_differ_keep_their_own_variance() -> None:
    _, alike, _ = drawn(np.ones(N), 1)
    _, unlike, _ = drawn(np.exp(np.random.default_rng(2).normal(0, 1, N)), 1)
    assert squeezed(alike, FREE)[1] > 100 > 10 > squeezed(unlike, FREE)[1]


def test_an_error_that_no_picture_sees_is_seen_between_them() -> None:
    theta, variance, finer = drawn(np.full(N, 0.001), 3)
    swing = 0.3 * np.sin(np.arange(N) * 2 * np.pi * 3 / 50)  # 3 Hz at 50 pictures a second
    assert restlessness(swing + theta, np.full(N, 0.001)) < 1.1
    sigma = deviations(swing + 3 * theta, variance, finer, np.ones(N), USUAL)
    assert np.median(sigma) == pytest.approx(0.003, rel=0.1)


def test_gaps_stay_gaps() -> None:
    theta, variance, finer = drawn(np.full(N, 0.01), 4)
    theta[7] = variance[7] = np.nan
    sigma = deviations(theta, variance, finer, np.ones(N), USUAL)
    assert np.flatnonzero(np.isnan(sigma)).tolist() == [7]
    assert np.isnan(deviations(np.full(3, np.nan), *[np.full(3, np.nan)] * 3, USUAL)).all()
