"""An acceleration is as smooth as its positions' standard errors say, and as sure as it states."""

from __future__ import annotations

import numpy as np
import pytest

from pikanid import errors
from pikanid.recording.acceleration import acceleration
from pikanid.recording.channel import Channel
from pikanid.recording.kinematics import derivative

T = np.arange(301) / 100
X = 0.01 * np.sin(9 * T) + 0.003 * np.sin(25 * T + 1)
A = -0.81 * np.sin(9 * T) - 0.003 * 625 * np.sin(25 * T + 1)


def noisy(sigma: float, seed: int = 0) -> Channel:
    noise = sigma * np.random.default_rng(seed).standard_normal(len(T))
    return Channel("x", T, X + noise, "m", sigma=sigma)


@pytest.mark.parametrize("sigma", [1e-7, 5e-6, 2e-5])
def test_standard_errors_hold(sigma: float) -> None:
    found = [acceleration(noisy(sigma, seed), "u_x").channel for seed in range(12)]
    off = np.array([f.values - A for f in found])
    own = np.array([f.sigma for f in found])
    # a motion smoother than the prior's is known better than stated, never worse
    assert np.mean(np.abs(off[:, 3:-3]) < 1.96 * own[:, 3:-3]) > 0.93
    assert np.sqrt(np.mean(off**2)) > 0.3 * np.sqrt(np.mean(own**2))


def test_it_is_better_than_cross_validation_at_the_ends_and_between() -> None:
    x = noisy(5e-6)
    known, blind = acceleration(x, "u_x").channel.values - A, derivative(x).values - A
    assert np.sqrt(np.mean(known**2)) < 0.6 * np.sqrt(np.mean(blind**2))
    assert np.max(np.abs(known[[0, -1]])) < 0.3 < np.max(np.abs(blind[[0, -1]]))


def test_what_rests_has_no_acceleration() -> None:
    rest = Channel("x", T, 1e-5 * np.random.default_rng(0).standard_normal(301), "m", sigma=1e-5)
    found = acceleration(rest, "u_x")
    assert np.max(np.abs(found.channel.values)) < 1e-3 and found.band < 1.0


def test_gaps_are_less_sure_and_ends_without_position_left_out() -> None:
    values = X.copy()
    values[:5], values[100:112] = np.nan, np.nan
    found = acceleration(Channel("x", T, values, "m", sigma=5e-6), "u_x").channel
    assert found.time[0] == T[5] and len(found) == 296 and found.hold == "cubic"
    own = np.asarray(found.sigma)
    assert own[100] > 3 * np.median(own)
    assert np.max(np.abs(found.values - A[5:]) / own) < 4


def test_draws_scatter_as_the_errors_do() -> None:
    found, rng = acceleration(noisy(5e-6), "u_x"), np.random.default_rng(1)
    drawn = np.array([found.draw(rng).values for _ in range(300)])
    np.testing.assert_allclose(np.std(drawn, axis=0), found.channel.sigma, rtol=0.25)
    np.testing.assert_allclose(np.mean(drawn, axis=0), found.channel.values,
                               atol=5 * np.max(found.channel.sigma) / np.sqrt(300))


def test_units_do_not_matter() -> None:
    one = acceleration(noisy(5e-6), "u_x").channel
    mm = acceleration(Channel("x", T, 1e3 * noisy(5e-6).values, "mm", sigma=5e-3), "u_x").channel
    assert mm.unit == "mm/s^2"
    np.testing.assert_allclose(mm.values, 1e3 * one.values, rtol=1e-6, atol=1e-6)


def test_what_cannot_be_smoothed_is_refused() -> None:
    with pytest.raises(errors.BadSetting, match="no sigma"):
        acceleration(Channel("x", T, X, "m"), "u_x")
    with pytest.raises(errors.BadRecording, match="at least"):
        acceleration(Channel("x", T[:9], X[:9], "m", sigma=1e-6), "u_x")
