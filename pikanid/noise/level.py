"""How noisy is a signal, and how is its noise coloured?

The noise is best seen where nothing else happens: a quiet stretch gives its standard deviation
and an autoregressive model AR(p), each with its own uncertainty, since 20 samples leave a
correlation of ±0.2.  Where a recording has no quiet stretch, the highest frequencies give a
standard deviation only, under the assumption that the noise is white.  `estimate` says which of
the two was used.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from pikanid import errors
from pikanid.noise.autoregressive import AR, autocorrelation, fit
from pikanid.noise.floor import rounding_noise
from pikanid.noise.quiet import SHORTEST, even_parts, find_quiet
from pikanid.recording import Recording
from pikanid.recording.channel import Array, Channel, check_times, check_values


@dataclass(frozen=True)
class NoiseModel:
    """Noise of one signal: ε_t = Σ a_k ε_{t-k} + e_t with white Gaussian e_t.

    Attributes:
        sigma: Standard deviation of ε, in the signal's unit.
        sigma_std: Standard error of `sigma`.
        ar: (p,) coefficients a_k; empty for white noise.
        ar_covariance: (p, p) covariance of their estimates.
        innovation: Standard deviation of e.
        interval: Sampling interval that the coefficients belong to [s].
        source: ``"quiet stretch"`` or ``"highest frequencies"``.
        start: Of the samples used [s].
        stop: Of the samples used [s].
        n: Number of samples used.
    """

    sigma: float
    sigma_std: float
    ar: Array
    ar_covariance: Array
    innovation: float
    interval: float
    source: Literal["quiet stretch", "highest frequencies"]
    start: float
    stop: float
    n: int

    @property
    def white(self) -> bool:
        """Whether no correlation is modelled."""
        return len(self.ar) == 0

    def autocovariance(self, n: int) -> Array:
        """(n,) autocovariances at lags 0 to n-1 samples.

        >>> model = estimate(_example())
        >>> bool(np.isclose(model.autocovariance(3)[0], model.sigma**2))
        True
        """
        return self.sigma**2 * autocorrelation(self.ar, n)

    def whiten(self, residuals: Array, time: Array | None = None) -> Array:
        """Residuals, or the columns of their Jacobian, as white noise of unit variance.

        The result w has wᵀw = rᵀΣ⁻¹r with Σ the covariance of the noise.  The filter starts anew
        after every gap in `time`.

        Args:
            residuals: (N,) or (N, k).
            time: (N,) sample times [s]; without them the residuals are taken as one stretch.

        Returns:
            Array shaped as `residuals`.

        Raises:
            BadRecording: If `time` is sampled at another interval than the model.

        >>> model = estimate(_example())
        >>> w = model.whiten(_example().values[-300:])
        >>> bool(abs(np.std(w) - 1) < 0.1)
        True
        """
        r = np.asarray(residuals, dtype=float)
        if self.white:
            return r / self.sigma
        ends = [0, len(r)] if time is None else self._stretches(np.asarray(time, dtype=float))
        out = np.empty_like(r)
        for a, b in itertools.pairwise(ends):
            out[a:b] = self._whitened(r[a:b])
        return out

    def _stretches(self, time: Array) -> list[int]:
        steps = np.diff(time)
        if len(steps) and abs(float(np.median(steps)) / self.interval - 1) > 0.01:
            raise errors.BadRecording(errors.noise_interval(self.interval, float(np.median(steps))))
        jumps = np.flatnonzero(np.abs(steps / self.interval - 1) > 0.5) + 1
        return [0, *jumps.tolist(), len(time)]

    def _whitened(self, r: Array) -> Array:
        from scipy.signal import lfilter

        p = len(self.ar)
        taps = np.concatenate([[1.0], -self.ar])
        white = np.asarray(lfilter(taps, [1.0], r, axis=0), dtype=float) / self.innovation
        # The first p samples have no full past: whiten them by the stationary covariance.
        head = min(p, len(r))
        lags = np.abs(np.subtract.outer(np.arange(head), np.arange(head)))
        factor = np.linalg.cholesky(self.autocovariance(max(head, 1))[lags])
        white[:head] = np.linalg.solve(factor, r[:head])
        return white

    def __str__(self) -> str:
        colour = "white" if self.white else f"AR({len(self.ar)})"
        return (
            f"sigma = {self.sigma:.4g} ± {self.sigma_std:.1g}, {colour}, from the {self.source} "
            f"({self.n} samples, {self.start:g} s to {self.stop:g} s)"
        )


def estimate(channel: Channel, quiet: tuple[float, float] | None = None) -> NoiseModel:
    """The noise of a signal, from a quiet stretch if it has one.

    Args:
        channel: Samples may be missing.
        quiet: Start and stop [s] of a stretch known to be quiet; looked for if None.

    Raises:
        BadRecording: If there are fewer than `SHORTEST` samples (in `quiet`), or none vary.

    >>> print(estimate(_example()).source)
    quiet stretch
    """
    check_times(channel, channel.name)
    check_values(channel, channel.name, missing_allowed=True)
    stretch = find_quiet(channel) if quiet is None else quiet
    if stretch is None:
        return _from_highest(channel)
    return _from_quiet(channel, *stretch)


def high_band_sigma(channel: Channel) -> tuple[float, float]:
    """(sigma, its standard error) of white noise under a signal, from fourth differences.

    Fourth differences pass the noise at the highest frequencies and hardly anything of a signal
    that is well sampled: σ² = E(Δ⁴y)²/70 (T. Gasser et al., Biometrika 73, 1986, for difference
    estimators).  The median makes jumps and outliers harmless.  Where the signal itself reaches
    half the sampling rate, the result is an upper bound.

    Raises:
        BadRecording: If fewer than 8 fourth differences can be formed, or nothing varies.

    >>> rng = np.random.default_rng(0)
    >>> t = np.arange(2000) * 0.01
    >>> y = np.sin(2 * t) + 0.1 * rng.standard_normal(2000)
    >>> round(high_band_sigma(Channel("y", t, y))[0], 2)
    0.1
    """
    weights = np.array([1.0, -4.0, 6.0, -4.0, 1.0])
    parts = [np.convolve(y, weights, "valid") for _, y in even_parts(channel) if len(y) >= 5]
    differences = np.concatenate(parts) if parts else np.empty(0)
    if len(differences) < 8:
        raise errors.BadRecording(errors.noise_short(channel.name, len(differences) + 4))
    # 0.6745: the median absolute deviation of a unit Gaussian; 70 = Σ weights².
    sigma = float(np.median(np.abs(differences)) / 0.6745 / np.sqrt(70.0))
    sigma = max(sigma, rounding_noise(channel.values))
    if sigma == 0:
        raise errors.BadRecording(errors.noise_none(channel.name))
    lags = np.correlate(weights, weights, "full") / 70.0
    # The median uses 37 % of the information; neighbouring differences share samples.
    spread = sigma * np.sqrt(np.sum(lags**2) / 0.37 / (2 * len(differences)))
    return sigma, float(spread)


def with_estimated_sigma(recording: Recording, names: Iterable[str] | None = None) -> Recording:
    """A recording whose channels without a sigma get an estimated one; a note says from what.

    Args:
        recording: Any.
        names: Of the channels; by default all without a sigma and without a declared hold.

    >>> rec = with_estimated_sigma(Recording({"y": _example()}))
    >>> rec["y"].sigma is not None
    True
    """
    chosen = (
        names
        if names is not None
        else [key for key, ch in recording.channels.items() if ch.sigma is None and ch.hold is None]
    )
    for key in chosen:
        model = estimate(recording[key])
        recording = replace(
            recording.with_sigma({key: model.sigma}),
            notes=(*recording.notes, f"Noise of '{key}': {model}."),
        )
    return recording


def _from_quiet(channel: Channel, start: float, stop: float) -> NoiseModel:
    inside = (channel.time >= start) & (channel.time <= stop) & np.isfinite(channel.values)
    time, values = channel.time[inside], channel.values[inside]
    if len(values) < SHORTEST:
        raise errors.BadRecording(errors.noise_short(channel.name, len(values)))
    centred, least = values - values.mean(), rounding_noise(channel.values)
    if not np.any(centred) and not least:
        raise errors.BadRecording(errors.noise_none(channel.name))
    # a rounded signal at rest: all that is known of its noise is that rounding hides it
    found = fit(centred) if np.ptp(values) > 0 else _hidden(least, len(values))
    sigma = max(found.sigma, least)
    scale = sigma / found.sigma
    return NoiseModel(
        sigma,
        found.sigma_std * scale,
        found.coefficients,
        found.covariance,
        found.innovation * scale,
        float(np.median(np.diff(time))),
        "quiet stretch",
        float(time[0]),
        float(time[-1]),
        len(values),
    )


def _from_highest(channel: Channel) -> NoiseModel:
    sigma, spread = high_band_sigma(channel)
    seen = channel.time[np.isfinite(channel.values)]
    return NoiseModel(
        sigma,
        spread,
        np.empty(0),
        np.empty((0, 0)),
        sigma,
        channel.interval,
        "highest frequencies",
        float(seen[0]),
        float(seen[-1]),
        len(seen),
    )


def _hidden(sigma: float, n: int) -> AR:
    """White noise of σ, as well known as from n samples."""
    return AR(np.empty(0), sigma, np.empty((0, 0)), sigma, sigma / float(np.sqrt(2 * n)))


def _example() -> Channel:
    """A decayed swing with noise: what the examples above look at."""
    t: Array = np.arange(1000) / 100.0
    noise = 0.002 * np.random.default_rng(1).standard_normal(1000)
    return Channel("theta", t, 0.2 * np.exp(-1.5 * t) * np.cos(14 * t) + noise, "rad")
