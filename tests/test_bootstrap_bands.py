"""Standard errors and bands by refitting resampled recordings."""

from __future__ import annotations

import numpy as np
import pytest

import pikanid as pk
from pikanid.model import systems


@pytest.fixture(scope="module")
def fitted() -> tuple[pk.Estimate, pk.Recording]:
    run = pk.simulate(systems.sloshing(), pk.excitation.two_pulse(), sigma=2e-3, seed=3)
    return pk.NLS().fit(systems.sloshing(), run), run


def test_white_noise_gives_what_the_sensitivities_give(
        fitted: tuple[pk.Estimate, pk.Recording]) -> None:
    """120 resamples: a standard error is off by 6.5 % (one standard deviation); 4 of them."""
    fit, run = fitted
    again = pk.bootstrap(fit, run, resamples=120, seed=1)
    for name in ("l_theta", "d_theta"):
        assert again.std(name) / fit.std(name) == pytest.approx(1.0, abs=0.26)
        assert again[name] == fit[name]
    first, second = fit.fits[0].spread, again.fits[0].spread
    assert first is not None and second is not None
    seen = first > 0.1 * first.max()
    assert np.median(second[seen] / first[seen]) == pytest.approx(1.0, abs=0.26)


def test_the_same_seed_gives_the_same(fitted: tuple[pk.Estimate, pk.Recording]) -> None:
    fit, run = fitted
    one, two, other = (pk.bootstrap(fit, run, resamples=3, seed=s) for s in (0, 0, 1))
    np.testing.assert_array_equal(one.covariance, two.covariance)
    assert np.any(one.covariance != other.covariance)


def test_misuse(fitted: tuple[pk.Estimate, pk.Recording]) -> None:
    fit, run = fitted
    with pytest.raises(pk.errors.BadSetting):
        pk.bootstrap(fit, run, resamples=1)
    with pytest.raises(pk.errors.BadRecording):
        pk.bootstrap(fit, [run, run])
