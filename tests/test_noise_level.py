"""Which part of a quiet stretch counts, and how well the noise is known then."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from pikanid.mismatch.data.noise_level import GRID, _shape, _whittle, first_level, refined
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.noise.level import NoiseModel, estimate
from pikanid.noise.quiet import without_moves
from pikanid.recording import Recording
from pikanid.recording.channel import Channel

T = np.arange(1000) * 0.01
WHITE = NoiseModel(1.0, 0.0, 0.0, 0.01, "")
MOVING = np.where(T < 2.0, 0.0, np.sin(9 * (T - 2.0)))


def still(u: np.ndarray, start: float, stop: float) -> tuple[float, float] | None:
    return without_moves(Channel("y", T, T), [Channel("u", T, u)], start, stop)


def test_a_stretch_ends_where_the_input_begins_to_move() -> None:
    assert still(MOVING, 0.5, 2.6) == pytest.approx((0.5, 2.0), abs=0.02)
    assert still(MOVING[::-1], 7.5, 9.5) == pytest.approx((7.99, 9.5), abs=0.02)
    # a stretch in which it rests stays as it is, also beside a larger move
    assert still(MOVING, 0.0, 1.98) == pytest.approx((0.0, 1.98))


def test_a_noisy_input_at_rest_does_not_move() -> None:
    noise = 0.03 * np.random.default_rng(0).standard_normal(len(T))
    found = still(MOVING + noise, 0.0, 1.98)
    assert found is not None and found[1] - found[0] > 1.9


def test_where_nothing_rests_no_stretch_is_quiet() -> None:
    assert still(np.sin(9 * T), 0.5, 2.6) is None


def test_what_is_driven_all_along_has_no_colour() -> None:
    """A cell under a random load: its charge wanders as coloured noise does."""
    rng = np.random.default_rng(0)
    load = np.repeat(rng.normal(0.0, 3.0, 50), 20)
    y = 0.002 * np.cumsum(load) - 0.03 * load + 0.0008 * rng.standard_normal(1000)
    assert estimate(Channel("u", T, y)).rho > 0.9
    found = estimate(Channel("u", T, y), drives=[Channel("i", T, load)])
    assert found.rho == 0 and found.stretch is None
    assert found.sigma == pytest.approx(0.0008, rel=0.3)


def test_a_random_motion_does_not_count_as_coloured_noise() -> None:
    rng = np.random.default_rng(3)
    drive = np.where(T < 2.0, 0.0, np.convolve(rng.standard_normal(len(T)), np.ones(20) / 20,
                                               "same"))
    # small for a while, as where a resonance builds up
    motion = drive * np.clip((T - 2.0) / 8.0, 0.0, 1.0) * 0.05
    y = motion + 0.001 * rng.standard_normal(len(T))
    recording = Recording.from_arrays(T, {"u": drive, "y": y}, {"u": "m/s^2", "y": "rad"})
    blind, seeing = (first_level(recording, "y", None, DEFAULTS, inputs)
                     for inputs in ([], ["u"]))
    assert blind.stretch is not None and blind.stretch[1] > 2.5 and blind.rho > 0
    assert seeing.rho == 0 and seeing.sigma == pytest.approx(0.001, rel=0.15)


def coloured(rho: float, seed: int) -> np.ndarray:
    """(2001,) of an AR(1) process of unit variance."""
    e = np.random.default_rng(seed).standard_normal(2101) * np.sqrt(1 - rho**2)
    return np.asarray(lfilter([1.0], [1.0, -rho], e)[100:])


@pytest.mark.parametrize("rho", [0.3, 0.52, 0.7])
def test_the_error_of_the_power_at_low_frequencies_is_stated(rho: float) -> None:
    """From two quiet seconds and the high frequencies of 120 residuals of pure noise."""
    t, powers, stated, refuted = np.arange(2001) * 0.01, [], [], []
    low = np.linspace(0.0, 0.25 * np.pi, 50)
    for seed in range(120):
        y = coloured(rho, seed)
        level = refined(replace(WHITE, stretch=(0.0, 2.16)), Channel("y", t, y), t, y, 8.0,
                        None, DEFAULTS)
        gain = 1 - 2 * level.rho * np.cos(low) + level.rho**2
        powers.append(np.mean(np.log(level.sigma**2 * (1 - level.rho**2) / gain)))
        stated.append(level.spread)
        refuted.append("all frequencies" in level.source)
    error = np.std(powers)  # of 120 it is known to 7 %
    assert np.median(stated) == pytest.approx(error, rel=0.2)
    true = np.mean(np.log((1 - rho**2) / (1 - 2 * rho * np.cos(low) + rho**2)))
    assert np.mean(powers) == pytest.approx(true, abs=0.4 * error)
    # where the whole residual refutes a power by chance, it is known better than otherwise
    assert np.mean(refuted) < 0.1
    assert np.quantile(np.array(stated)[~np.array(refuted)], 0.05) > 0.75 * error
    scores = (np.array(powers) - true) / stated
    assert np.std(scores) == pytest.approx(1.0, abs=0.2)
    assert all(np.abs(scores[refuted]) < 3)


def rung(amplitude: float) -> tuple[np.ndarray, np.ndarray]:
    """Times, and a motion (2001,) that dies out during four seconds."""
    t = np.arange(2001) * 0.01
    return t, amplitude * np.exp(-t) * np.cos(8.0 * t)


def test_a_stretch_in_which_a_motion_dies_out_is_no_quiet_one() -> None:
    t, motion = rung(300.0)
    noise = coloured(0.0, 5)
    before = replace(WHITE, stretch=(3.0, 6.0))
    level = refined(before, Channel("y", t, motion + noise), t, noise, 8.0, None, DEFAULTS)
    assert (level.sigma, level.rho) == (pytest.approx(1.0, abs=0.06), 0.0)
    assert level.source == "the residual at all frequencies"
    # not even before the motion is explained: it is a line among the frequencies
    left = refined(before, Channel("y", t, motion + noise), t, motion + noise, 8.0, None, DEFAULTS)
    assert (left.sigma, left.rho) == (pytest.approx(1.0, abs=0.15), 0.0)


def test_the_shape_of_high_frequencies_does_not_mislead() -> None:
    """Half a thousand samples of coloured noise, as an impact's edges may bend their spectrum."""
    t = np.arange(501) * 0.01
    noise = coloured(0.6, 7)[:501]
    steep = np.fft.irfft(np.fft.rfft(noise) * np.interp(
        np.linspace(0, 1, 251), [0, 0.2, 1], [1.0, 1.0, 0.25]), 501)
    level = refined(WHITE, Channel("y", t, steep), t, steep, 20.0, None, DEFAULTS)
    power = level.sigma**2 * (1 + level.rho) / (1 - level.rho)
    assert power < 2 * 1.6 / 0.4


