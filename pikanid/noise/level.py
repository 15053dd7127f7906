"""How noisy is a signal, and how is its noise coloured?

The noise is best seen where nothing else happens: a quiet stretch gives its standard deviation
and the correlation of neighbours, with an uncertainty.  Where a recording has no quiet stretch, the
highest frequencies give a standard deviation only, under the assumption that the noise is white.
`estimate` says which of the two was used.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from pikanid import errors
from pikanid.noise.autoregressive import autocorrelation, fit
from pikanid.noise.floor import rounding_noise
from pikanid.noise.neighbours import beside_neighbours
from pikanid.noise.quiet import about_mean, about_trend, find_quiet, without_moves
from pikanid.noise.settings import ROUNDING, USUAL, QuietSettings, RoundingSettings
from pikanid.recording.channel import Array, Channel, check_times, check_values

EFFICIENCY = 0.37  # definition: of the median absolute deviation, normal noise
NORMAL = 0.6744897501960817  # definition: median absolute value of a unit Gaussian


@dataclass(frozen=True)
class NoiseModel:
    """Noise of one output: ε_t = ρ ε_{t-1} + e_t with white Gaussian e_t.

    Attributes:
        sigma: Standard deviation of ε, in the output's unit.
        rho: Correlation of neighbours; 0 for white noise.
        spread: Relative standard error of its power at low frequencies, on average; 0 if given.
        interval: Between neighbours [s].
        source: In words; "given" where σ was not estimated.
        stretch: Start and stop [s] of a quiet stretch long enough to tell low frequencies.
        excess: By how much louder it can be there at most, as the logarithm of a power, whatever
            its colour: a fit leaves no less than noise.
    """

    sigma: float
    rho: float
    spread: float
    interval: float
    source: str
    stretch: tuple[float, float] | None = None
    excess: float = np.inf

    def sentence(self, output: str) -> str:
        """What was found."""
        colour = f"correlation {self.rho:.2f} between neighbours" if self.rho else "white"
        source = "as given" if self.source == "given" else f"from {self.source}"
        return f"Noise of '{output}': sigma = {self.sigma:.3g}, {colour}, {source}."

    def spreads(self, given: Array | None, n: int) -> Array:
        """Standard deviation (n,) of every sample: as `given` (n,) where σ was given for each.

        >>> NoiseModel(2.0, 0.0, 0.0, 0.1, "given").spreads(np.array([1.0, 3.0]), 2).tolist()
        [1.0, 3.0]
        >>> NoiseModel(2.0, 0.0, 0.0, 0.1, "a quiet stretch").spreads(None, 2).tolist()
        [2.0, 2.0]
        """
        if self.source == "given" and given is not None and np.ptp(given) > 0:
            return np.asarray(given, float)
        return np.full(n, self.sigma)

    def whiten(self, rows: Array, t: Array, given: Array | None = None) -> Array:
        """Rows (N,) or (N, k) at times t as white noise of unit variance; of each sample the σ may
        be `given` (N,).

        The result w has wᵀw = rᵀΣ⁻¹r with Σ the covariance of the noise.  That is exact over gaps:
        the correlation over m intervals is ρ^m.

        >>> model = NoiseModel(2.0, 0.5, 0.0, 0.1, "given")
        >>> [round(float(w), 3) for w in model.whiten(np.array([2.0, 1.0, 0.5]),
        ...                                           np.array([0.0, 0.1, 0.3]))]
        [1.0, 0.0, 0.129]
        """
        return self.whitening(t, given)(rows)

    def whitening(self, t: Array, given: Array | None = None) -> Whitening:
        """`whiten` at these times, for rows that change while times stay."""
        spreads = self.spreads(given, len(t))
        if self.rho == 0:
            return Whitening(spreads)
        keep = self.rho ** np.maximum(np.rint(np.diff(t) / self.interval), 1.0)
        return Whitening(spreads, keep, np.sqrt(1 - keep**2))


@dataclass(frozen=True, eq=False)
class Whitening:
    """Makes noise at given times white: σ (N,) of the samples, and of all but the first (N-1,) what
    is kept of the one before, and what is new; neither where the noise is white.
    """

    spreads: Array
    kept: Array | None = None
    new: Array | None = None

    def __call__(self, rows: Array) -> Array:
        """Rows (N,) or (N, k)."""
        rows = rows / _beside(self.spreads, rows)
        if self.kept is None or self.new is None:
            return rows
        found = np.empty_like(rows)
        found[:1] = rows[:1]
        np.subtract(rows[1:], _beside(self.kept, rows) * rows[:-1], out=found[1:])
        found[1:] /= _beside(self.new, rows)
        return found


def _beside(values: Array, rows: Array) -> Array:
    """Values (N,) as they multiply rows (N,) or (N, k)."""
    return values[:, None] if rows.ndim == 2 else values


def estimate(channel: Channel, quiet: tuple[float, float] | None = None,
             drives: Sequence[Channel] = (), settings: QuietSettings = USUAL,
             rounding: RoundingSettings = ROUNDING) -> NoiseModel:
    """The noise of a signal, from a quiet stretch if it has one.

    Args:
        channel: Samples may be missing.
        quiet: Start and stop [s] of a stretch known to be quiet; looked for if None.  What is found
            may hold a slow trend, what is known to be quiet holds none.
        drives: Inputs; a stretch that is looked for is quiet while none of them moves.
        settings: What counts as quiet.
        rounding: What counts as rounded: σ is at least what rounding leaves.

    Raises:
        BadRecording: If there are fewer samples (in `quiet`) than `shortest`, or none vary.

    >>> t = np.arange(1000) / 100.0
    >>> noise = 0.002 * np.random.default_rng(1).standard_normal(1000)
    >>> swing = Channel("theta", t, 0.2 * np.exp(-1.5 * t) * np.cos(14 * t) + noise, "rad")
    >>> print(estimate(swing).sentence("theta"))
    Noise of 'theta': sigma = 0.00206, white, from the quiet stretch (4.2 s to 9.81 s).
    """
    check_times(channel, channel.name)
    check_values(channel, channel.name, missing_allowed=True)
    if quiet is not None:
        return _from_quiet(channel, *quiet, settings, rounding, about_mean)
    stretch = find_quiet(channel, settings)
    still = stretch and without_moves(channel, drives, *stretch, settings)
    if not still:
        return _from_highest(channel, rounding)
    return _from_quiet(channel, *still, settings, rounding, about_trend)


def high_band_sigma(channel: Channel, rounding: RoundingSettings = ROUNDING
                    ) -> tuple[float, float]:
    """(sigma, its standard error) of white noise under a signal, from what the four neighbours of a
    sample do not tell of it: of an evenly sampled one, fourth differences.

    Fourth differences pass the noise at the highest frequencies and hardly anything of a signal
    that is well sampled: σ² = E(Δ⁴y)²/70 (T. Gasser et al., Biometrika 73, 1986, for difference
    estimators).  The median makes jumps and outliers harmless.  Where the signal itself reaches
    half the sampling rate, the result is an upper bound.

    Raises:
        BadRecording: If fewer than 8 samples have four neighbours, or nothing varies.

    >>> rng = np.random.default_rng(0)
    >>> t = np.arange(2000) * 0.01
    >>> y = np.sin(2 * t) + 0.1 * rng.standard_normal(2000)
    >>> round(high_band_sigma(Channel("y", t, y))[0], 2)
    0.1
    """
    differences = beside_neighbours(channel.time, channel.values)
    if len(differences) < 8:
        raise errors.BadRecording(errors.noise_short(
            channel.name, int(np.isfinite(channel.values).sum())))
    sigma = max(_spread(differences), rounding_noise(channel.values, rounding))
    if sigma == 0:
        raise errors.BadRecording(errors.noise_none(channel.name))
    return sigma, sigma * known_by(differences) / 2


def difference_noise(values: Array, time: Array | None = None,
                     rounding: RoundingSettings = ROUNDING) -> float:
    """σ of white noise on a smooth signal (N,) by the same differences, whatever there is of it; at
    least that of rounding to the sensor's step.

    Args:
        values: (N,), all finite.
        time: (N,) [s]; None where sampling is even.

    >>> t = np.arange(2000) * 0.01
    >>> noisy = np.sin(t) + np.random.default_rng(0).normal(0, 0.1, 2000)
    >>> bool(abs(difference_noise(noisy) - 0.1) < 0.01)
    True
    """
    return difference_noise_and_freedom(values, time, rounding)[0]


def difference_noise_and_freedom(values: Array, time: Array | None = None,
                                 rounding: RoundingSettings = ROUNDING) -> tuple[float, float]:
    """The same, and the degrees of freedom of its power: 2 over its squared relative error."""
    if len(values) < 5:
        return float(np.std(values)), 1.0
    differences = beside_neighbours(
        np.arange(float(len(values))) if time is None else time, values)
    sigma = max(_spread(differences), rounding_noise(values, rounding))
    return sigma, 2 / known_by(differences) ** 2


def _spread(differences: Array) -> float:
    """Their standard deviation; by the median, as a few kinks must not count."""
    return float(np.median(np.abs(differences)) / NORMAL)


def known_by(differences: Array) -> float:
    """Relative standard error of the noise's power by so many differences.

    >>> round(known_by(np.ones(500)), 3)
    0.169
    """
    weights = np.array([1.0, -4.0, 6.0, -4.0, 1.0])
    lags = np.correlate(weights, weights, "full") / np.sum(weights**2)
    # the median uses 37 % of the information; neighbouring differences share samples
    return 2 * float(np.sqrt(np.sum(lags**2) / EFFICIENCY / (2 * len(differences))))


def _from_quiet(channel: Channel, start: float, stop: float, settings: QuietSettings,
                rounding: RoundingSettings, centred: Callable[[Array], Array]) -> NoiseModel:
    inside = (channel.time >= start) & (channel.time <= stop) & np.isfinite(channel.values)
    time, values = channel.time[inside], channel.values[inside]
    n = len(values)
    if n < settings.shortest:
        raise errors.BadRecording(errors.noise_short(channel.name, n))
    least = rounding_noise(channel.values, rounding)
    if np.ptp(values) == 0 and not least:
        raise errors.BadRecording(errors.noise_none(channel.name))
    sigma, rho, spread = least, 0.0, 2 / float(np.sqrt(2 * n))
    if np.ptp(values) > 0:  # else all that is known of the noise is that rounding hides it
        found = fit(centred(values), settings.order)
        sigma, spread = max(found.sigma, least), 2 * found.sigma_std / found.sigma
        rho = float(np.clip(autocorrelation(found.coefficients, 2)[1], 0.0, settings.steepest))
    first, last = float(time[0]), float(time[-1])
    return NoiseModel(sigma, rho if n >= settings.low else 0.0, spread, channel.interval,
                      f"the quiet stretch ({first:g} s to {last:g} s)",
                      (first, last) if n >= settings.low else None)


def _from_highest(channel: Channel, rounding: RoundingSettings) -> NoiseModel:
    sigma, error = high_band_sigma(channel, rounding)
    seen = channel.time[np.isfinite(channel.values)]
    return NoiseModel(sigma, 0.0, 2 * error / sigma, channel.interval,
                      f"the highest frequencies ({seen[0]:g} s to {seen[-1]:g} s)")
