"""Noise models: what they find in quiet stretches, what they claim, and how they whiten."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import binom

from pikanid.errors import BadRecording
from pikanid.noise import autoregressive as noise_ar
from pikanid.noise import level as noise
from pikanid.noise.quiet import _is_quiet, even_parts, find_quiet, without_moves
from pikanid.noise.settings import USUAL, QuietSettings, RoundingSettings
from pikanid.recording.channel import Channel

DT = 0.01
SIGMA = 0.002


def coloured(n: int, rho: float, seed: int) -> np.ndarray:
    """AR(1) noise of unit variance."""
    e = np.random.default_rng(seed).standard_normal(n + 500)
    return lfilter([np.sqrt(1 - rho**2)], [1, -rho], e)[500:]


def swing(rho: float, seed: int, rest: float = 4.0) -> Channel:
    """A decaying swing of 14 rad/s that starts after `rest` seconds of stillness."""
    t = np.arange(int((rest + 6) / DT)) * DT
    moving = np.where(t > rest, 0.2 * np.exp(-0.3 * (t - rest)) * np.sin(14 * (t - rest)), 0.0)
    return Channel("theta", t, moving + SIGMA * coloured(len(t), rho, seed), "rad")


@pytest.mark.parametrize("rho", [0.0, 0.5, 0.8])
def test_a_quiet_stretch_is_found_and_used(rho: float) -> None:
    models = [noise.estimate(swing(rho, seed)) for seed in range(30)]
    assert all("quiet stretch" in model.source for model in models)
    stretches = [model.stretch or (0.0, 0.0) for model in models]
    assert all(stop < 4.2 and stop - start > 2.0 for start, stop in stretches)
    # σ has half the relative error of the power
    scores = np.array([2 * (1 - SIGMA / model.sigma) / model.spread for model in models])
    assert np.mean(np.abs(scores) < 2) > 0.85
    assert abs(scores.mean()) < 1.0
    assert np.mean([model.rho for model in models]) == pytest.approx(rho, abs=0.06)


def test_a_short_stretch_says_how_little_it_knows() -> None:
    """20 samples leave a correlation of about ±0.2 and a variance of about ±34 %."""
    model = noise.estimate(swing(0.5, 0), quiet=(0.0, 0.2))
    assert model.spread == pytest.approx(0.34, rel=0.5)
    assert model.rho == 0.0 and model.stretch is None  # no colour is claimed


@pytest.mark.parametrize("seed", range(5))
def test_a_busy_signal_has_no_quiet_stretch(seed: int) -> None:
    t = np.arange(2000) * DT
    tones = sum(np.sin(2 * np.pi * f * t + f) for f in (0.5, 1.3, 2.1, 3.7))
    busy = Channel("y", t, tones + SIGMA * coloured(2000, 0.0, seed))
    assert find_quiet(busy) is None
    model = noise.estimate(busy)
    assert model.rho == 0.0
    assert model.sigma == pytest.approx(SIGMA, rel=0.12)
    assert "white, from the highest frequencies (0 s to 19.99 s)" in model.sentence("y")
    other = replace(model, rho=0.5).sentence("y")
    assert "correlation 0.50" in other and "white" not in other


@pytest.mark.parametrize("n", [31, 51, 101])
def test_an_oscillation_is_not_taken_for_noise(n: int) -> None:
    """A sparse record of a swing looks like coloured noise to a careless fit."""
    t = np.arange(n) * 0.1
    y = Channel("y", t, 0.1 * np.exp(-0.25 * t) * np.sin(14.8 * t))
    assert find_quiet(y) is None


@pytest.mark.parametrize(("shape", "rho"), [
    *product([lambda t: np.exp(-t / 2), lambda t: np.exp(-0.3 * t) - np.exp(-4 * t),
              lambda t: np.exp(-np.abs(t - 3)) / (1 + np.exp(-np.abs(t - 3))) ** 2],
             [0.0, 0.6]),
    # among coloured noise a swing that dies out is not always told from it
    (lambda t: np.exp(-t / 3) * np.cos(6 * t), 0.0)],
    ids=[f"{name}-{rho}" for name in ("decay", "dose", "epidemic") for rho in (0.0, 0.6)]
        + ["swing-0.0"])
def test_what_is_left_of_a_transient_does_not_count_as_noise(
        shape: Callable[[np.ndarray], np.ndarray], rho: float) -> None:
    """Neither at its end nor in its arcs; nor is the calmest of many stretches taken."""
    t = np.arange(1000) * DT
    ratios = [noise.estimate(Channel("y", t, shape(t) + 0.02 * coloured(1000, rho, seed))).sigma
              / 0.02 for seed in range(40)]
    assert np.median(ratios) == pytest.approx(1.0, abs=0.15)  # 1.2 to 2.3 with a mean for a trend
    assert np.mean(np.array(ratios) > 1.3) <= 0.1


def test_a_stuck_sensor_is_not_quiet() -> None:
    t = np.arange(600) * DT
    y = np.where(t < 3, 0.5, np.sin(9 * t))
    assert find_quiet(Channel("y", t, y)) is None
    with pytest.raises(BadRecording, match="shows no noise"):
        noise.estimate(Channel("y", t, y), quiet=(0.0, 2.0))


def test_rounding_counts_as_noise() -> None:
    step = 0.01
    t = np.arange(3000) * DT
    y = Channel("y", t, np.round(0.3 * np.sin(1.3 * t) / step) * step)
    sigma, _ = noise.high_band_sigma(y)
    assert sigma >= step / np.sqrt(12) * 0.999
    slow = Channel("y", t, np.round(0.1 * np.sin(0.4 * t) / step) * step)
    careful = RoundingSettings(changes=10**6)
    assert noise.estimate(slow).sigma == pytest.approx(step / np.sqrt(12))
    assert noise.estimate(slow, rounding=careful).sigma < noise.estimate(slow).sigma
    with pytest.raises(BadRecording, match="no noise"):
        noise.high_band_sigma(slow, careful)


def test_outliers_and_gaps_do_not_disturb_the_highest_frequencies() -> None:
    t = np.arange(4000) * DT
    y = np.sin(2 * t) + SIGMA * coloured(4000, 0.0, 1)
    y[::101] += 1.0
    y[50:60] = np.nan
    assert noise.high_band_sigma(Channel("y", t, y))[0] == pytest.approx(SIGMA, rel=0.15)


@pytest.mark.parametrize("seed", range(4))
def test_noise_of_samples_at_any_times(seed: int) -> None:
    """Drawn at random, and lost at random: nowhere are five intervals alike."""
    rng = np.random.default_rng(seed)
    for t in (np.sort(rng.uniform(0.0, 20.0, 400)),
              np.flatnonzero(rng.random(700) < 0.5)[:300] * 0.05):
        y = Channel("y", t, np.sin(1.5 * t) + 0.02 * rng.standard_normal(len(t)))
        sigma, error = noise.high_band_sigma(y)
        assert sigma == pytest.approx(0.02, abs=3.0 * error + 0.001)
        assert noise.estimate(y).rho == 0.0


def test_claimed_errors_of_the_highest_frequencies() -> None:
    t = np.arange(800) * DT
    results = [
        noise.high_band_sigma(Channel("y", t, np.sin(3 * t) + coloured(800, 0.0, seed)))
        for seed in range(100)
    ]
    sigma, claimed = np.array(results).T
    assert np.std(sigma) == pytest.approx(claimed.mean(), rel=0.3)
    assert sigma.mean() == pytest.approx(1.0, abs=0.03)


def test_too_short_to_say() -> None:
    with pytest.raises(BadRecording, match="only"):
        noise.estimate(Channel("y", np.arange(5.0), np.arange(5.0) ** 2))
    with pytest.raises(BadRecording, match="only"):
        noise.estimate(swing(0, 0), quiet=(100.0, 101.0))


def test_whitened_coloured_noise_is_white() -> None:
    """Why any of this is needed: raw AR(1) residuals fail every whiteness test."""
    channel = swing(0.6, 7)
    model = noise.estimate(channel)
    fresh = SIGMA * coloured(2000, 0.6, 99)
    white = model.whiten(fresh, DT * np.arange(2000))
    lag_one = float(np.corrcoef(white[1:], white[:-1])[0, 1])
    assert abs(lag_one) < 0.15 < 0.5 < float(np.corrcoef(fresh[1:], fresh[:-1])[0, 1])
    assert np.std(white) == pytest.approx(1.0, rel=0.15)


def test_burg_recovers_a_second_order_process() -> None:
    e = np.random.default_rng(0).standard_normal(20_000)
    x = lfilter([1.0], [1.0, -1.2, 0.5], e)
    model = noise_ar.fit(x - x.mean())
    error = model.coefficients[:2] - [1.2, -0.5]
    assert len(model.coefficients) >= 2
    # both have the standard error √((1 - 0.5²)/n) (P. J. Brockwell and R. A. Davis, §8.8)
    assert np.all(np.abs(error) < 4 * np.sqrt(0.75 / 20_000))


def test_highest_frequencies_by_hand() -> None:
    """Median of fourth differences, and an error bar that counts what neighbours share."""
    t = np.delete(np.arange(400) * DT, [100, 101, 250])
    y = np.sin(3 * t) + 0.1 * coloured(397, 0.0, 5)
    parts = [y[:100], y[100:248], y[248:]]
    d = np.concatenate([np.diff(part, 4) for part in parts])
    expected = np.median(np.abs(d)) / 0.6745 / np.sqrt(70)
    # Σ ρ_k² of fourth differences: 70² + 2·(56² + 28² + 8² + 1²) over 70²
    shared = (70**2 + 2 * (56**2 + 28**2 + 8**2 + 1)) / 70**2
    error = expected * np.sqrt(shared / 0.37 / (2 * len(d)))
    assert noise.high_band_sigma(Channel("y", t, y)) == pytest.approx((expected, error), rel=1e-3)
    with pytest.raises(BadRecording, match="only"):
        noise.high_band_sigma(Channel("y", t[:11], y[:11]))
    assert noise.high_band_sigma(Channel("y", t[:12], y[:12]))[0] > 0


def test_a_quiet_stretch_by_hand() -> None:
    channel = swing(0.5, 3)
    inside = channel.values[100:301]
    fitted = noise_ar.fit(inside - inside.mean())
    model = noise.estimate(channel, (channel.time[100], channel.time[300]))
    assert model.stretch == (channel.time[100], channel.time[300])
    assert model.source == "the quiet stretch (1 s to 3 s)"
    assert model.interval == pytest.approx(DT)
    assert (model.sigma, model.rho, model.spread) == pytest.approx((
        fitted.sigma, noise_ar.autocorrelation(fitted.coefficients, 2)[1],
        2 * fitted.sigma_std / fitted.sigma))
    # a process of second order has another correlation than the first-order one next to it
    e = np.random.default_rng(4).standard_normal(500)
    values = lfilter([1.0], [1.0, -1.2, 0.6], e)
    for order in (1, 4):
        fitted = noise_ar.fit(values - values.mean(), order)
        model = noise.estimate(Channel("y", np.arange(500) * DT, values), (0.0, 5.0),
                               settings=QuietSettings(order=order))
        assert model.rho == noise_ar.autocorrelation(fitted.coefficients, 2)[1]
        assert len(fitted.coefficients) == min(order, 2)
    again = noise.estimate(Channel("y", channel.time, 5.0 + channel.values), (1.0, 3.0))
    assert again.sigma == pytest.approx(noise.estimate(channel, (1.0, 3.0)).sigma)


def test_a_coarse_sensor_at_rest_has_the_noise_of_its_steps() -> None:
    """One sample in fifteen is a step off: far less spread than step/√12, which it must hide."""
    step, rng = 0.01, np.random.default_rng(0)
    t = np.arange(400) * DT
    y = step * np.where(rng.uniform(size=400) < 1 / 15, 1.0, 0.0)
    channel = Channel("y", t, np.where(t > 3, y + step * np.round(20 * np.sin(t)), y))
    model = noise.estimate(channel, (0.0, 2.5))
    inside = channel.values[:251]
    fitted = noise_ar.fit(inside - inside.mean())
    assert step / np.sqrt(12) > 1.1 * fitted.sigma
    assert (model.sigma, model.spread) == pytest.approx(
        (step / np.sqrt(12), 2 * fitted.sigma_std / fitted.sigma))
    steps = Channel("y", t, step * np.round(np.arange(400) / 50))
    assert noise.high_band_sigma(steps)[0] == pytest.approx(step / np.sqrt(12))


@pytest.mark.parametrize("longest", ["first", "last"])
def test_of_the_quiet_stretches_on_both_sides_of_a_gap_the_longest_counts(longest: str) -> None:
    rest, rng = (0.0, 3.0), np.random.default_rng(6)
    t = np.concatenate([np.arange(300), np.arange(400, 500)]) * DT
    y = Channel("y", t, SIGMA * rng.standard_normal(400))
    if longest == "last":
        y, rest = Channel("y", t[-1] - t[::-1], y.values[::-1]), (2.0, 5.0)
    assert find_quiet(y) == pytest.approx((rest[0], rest[1] - DT), abs=0.011)


def test_a_quiet_stretch_ends_where_an_input_moves_beyond_its_own_noise() -> None:
    """Noise of an input is no move of it, however far it lies from a hundredth of its range."""
    t = np.arange(1000) * DT
    y, noise = Channel("y", t, t), np.random.default_rng(0).standard_normal(1000)
    moving = np.where(t < 2.0, 0.0, np.sin(9 * (t - 2.0)))
    for u in (moving, moving + 0.03 * noise):
        found = without_moves(y, [Channel("u", t, u)], 0.5, 2.6)
        assert found == pytest.approx((0.5, 2.0), abs=0.03)
    assert without_moves(y, [Channel("u", t, np.sin(9 * t))], 0.5, 2.6) is None
    calm = without_moves(y, [Channel("u", t, moving + 0.03 * noise)], 0.0, 1.98)
    assert calm == pytest.approx((0.0, 1.98), abs=0.03)


def test_stretches_end_at_gaps() -> None:
    t = np.arange(60) * DT
    t[20:] += 0.5
    y = np.arange(60.0) ** 2
    y[[40, 41]] = np.nan
    parts = list(even_parts(Channel("y", t, y)))
    assert [len(a) for a, _ in parts] == [20, 20, 18]
    for (times, values), part in zip(parts, (slice(20), slice(20, 40), slice(42, 60)), strict=True):
        np.testing.assert_array_equal(times, t[part])
        np.testing.assert_array_equal(values, y[part])
    assert not list(even_parts(Channel("y", t[:3], [np.nan, 1.0, np.nan])))


@pytest.mark.parametrize("rho", [0.0, 0.5])
def test_noise_alone_is_quiet_as_often_as_stated(rho: float) -> None:
    """Of 100 stretches of 300 samples few are refused: two tests at 1 %, one at 1 %."""
    shape = np.concatenate([np.zeros(300), 100 * np.sin(np.arange(40))])
    quiet = 0
    for seed in range(100):
        y = Channel("y", np.arange(340) * DT, coloured(340, rho, seed) + shape)
        quiet += _is_quiet(y.values[:300], float(np.var(y.values)), USUAL)
    assert quiet >= binom.ppf(0.001, 100, 0.95)


@pytest.mark.parametrize("extra", [
    lambda t: 0.8 * np.sin(20.944 * t),  # ten periods: a line that no eye would see
    lambda t: np.where(t > 1.5, 1.0, 0.0) * np.random.default_rng(1).normal(size=300),
    lambda t: np.where(t < 1.5, 1.0, 0.0) * np.random.default_rng(1).normal(size=300),
    lambda t: 3.0 * np.sin(6.0 * t),  # a motion of the noise's size: not quite three periods
], ids=["line", "louder", "quieter", "motion"])
def test_noise_with_something_in_it_is_not_quiet(extra: Callable[[np.ndarray], np.ndarray]) -> None:
    t = np.arange(300) * DT
    for seed in range(5):
        assert not _is_quiet(coloured(300, 0.0, seed) + extra(t), 1e4, USUAL)


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
def test_the_step_of_a_rounded_signal_in_any_unit(scale: float) -> None:
    """Nothing but rounding: a uniform error of one step."""
    t = np.linspace(0.0, 3.0, 300)
    rounded = scale * np.round(10.0 * t) / 10.0
    sigma, _ = noise.high_band_sigma(Channel("y", t, rounded))
    assert sigma == pytest.approx(0.1 * scale / np.sqrt(12.0))


def test_a_channel_that_never_changes_is_named() -> None:
    with pytest.raises(BadRecording, match="gauge"):
        noise.high_band_sigma(Channel("gauge", np.linspace(0.0, 3.0, 300), np.full(300, 2.0)))


def test_coloured_noise_counts_as_quiet_only_beside_something_louder() -> None:
    """What is as loud as all the rest may be a motion."""
    for seed in range(5):
        y = coloured(300, 0.6, seed)
        assert not _is_quiet(y, 2.0 * float(np.var(y)), USUAL)
    quiet = sum(_is_quiet(y, 8.0 * float(np.var(y)), USUAL)
                for y in (coloured(300, 0.6, seed) for seed in range(20)))
    assert quiet >= 16


def test_settings_say_what_is_quiet() -> None:
    """A stretch of 60 samples at rest, in a swing: for who asks for 100 there is none."""
    rng, t = np.random.default_rng(5), np.arange(300) * DT
    y = Channel("y", t, 0.002 * rng.standard_normal(300)
                + np.where(t < t[60], 0.0, np.sin(40 * (t - t[60]))))
    usual = find_quiet(y)
    assert usual is not None and usual[1] < t[75]
    assert find_quiet(y, QuietSettings(shortest=100)) is None
    known = noise.estimate(y, (0.0, float(t[59])), settings=QuietSettings(low=50))
    assert known.stretch is not None and noise.estimate(y, (0.0, float(t[59]))).stretch is None
