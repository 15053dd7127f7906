"""Cutting, thinning and holding signals: functions of one channel that return another.

A channel whose `hold` is declared is an input that is known exactly between its samples; cutting
and thinning leave the function it stands for as it is.  A channel without `hold` is a series of
samples and nothing more.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from pikanid import errors
from pikanid.recording.channel import ROUNDING, Array, Channel, Hold


def held(time: ArrayLike, values: ArrayLike, at: ArrayLike, hold: Hold = "zero",
         side: str = "right") -> Array:
    """A sampled signal between its samples.

    Args:
        time: (N,) rising sample times [s].
        values: (N,) samples.
        at: Times [s], any shape.  Before the first and after the last sample the nearest sample
            is held.
        hold: ``"zero"``: the last sample counts until the next one; ``"first"``: straight lines;
            ``"cubic"``: the cubic spline through all samples.
        side: What a zero-order hold gives exactly at a sample: ``"right"`` the new value,
            ``"left"`` the old one.

    Returns:
        Array shaped as `at`.

    >>> held([0.0, 1.0, 2.0], [5.0, 7.0, 9.0], [0.5, 1.0]).tolist()
    [5.0, 7.0]
    >>> held([0.0, 1.0, 2.0], [5.0, 7.0, 9.0], [0.5, 1.0], "first").tolist()
    [6.0, 7.0]
    """
    t, y, wanted = (np.asarray(a, dtype=float) for a in (time, values, at))
    if hold == "first":
        return np.interp(wanted, t, y)
    if hold == "cubic" and len(y) > 1:
        from scipy.interpolate import CubicSpline

        return np.asarray(CubicSpline(t, y)(np.clip(wanted, t[0], t[-1])))
    before = np.searchsorted(t, wanted, side="right" if side == "right" else "left") - 1
    return y[np.clip(before, 0, len(y) - 1)]


def switches(channel: Channel) -> Array:
    """Times [s] at which a zero-order-held signal jumps.

    >>> switches(Channel("u", [0.0, 1.0, 2.0], [0.0, 1.0, 1.0])).tolist()
    [1.0]
    """
    return channel.time[1:][np.diff(channel.values) != 0]


def window(channel: Channel, start: float, stop: float, closed: bool = True) -> Channel:
    """The samples with start <= t <= stop (t < stop if not `closed`).

    A channel with a declared hold gets a sample at `start` if it has none there, so that the held
    input is known from the very beginning; where it is not held to order zero, also one at `stop`.
    """
    slack = ROUNDING * channel.interval if len(channel) > 1 else 0.0
    late = channel.time > start - slack
    early = channel.time < (stop + slack if closed else stop - slack)
    kept = _pick(channel, late & early)
    if channel.hold is None or len(channel) == 0:
        return kept
    ends = [start] if channel.hold == "zero" else [start, stop]
    for end in ends:
        inside = channel.time[0] < end < channel.time[-1]
        if inside and not np.any(np.abs(kept.time - end) <= slack):
            kept = _with_sample(kept, end, channel)
    return kept


def stride(channel: Channel, n: int) -> Channel:
    """Every n-th sample, starting with the first, unfiltered."""
    return _pick(channel, np.arange(len(channel)) % n == 0)


def survives_stride(channel: Channel, n: int) -> bool:
    """Whether every n-th sample still says what the held signal does between them.

    >>> two = Channel("u", [0.0, 1.0, 2.0, 3.0], [0.0, 0.0, 1.0, 1.0], hold="zero")
    >>> survives_stride(two, 2), survives_stride(two, 3)
    (True, False)
    """
    thin = stride(channel, n)
    again = held(thin.time, thin.values, channel.time, channel.hold or "zero")
    scale = float(np.max(np.abs(channel.values), initial=0.0))
    return bool(np.allclose(again, channel.values, rtol=0, atol=1e-12 * scale))


def filtered_stride(channel: Channel, n: int, where: str) -> Channel:
    """Every n-th sample after a zero-phase anti-alias filter.

    A linear-phase low-pass (Hamming window, 20·n + 1 taps, cut-off at the new Nyquist frequency)
    centred on each kept sample.  A scalar or per-sample sigma shrinks by the root of the sum of
    the squared taps, which is exact for white noise away from the ends.

    Raises:
        BadRecording: If the time is not uniform or samples are missing.
    """
    from scipy import signal

    if not channel.uniform or np.isnan(channel.values).any():
        raise errors.BadRecording(errors.filter_needs_uniform(where, channel.name))
    taps = signal.firwin(20 * n + 1, 1.0 / n, window="hamming")
    # Point reflection at the ends continues level and slope.
    longer = np.pad(channel.values, 10 * n, mode="reflect", reflect_type="odd")
    smooth = signal.oaconvolve(longer, taps, mode="valid")[::n]
    thin = stride(channel, n)
    gain = float(np.sqrt(np.sum(taps**2)) / np.sum(taps))
    sigma = None if thin.sigma is None else thin.sigma * gain
    return replace(thin, values=smooth, sigma=sigma)


def _pick(channel: Channel, mask: np.ndarray) -> Channel:
    sigma = channel.sigma
    return replace(channel, time=channel.time[mask], values=channel.values[mask],
                   sigma=sigma[mask] if isinstance(sigma, np.ndarray) else sigma)


def _with_sample(kept: Channel, at: float, whole: Channel) -> Channel:
    place = int(np.searchsorted(kept.time, at))
    value = held(whole.time, whole.values, at, whole.hold or "zero")
    sigma = kept.sigma
    if isinstance(sigma, np.ndarray):
        sigma = np.insert(sigma, place, held(whole.time, np.asarray(whole.sigma), at))
    return replace(kept, time=np.insert(kept.time, place, at),
                   values=np.insert(kept.values, place, value), sigma=sigma)
