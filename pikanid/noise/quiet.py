"""Stretches of a recording in which nothing but noise, and a slow trend, can be seen."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from pikanid.noise.autoregressive import AR, autocorrelation, fit, innovations
from pikanid.noise.settings import USUAL, QuietSettings
from pikanid.recording.channel import Array, Channel

_POSITIONS = 200  # limit: windows tried of each length
_TESTED = 20  # limit: of these, the calmest, that are tested
_LAGS = 50  # numerical: over which a short memory dies out
_EXACT = 1e-12  # numerical: of the values, what rounding leaves of a constant
TREND = 3  # definition: degree of a trend: an arc of a motion is a cubic, noise is none


def find_quiet(channel: Channel, settings: QuietSettings = USUAL
               ) -> tuple[float, float] | None:
    """The longest stretch [s] in which nothing but noise about a trend can be seen, or None.

    A stretch counts as quiet if it is among the calmest of the recording, and about a cubic trend
    at most an AR(1) process of short memory describes it (what that leaves has a flat spectrum),
    its halves spread alike, and two trends, one for each half, leave no less than noise allows: a
    motion that noise hides over a stretch vanishes in its halves, noise does not.  Of several of
    one length it is the one of middling variance: the calmest would make noise too small.  Looked
    for in evenly sampled parts without gaps.

    >>> t = np.arange(1000) * 0.01
    >>> noise = 0.002 * np.random.default_rng(1).standard_normal(1000)
    >>> start, stop = find_quiet(Channel("y", t, 0.2 * np.exp(-1.5 * t) * np.cos(14 * t) + noise))
    >>> stop - start > 2.0
    True
    """
    best: tuple[float, float] | None = None
    for time, values in even_parts(channel):
        found = _longest_quiet(values, settings)
        if found is None:
            continue
        span = (float(time[found[0]]), float(time[found[1] - 1]))
        if best is None or span[1] - span[0] > best[1] - best[0]:
            best = span
    return best


def without_moves(channel: Channel, drives: Sequence[Channel], start: float, stop: float,
                  settings: QuietSettings = USUAL) -> tuple[float, float] | None:
    """The longest part of a stretch [s] in which no input leaves the value that it has for most of
    it: what is driven at random can look like coloured noise.  None where that is too short.
    """
    t = channel.time[(channel.time >= start) & (channel.time <= stop)]
    moves = np.zeros(len(t), bool)
    for drive in drives:
        u = drive.values[np.isfinite(drive.values)]
        if len(u) < len(drive.values) or len(u) < 5 or np.ptp(u) == 0:
            continue
        here = np.interp(t, drive.time, u)
        # fourth differences show the noise of what is well sampled, and nothing else
        noisy = float(np.median(np.abs(np.diff(u, 4)))) / 0.6745 / np.sqrt(70.0)
        moves |= np.abs(here - np.median(here)) > max(
            settings.still * np.ptp(u), settings.still_noise * noisy)
    ends = np.flatnonzero(np.concatenate([[True], moves, [True]]))
    longest = int(np.argmax(np.diff(ends)))
    first, last = int(ends[longest]), int(ends[longest + 1]) - 2
    enough = last - first + 1 >= settings.shortest
    return (float(t[first]), float(t[last])) if enough else None


def even_parts(channel: Channel) -> Iterator[tuple[Array, Array]]:
    """Stretches without gaps in time or value, each (times, values)."""
    seen = np.isfinite(channel.values)
    time, values = channel.time[seen], channel.values[seen]
    if len(time) < 2:
        return
    cuts = np.flatnonzero(np.abs(np.diff(time) / channel.interval - 1) > 0.2) + 1
    for a, b in zip([0, *cuts.tolist()], [*cuts.tolist(), len(time)], strict=True):
        yield time[a:b], values[a:b]


def about_mean(values: Array) -> Array:
    """(n,) values less their mean."""
    return np.asarray(values - values.mean())


def about_trend(values: Array) -> Array:
    """(n,) what a cubic over the stretch leaves, with the variance of values that have no trend.

    The variance of white noise is made up for the four coefficients, of which the mean is one that
    estimates allow for themselves.

    >>> [abs(round(float(x), 9)) for x in about_trend(np.arange(6.0) ** 3)]
    [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    """
    n = len(values)
    if n <= TREND + 1:
        return about_mean(values)
    return _detrended(values, _trends(n)) * float(np.sqrt((n - 1) / (n - 1 - TREND)))


def _trends(n: int) -> Array:
    """(n, 4) orthonormal polynomials."""
    return np.asarray(np.linalg.qr(np.polynomial.legendre.legvander(
        np.linspace(-1.0, 1.0, n), TREND))[0])


def _detrended(values: Array, trends: Array) -> Array:
    return np.asarray(values - trends @ (trends.T @ values))


def _longest_quiet(values: Array, settings: QuietSettings) -> tuple[int, int] | None:
    n, loudest = len(values), float(np.var(values))
    length = n
    while length >= settings.shortest:
        step = max(length // 4, (n - length) // _POSITIONS, 1)
        starts = list(range(0, n - length + 1, step))
        if (n - length) % step:
            starts.append(n - length)  # the very end is often the calmest
        trends = _trends(length)
        windows = sorted(
            (float(np.var(_detrended(values[a : a + length], trends))), a) for a in starts)
        calm = [a for variance, a in windows[:_TESTED]
                if variance <= settings.calmest * windows[0][0]]
        quiet = [a for a in calm if _is_quiet(values[a : a + length], loudest, settings)]
        if quiet:
            a = quiet[len(quiet) // 2]
            return a, a + length
        length = int(length * 0.75)
    return None


def _is_quiet(values: Array, loudest: float, settings: QuietSettings) -> bool:
    """Whether a window holds nothing but a trend and stationary noise of short memory."""
    n = len(values)
    centred = about_trend(values)
    if not np.any(np.abs(centred) > _EXACT * np.max(np.abs(values))):
        return False  # a stuck sensor shows no noise at all
    # One real pole: an oscillation needs a pair of complex ones, and must not pass for noise.
    model = fit(centred, highest=1)
    if model.memory * settings.memories > n:
        return False
    # A motion can look like coloured noise: many samples tell, and what is far louder elsewhere.
    if len(model.coefficients) and (
            n < settings.low or float(np.var(centred)) > settings.quieter * loudest):
        return False
    if not (_flat_spectrum(innovations(centred, model), settings.chance)
            and _stationary(centred, model, settings.chance)
            and _one_trend(centred, settings)):
        return False
    # An oscillation or a drift is predictable over the whole stretch, noise is not.
    return fit(centred, settings.order).memory * settings.memories <= n


def _one_trend(centred: Array, settings: QuietSettings) -> bool:
    """Whether trends of the two halves leave as little less as noise allows (F test): power at the
    lowest frequencies against what the halves' noise has there, (σ_e / (1 - Σ a_k))².
    """
    from scipy.stats import f as f_distribution

    n = len(centred)
    halves = np.concatenate(
        [_detrended(part, _trends(len(part))) for part in np.array_split(centred, 2)])
    model = fit(halves * float(np.sqrt((n - 1) / (n - 2 * TREND - 2))), settings.order)
    lowest = (model.innovation / (1 - float(np.sum(model.coefficients)))) ** 2
    gained = float(centred @ centred - halves @ halves) / (TREND + 1)
    freedom = _independent(n, model) - 2 * (TREND + 1)
    return gained < lowest * float(
        f_distribution.ppf(1 - settings.chance, TREND + 1, max(freedom, 2.0)))


def _flat_spectrum(white: Array, chance: float) -> bool:
    """Whether a series may be white: no line, and no band that stands out.

    Fisher's test on the largest periodogram ordinate (R. A. Fisher, Proc. R. Soc. A 125, 1929)
    and Bartlett's on the cumulative periodogram, each at a rate of about `chance`.  The largest of
    m ordinates exceeds x means by e^-x·m; the largest distance times √m of the cumulative ones
    exceeds d by 2·e^(-2d²) (A. Kolmogorov, 1933), to two decimals.
    """
    m = (len(white) - 1) // 2
    power = np.abs(np.fft.rfft(white - white.mean())[1 : m + 1]) ** 2
    share = power / power.sum()
    line = m * float(share.max()) < float(np.log(m / chance))
    uneven = float(np.max(np.abs(np.cumsum(share) - np.arange(1, m + 1) / m)))
    return line and uneven * np.sqrt(m) < round(float(np.sqrt(-np.log(chance / 2) / 2)), 2)


def _stationary(centred: Array, model: AR, chance: float) -> bool:
    """Whether both halves spread alike (F test); correlated samples count for fewer."""
    from scipy.stats import f as f_distribution

    n = len(centred)
    freedom = max(_independent(n // 2, model), 2.0)
    ratio = float(np.var(centred[: n // 2])) / max(float(np.var(centred[n // 2 :])), 1e-300)
    high = float(f_distribution.ppf(1 - chance / 2, freedom, freedom))
    return 1 / high < ratio < high


def _independent(n: int, model: AR) -> float:
    """As how many independent samples n of an AR process count for its variance."""
    rho = autocorrelation(model.coefficients, min(_LAGS, n))
    return float(n / (1 + 2 * np.sum(rho[1:] ** 2)))