@pytest.mark.parametrize("rho", [0.4, 0.65])
def test_an_explanation_tells_the_noise_better_than_high_frequencies_alone(rho: float) -> None:
    t, low, errors = np.arange(2001) * 0.01, np.linspace(0.0, 0.25 * np.pi, 50), []
    true = np.mean(np.log((1 - rho**2) / (1 - 2 * rho * np.cos(low) + rho**2)))
    for seed in range(60):
        y = coloured(rho, 1000 + seed)
        levels = [refined(replace(WHITE, stretch=(0.0, 2.16)), Channel("y", t, y), t, y,
                          8.0, None, DEFAULTS, explained) for explained in (False, True)]
        errors.append([np.mean(np.log(level.sigma**2 * (1 - level.rho**2) / (
            1 - 2 * level.rho * np.cos(low) + level.rho**2))) - true for level in levels])
    before, after = np.std(errors, axis=0)  # of 60 they are known to 9 %
    assert after < 0.85 * before
    assert abs(np.mean(errors, axis=0)[1]) < 0.3 * after


@pytest.mark.parametrize("rho", [0.0, 0.4, 0.65])
def test_a_short_recording_without_a_quiet_stretch_states_its_doubt(rho: float) -> None:
    """High frequencies of five seconds: also where the noise seems white, and is not."""
    t, low, scores = np.arange(501) * 0.01, np.linspace(0.0, 0.25 * np.pi, 50), []
    true = (1 - rho**2) * np.mean(1 / (1 - 2 * rho * np.cos(low) + rho**2))
    for seed in range(150):
        y = coloured(rho, 3000 + seed)[:501]
        level = refined(WHITE, Channel("y", t, y), t, y, 14.4, None, DEFAULTS)
        power = level.sigma**2 * (1 - level.rho**2) * np.mean(
            1 / (1 - 2 * level.rho * np.cos(low) + level.rho**2))
        scores.append(np.log(power / true) / level.spread)
    # 23 in 1000 are expected of a normal error; of 150, five in all but one case in a hundred
    assert np.mean(np.array(scores) < -2.0) < 0.1
    assert np.sqrt(np.mean(np.square(scores))) < 1.3


def test_what_explains_all_tells_a_colour_that_high_frequencies_hide() -> None:
    """Noise that seems white above a quarter of the band."""
    t = np.arange(501) * 0.01
    found = []
    for seed in range(60):
        y = coloured(0.65, 5000 + seed)[:501]
        before, after = (refined(WHITE, Channel("y", t, y), t, y, 14.4,
                                 None, DEFAULTS, explained) for explained in (False, True))
        found.append((before.rho, after.rho))
    rho = np.array(found)
    assert np.min(rho[:, 0]) < 0.35  # it does mislead
    assert np.all(np.abs(rho[:, 1] - 0.65) < 0.15)


def test_a_colour_is_read_though_times_vary() -> None:
    """By a fifth of an interval; where the residual is far smoother than its noise, it is not."""
    rng = np.random.default_rng(5)
    t = 0.01 * (np.arange(1000) + rng.uniform(-0.21, 0.21, 1000))
    for seed in range(5):
        y = coloured(0.8, 7000 + seed)[:1000]
        level = refined(WHITE, Channel("y", t, y), t, y, 14.4, None, DEFAULTS, True)
        assert level.rho == pytest.approx(0.8, abs=0.1)
        assert level.sigma == pytest.approx(np.std(y), rel=0.15)
    moving = coloured(0.0, 3)[:1000] + 40 * np.sin(12 * t)
    level = refined(WHITE, Channel("y", t, moving), t, moving, 14.4, None, DEFAULTS)
    assert (level.sigma, level.rho) == (pytest.approx(1.0, abs=0.1), 0.0)


