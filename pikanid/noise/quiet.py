"""Stretches of a recording in which nothing but noise can be seen."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from pikanid.noise.autoregressive import AR, fit, innovations
from pikanid.noise.settings import USUAL, QuietSettings
from pikanid.recording.channel import Array, Channel

_POSITIONS = 200  # limit: windows tried of each length


def find_quiet(channel: Channel, settings: QuietSettings = USUAL
               ) -> tuple[float, float] | None:
    """The longest stretch [s] in which nothing but noise can be seen, or None.

    A stretch counts as quiet if it is among the calmest of the recording, at most an AR(1)
    process of short memory describes it (what that leaves has a flat spectrum), and its halves
    spread alike.  Looked for in evenly sampled parts without gaps.

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
                  settings: QuietSettings = USUAL) -> tuple[float, float]:
    """The longest part of a stretch [s] in which no input leaves the value that it has for most of
    it: what is driven at random can look like coloured noise.  The stretch where that is too short.
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
    return (float(t[first]), float(t[last])) if enough else (start, stop)


def even_parts(channel: Channel) -> Iterator[tuple[Array, Array]]:
    """Stretches without gaps in time or value, each (times, values)."""
    seen = np.isfinite(channel.values)
    time, values = channel.time[seen], channel.values[seen]
    if len(time) < 2:
        return
    cuts = np.flatnonzero(np.abs(np.diff(time) / channel.interval - 1) > 0.2) + 1
    for a, b in zip([0, *cuts.tolist()], [*cuts.tolist(), len(time)], strict=True):
        yield time[a:b], values[a:b]


def _longest_quiet(values: Array, settings: QuietSettings) -> tuple[int, int] | None:
    n, loudest = len(values), float(np.var(values))
    length = n
    while length >= settings.shortest:
        step = max(length // 4, (n - length) // _POSITIONS, 1)
        starts = list(range(0, n - length + 1, step))
        if (n - length) % step:
            starts.append(n - length)  # the very end is often the calmest
        windows = sorted((float(np.var(values[a : a + length])), a) for a in starts)
        calmest = windows[0][0]
        for variance, a in windows[:20]:
            if variance <= settings.calmest * calmest and _is_quiet(
                    values[a : a + length], loudest, settings):
                return a, a + length
        length = int(length * 0.75)
    return None


def _is_quiet(values: Array, loudest: float, settings: QuietSettings) -> bool:
    """Whether a window holds nothing but stationary noise of short memory."""
    n = len(values)
    centred = values - values.mean()
    if not np.any(centred):
        return False  # a stuck sensor shows no noise at all
    # One real pole: an oscillation needs a pair of complex ones, and must not pass for noise.
    model = fit(centred, highest=1)
    if model.memory * settings.memories > n:
        return False
    # A busy signal can look like coloured noise: it must at least be much louder elsewhere.
    if len(model.coefficients) and float(np.var(centred)) > settings.quieter * loudest:
        return False
    if not (_flat_spectrum(innovations(centred, model), settings.chance)
            and _stationary(centred, model, settings.chance)):
        return False
    # An oscillation or a drift is predictable over the whole stretch, noise is not.
    return fit(centred, settings.order).memory * settings.memories <= n


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
    freedom = max(n / (2 * (1 + 2 * model.memory)), 2.0)
    ratio = float(np.var(centred[: n // 2])) / max(float(np.var(centred[n // 2 :])), 1e-300)
    high = float(f_distribution.ppf(1 - chance / 2, freedom, freedom))
    return 1 / high < ratio < high
