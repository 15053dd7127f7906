"""The noise that a diagnosis is judged against, and how well it is known.

Noise is seen where nothing else is: in a quiet stretch at all frequencies, and in the residual of a
fit far above the natural frequency, where missing physics hardly reaches.  Both together give an
AR(1) model by Whittle's likelihood (P. Whittle, Ark. Mat. 2, 1953).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pikanid.mismatch.settings.noise import NoiseSettings
from pikanid.mismatch.settings.settings import Settings
from pikanid.mismatch.settings.thresholds import bic
from pikanid.noise.floor import rounding_noise
from pikanid.noise.level import NoiseModel, difference_noise, estimate, known_by
from pikanid.noise.neighbours import beside_neighbours
from pikanid.noise.quiet import TREND, about_mean, about_trend
from pikanid.recording import Recording
from pikanid.recording.channel import Array, Channel

LONGEST = 50  # numerical: samples of a gap beyond which a line across it leaves nothing that counts
UNEVEN = 0.2  # numerical: of an interval, by which samples may be off an even grid
MOVED = 0.3  # numerical: of the noise, by which a residual may change on the way to the grid
TAPER = 0.2  # numerical: share of a residual that the window tapers, half of it at each end
TAPERED = 0.9  # numerical: (Σw²)²/(N Σw⁴): share of the ordinates that stay independent under that
BRIDGED = 0.1  # numerical: least share of white noise's power that a spectrum is divided by
HIGHEST = 0.97  # numerical: of half the sampling rate: beyond, anti-alias filters bend a spectrum
MEAN_OF = 50  # numerical: frequencies that a mean power is taken over
LEAST = 8  # limit: neighbourhoods of a residual that say anything of its noise
STANDARD = 0.683  # definition: probability within one standard deviation
GRID = np.linspace(0.0, 0.95, 191)  # numerical: correlations of neighbours that are compared
Spectrum = tuple[np.ndarray, np.ndarray, float]  # ω [rad a sample], power, weight of an ordinate


def first_level(recording: Recording, output: str, quiet: tuple[float, float] | None,
                settings: Settings, inputs: Sequence[str] = ()) -> NoiseModel:
    """What the recording alone says, before any fit; a stretch is quiet while no input moves.

    Raises:
        BadRecording: If nothing varies.
    """
    channel = recording[output]
    if channel.sigma is not None:
        return NoiseModel(float(np.median(channel.sigma)), 0.0, 0.0, channel.interval, "given")
    drives = [recording[u] for u in inputs if u in recording]
    return estimate(channel, quiet, drives, settings.quiet, settings.rounding)


def refined(level: NoiseModel, channel: Channel, t: np.ndarray, residual: np.ndarray, rate: float,
            quiet: tuple[float, float] | None, settings: Settings, explained: bool = False,
            freedom: float = 1.0) -> NoiseModel:
    """The level again, now that a fit has taken the motion away.

    Args:
        level: So far.
        channel: Of the output.
        t, residual: (N,) of the fit at the samples that are there.
        rate: Natural frequency [rad/s]: the residual counts from some times that on.
        quiet: Stretch in which nothing moves, if one is known.
        settings: What counts as noise.
        explained: Whether the fit leaves nothing that a test sees.
        freedom: Share of the samples that the fit's parameters leave, which matters of few.
    """
    found = _spectrum(level, t, residual, rate, settings.noise)
    if found is None:
        return _from_neighbours(level, channel, t, residual / np.sqrt(freedom), settings, explained)
    omega, power, high, share, low = found
    spectra = [(omega[high], power[high], TAPERED * share)]
    source = "the residual's highest frequencies"
    stretch = quiet or level.stretch
    if stretch is not None:
        inside = (channel.time >= stretch[0]) & (channel.time <= stretch[1]) & np.isfinite(
            channel.values)
        values = channel.values[inside]
        if len(values) >= settings.quiet.low:
            centred, first = (about_trend, TREND) if quiet is None else (about_mean, 1)
            p = np.abs(np.fft.rfft(centred(values))) ** 2 / len(values)
            spectra.append((np.linspace(0, np.pi, len(p))[first:], p[first:], 1.0))
            source = f"a quiet stretch ({stretch[0]:g} s to {stretch[1]:g} s) and {source}"
    given = level.sigma if level.source == "given" else None
    sigma, rho, spread = _whittle(spectra, given, settings.noise)
    # What a fit leaves at all frequencies is noise and misfit: it may be more than noise, not less.
    # A stretch in which a motion dies out is no quiet one, and the shape of high frequencies can
    # mislead.  What explains all that a test sees leaves noise alone: it is read at all
    # frequencies, unless where noise was sure that makes it unlikely.
    every = (omega > 0) & (omega < HIGHEST * np.pi)
    whole = _whittle([(omega[every], power[every], TAPERED * share)], given, settings.noise)
    louder = np.log(_power(*whole[:2], low) / _power(sigma, rho, low))
    dearer = (_against(spectra, *whole[:2], settings.noise)
              - _against(spectra, sigma, rho, settings.noise))
    if louder < -settings.noise.less * spread or (
            explained and (louder < 0 or dearer < settings.contradiction)):
        sigma, rho, spread = whole
        source = "the residual at all frequencies"
    # whatever colour it may have, noise is no louder than what a fit leaves
    excess = max(float(louder), 0.0) + whole[2]
    if given is not None:
        return replace(level, rho=rho, spread=spread if rho else 0.0, excess=excess)
    # a fit leaves nothing of a rounded signal at rest: where it moves there is more
    least = rounding_noise(channel.values, settings.rounding)
    return replace(level, sigma=max(sigma, least), rho=rho, spread=spread, source=source,
                   excess=excess)


def _from_neighbours(level: NoiseModel, channel: Channel, t: Array, residual: Array,
                     settings: Settings, explained: bool) -> NoiseModel:
    """The level again where samples are few, or off an even grid: white noise, by what neighbours
    do not tell of a residual, which reaches less far up than the motion.
    """
    differences = beside_neighbours(t, residual)
    if level.source == "given" or len(differences) < LEAST:
        return level
    quiet = level.stretch is not None
    sigma, spread, source = level.sigma, level.spread, level.source
    if not quiet:
        sigma, spread = difference_noise(residual, t), known_by(differences)
        source = "what the residual's neighbours do not tell"
    # as above: a fit leaves no less than noise, and what explains all leaves noise alone
    whole = float(np.sqrt(np.mean(residual**2)))
    if whole == 0 or sigma == 0:
        return level
    louder = 2 * float(np.log(whole / sigma))
    excess = max(louder, 0.0) + np.sqrt(2 / len(residual))
    if louder < -settings.noise.less * spread or (explained and louder < 0):
        sigma, spread = whole, np.sqrt(2 / len(residual))
        source = "the residual at all frequencies"
    least = rounding_noise(channel.values, settings.rounding)
    return replace(level, sigma=max(sigma, least), spread=float(spread), source=source,
                   excess=excess)


def louder(level: NoiseModel, t: np.ndarray, residual: np.ndarray, rate: float,
           settings: NoiseSettings) -> tuple[float, float] | None:
    """How many times the power of a noise that another recording told a residual (N,) at times t
    (N,) has at its highest frequencies or, off an even grid, beside its neighbours, and the
    relative standard error of that; None where samples are too few to tell.
    """
    if len(t) < settings.least_spectrum:
        return None
    found = _spectrum(level, t, residual, rate, settings)
    if found is None:
        beside = beside_neighbours(t, residual)
        if len(beside) < LEAST or level.rho:
            return None
        return (difference_noise(residual, t) / level.sigma) ** 2, known_by(beside)
    omega, power, high, share, _ = found
    expected = level.sigma**2 * (1 - level.rho**2) * _shape(level.rho, omega[high])
    ratio = _calm(power[high] / expected, settings.line)
    return float(np.mean(ratio)), 1.0 / np.sqrt(TAPERED * share * len(ratio))


def _spectrum(level: NoiseModel, t: np.ndarray, residual: np.ndarray, rate: float,
              settings: NoiseSettings) -> tuple[Array, Array, Array, float, float] | None:
    """ω [rad a sample] and power of a residual (N,) at times t (N,), which of them lie where no
    motion reaches, the share of samples that are there, and the lowest such ω; None where samples
    are few, or off an even grid.
    """
    from scipy.signal.windows import tukey

    h = level.interval
    if len(t) < settings.least_spectrum:
        return None
    steps = np.maximum(np.rint(np.diff(t) / h), 1.0)
    grid = np.concatenate([[0], np.cumsum(steps)]).astype(int)
    interval, start = np.polyfit(grid, t, 1)
    off = (t - start) / interval - grid
    if np.abs(off).max() > UNEVEN:
        # times that vary blur what is smooth; noise alone is one series, whatever its times
        moved = off.std() * np.sqrt(np.mean((np.diff(residual) / steps) ** 2))
        if np.abs(off).max() > 0.5 or moved > MOVED * difference_noise(residual, t):
            return None
    even = np.interp(np.arange(grid[-1] + 1), grid, residual)
    window = tukey(len(even), TAPER)
    power = np.abs(np.fft.rfft(even * window)) ** 2 / np.sum(window**2)
    omega = np.linspace(0, np.pi, len(power))
    power /= np.maximum(bridged(grid), BRIDGED)
    # below a quarter of the band even where the oscillator is slow: impacts and steps reach far up
    low, top = (bound * np.pi for bound in settings.begins)
    high = (omega > np.clip(settings.above * rate * h, low, top)) & (
        omega < HIGHEST * np.pi)
    return omega, power, high, len(t) / len(even), low


def bridged(grid: np.ndarray) -> np.ndarray:
    """What straight lines across gaps leave of white noise's power (n//2 + 1,), by frequency.

    Args:
        grid: (N,) increasing numbers of the samples that are there, from 0 to n - 1.

    >>> [float(x) for x in bridged(np.arange(5))]
    [1.0, 1.0, 1.0]
    """
    from scipy.sparse import csr_array

    n = int(grid[-1]) + 1
    every = np.arange(n)
    left = np.clip(np.searchsorted(grid, every, "right") - 1, 0, len(grid) - 2)
    width = grid[left + 1] - grid[left]
    share = (every - grid[left]) / width
    # of a long line nothing is left at the frequencies that count
    there = width <= LONGEST
    A = csr_array((np.concatenate([(1 - share) * there, share * there]),
                   (np.tile(every, 2), np.concatenate([left, left + 1]))), shape=(n, len(grid)))
    A.eliminate_zeros()
    covariance = (A @ A.T).tocoo()
    lags = np.bincount((covariance.row - covariance.col) % n, covariance.data, n)
    return np.asarray(np.fft.rfft(lags).real / n)


def _whittle(spectra: list[Spectrum], given: float | None, settings: NoiseSettings
             ) -> tuple[float, float, float]:
    """(σ, ρ, relative standard error of the power below the first spectrum); σ may be `given`."""
    total = sum(w * len(o) for o, _, w in spectra)
    quiet, logs = np.zeros(len(GRID)), np.zeros(len(GRID))
    for omega, power, weight in spectra:
        shapes = _shape(GRID[:, None], omega)
        quiet += weight * np.sum(_calm(power / shapes, settings.line), axis=1)
        logs += weight * np.sum(np.log(shapes), axis=1)
    scales = quiet / total if given is None else given**2 * (1 - GRID**2)
    costs = quiet / scales + logs + total * np.log(scales)
    sigmas = np.sqrt(scales / (1 - GRID**2))
    powers = np.log(_power(sigmas, GRID, spectra[0][0][0]))
    best = likeliest(costs, total)
    spread = 1.0 / np.sqrt(total)
    if best < len(GRID) - 1:  # at the end of the grid it is a motion, not noise
        # the curvature at the best ρ says too little: far smaller ones may be nearly as likely
        likely = np.exp(costs.min() - costs) / len(GRID)
        likely[0] += np.exp(costs.min() - costs[0])  # white noise is as likely as any other
        spread = float(np.hypot(spread, _two_thirds(np.abs(powers - powers[best]), likely)))
    return float(sigmas[best]), float(GRID[best]), min(spread, settings.order_only)


def _two_thirds(distances: Array, weights: Array) -> float:
    """Below which as much of the weight lies as within one standard deviation."""
    order = np.argsort(distances)
    share = np.cumsum(weights[order]) / np.sum(weights)
    return float(np.interp(STANDARD, share, distances[order]))


def _against(spectra: list[Spectrum], sigma: float, rho: float, settings: NoiseSettings) -> float:
    """-ln of the likelihood of AR(1) noise."""
    cost, scale = 0.0, sigma**2 * (1 - rho**2)
    for omega, power, weight in spectra:
        expected = scale * _shape(rho, omega)
        cost += weight * float(np.sum(_calm(power / expected, settings.line) + np.log(expected)))
    return cost


def _power(sigma: Array | float, rho: Array | float, top: float) -> Array:
    """Mean power of ε between frequency zero and `top` [rad]; of several (σ, ρ) each."""
    shapes = _shape(np.expand_dims(rho, -1), np.linspace(0.0, top, MEAN_OF))
    return np.asarray(np.square(sigma) * (1 - np.square(rho)) * np.mean(shapes, axis=-1))


def _shape(rho: Array | float, omega: Array) -> Array:
    """1/|1 - ρ exp(-iω)|²: the spectrum of AR(1) noise."""
    return np.asarray(1.0 / (1 - 2 * rho * np.cos(omega) + rho**2))


def likeliest(costs: np.ndarray, total: float) -> int:
    """Which ρ of `GRID` has the least cost, -ln of the likelihood of `total` ordinates; zero unless
    another one is better by more than the price of a parameter.
    """
    best = int(np.argmin(costs))
    return 0 if costs[0] - costs[best] < bic(total) else best


def _calm(ratio: Array, line: float) -> Array:
    """Ordinates (..., n) limited to some times their median's mean: a `line` in the band is no
    noise.
    """
    return np.minimum(ratio, line * np.median(ratio, axis=-1, keepdims=True) / np.log(2))