def test_no_explanation_makes_sure_noise_louder() -> None:
    """White noise, and a slow misfit of the same power that is said to be none."""
    t = np.arange(2001) * 0.01
    y = coloured(0.0, 11) + np.sin(2 * t) + np.sin(3.1 * t) + np.sin(4.3 * t)
    level = refined(WHITE, Channel("y", t, y), t, y, 8.0, None, DEFAULTS, True)
    assert (level.sigma, level.rho) == (pytest.approx(1.0, abs=0.05), 0.0)


@pytest.mark.parametrize("rho", [0.0, 0.5, -0.4, 0.95])
def test_whitening_is_the_inverse_covariance_over_gaps_too(rho: float) -> None:
    """wᵀw = rᵀΣ⁻¹r with Σ_jk = σ²·ρ^|j - k|, j and k the samples' numbers on the grid."""
    at = np.delete(np.arange(40), [3, 11, 12, 13, 30])
    sigma, r = 0.3, np.random.default_rng(0).normal(size=(35, 3))
    level = NoiseModel(sigma, rho, 0.1, 0.01, "")
    covariance = sigma**2 * np.sign(rho) ** np.abs(np.subtract.outer(at, at)) * np.abs(rho) ** (
        np.abs(np.subtract.outer(at, at)))
    white = level.whiten(r, 5.0 + 0.01 * at)
    np.testing.assert_allclose(white.T @ white, r.T @ np.linalg.solve(covariance, r), rtol=1e-9)
    np.testing.assert_allclose(level.whiten(r[:, 1], 5.0 + 0.01 * at), white[:, 1])


@pytest.mark.parametrize("rho", [0.0, 0.7])
def test_a_sigma_that_is_given_stays_and_its_colour_is_read(rho: float) -> None:
    t = np.arange(2001) * 0.01
    level = NoiseModel(1.0, 0.0, 0.0, 0.01, "given")
    found = refined(level, Channel("y", t, t), t, coloured(rho, 1), 5.0, None, DEFAULTS)
    assert (found.sigma, found.source) == (1.0, "given")
    assert found.rho == pytest.approx(rho, abs=0.15)
    for given in (0.9, 1.0, 1.1):
        assert _whittle(spectra_of(rho), given, DEFAULTS.noise)[0] == pytest.approx(given)
    free, alone, _ = _whittle(spectra_of(rho), None, DEFAULTS.noise)
    assert free == pytest.approx(1.0, rel=0.1) and alone == pytest.approx(rho, abs=0.1)


def spectra_of(rho: float) -> list[tuple[np.ndarray, np.ndarray, float]]:
    """The periodogram of 2000 samples of AR(1) noise of unit variance."""
    p = np.abs(np.fft.rfft(coloured(rho, 2)[:2000])) ** 2 / 2000
    return [(np.linspace(0, np.pi, len(p))[1:-1], p[1:-1], 1.0)]


def test_the_standard_error_of_a_power_is_one_over_the_root_of_its_ordinates() -> None:
    """And σ² of white noise is the mean of the ordinates, up to those that are no noise."""
    spectra = spectra_of(0.0)
    sigma, rho, spread = _whittle(spectra, None, DEFAULTS.noise)
    assert rho == 0.0 and sigma == pytest.approx(np.sqrt(np.mean(spectra[0][1])), rel=0.01)
    assert 1 / np.sqrt(999) <= spread < 4 / np.sqrt(999)


def test_what_a_recording_states_is_taken() -> None:
    stated = Recording.from_arrays(T, {"y": MOVING}, sigma={"y": np.linspace(0.1, 0.3, 1000)})
    level = first_level(stated, "y", None, DEFAULTS)
    assert level.sigma == pytest.approx(0.2) and (level.rho, level.spread) == (0.0, 0.0)
    assert level.source == "given" and level.interval == pytest.approx(0.01)
    y = MOVING + 0.01 * coloured(0.6, 3)[:1000]
    read = first_level(Recording.from_arrays(T, {"y": y}), "y", (0.0, 1.99), DEFAULTS)
    assert read.sigma == pytest.approx(0.01, rel=0.3) and read.rho == pytest.approx(0.6, abs=0.2)
    assert 0.1 < read.spread < 0.6 and read.stretch == pytest.approx((0.0, 1.99))


def test_white_noise_counts_only_where_it_is_likely() -> None:
    """A faint correlation, seen for certain: the power of the noise is as sure as its samples."""
    omega = np.linspace(0.3, 3.0, 400)
    spectrum = (omega, _shape(GRID[1], omega), 1e6)
    _, rho, spread = _whittle([spectrum], None, DEFAULTS.noise)
    assert rho == GRID[1]
    assert spread == pytest.approx(1.0 / np.sqrt(1e6 * 400), rel=0.1)
