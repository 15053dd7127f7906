"""Bringing a signal and the motion that causes it to one clock.

A camera and a robot often start by hand, so that one record lags behind the other by an unknown
time.  Fitting that time together with a model would let a wrong model hide in it; here it is read
from the records alone.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pikanid import errors
from pikanid.recording.channel import Array, Channel
from pikanid.recording.recording import Recording


def energy_delay(recording: Recording, signal: str, motion: Sequence[Sequence[str]],
                 step: float | None = None) -> float:
    """How far a signal lags behind the motion that causes it [s], by the energies of both.

    The delay is where the cross-correlation ∫ E(t) y²(t + τ) dt of the motion's energy E with that
    of the signal is largest; the signal has to cover the whole motion.  Channels of one unit form a
    group (the components of an acceleration, the angles of a tilt).  Every group counts for the
    same: E = Σ_groups |u_g|² / ∫|u_g|² dt.  So no model takes part, nor the sign or the size of any
    answer.  The less the energy of the signal resembles E, the less exact the delay is: off by a
    part of a lobe of E where the signal answers to one of several motions only.  The signal is
    measured from its median: at rest for most of its time.

    Args:
        recording: With the signal and the channels of the motion, which starts and ends at rest.
        signal: Name of the channel that lags.
        motion: Names of the channels that are zero at rest, in groups; a group without any motion
            is left out.
        step: Resolution [s]; by default the finest interval of the motion.

    Raises:
        BadRecording: A channel is missing or unusable, nothing moves, or the signal is too short.

    >>> t = np.arange(0.0, 4.0, 0.01)
    >>> bump = lambda at: np.exp(-0.5 * ((t - at) / 0.1) ** 2)
    >>> rec = Recording.from_arrays(t, {"a": bump(1.0), "y": 3 * bump(2.5)})
    >>> moved = rec.with_channels(rec.window(0, 2)["a"])
    >>> round(energy_delay(moved, "y", [["a"]]), 2)
    1.5
    """
    from scipy.signal import correlate

    seen = recording.as_output(signal)
    groups = [[recording.as_input(name) for name in group] for group in motion]
    flat = [channel for group in groups for channel in group]
    step = step or min((channel.interval for channel in flat), default=np.nan)
    begin, end = (f(float(c.time[k]) for c in flat) for f, k in ((min, 0), (max, -1)))
    t = np.arange(begin, end, step)
    energy = sum((_share(group, t) for group in groups), np.zeros(len(t)))
    good = np.isfinite(seen.values)
    time, y = seen.time[good], seen.values[good]
    late = np.arange(time[0], time[-1], step)
    if not energy.any():
        raise errors.BadRecording(errors.nothing_moves(recording.name, [c.name for c in flat]))
    if len(late) < len(t):
        raise errors.BadRecording(errors.signal_short(recording.name, signal, time[-1] - time[0],
                                                      end - begin))
    heard = np.interp(late, time, (y - np.median(y)) ** 2)
    best = int(np.argmax(correlate(heard, energy, mode="valid")))
    return float(late[best] - t[0])


def _share(group: Sequence[Channel], t: Array) -> Array:
    """|u|² (N,) of a group of channels at times t, as shares of their sum."""
    power = sum((np.interp(t, c.time, c.values) ** 2 for c in group), np.zeros(len(t)))
    total = float(np.sum(power))
    return np.asarray(power / total if total > 0 else power)


def moving(recording: Recording, names: Sequence[str], share: float = 1e-4) -> tuple[float, float]:
    """First and last time [s] at which any of these channels is neither where it began nor where
    it ended.

    Args:
        recording: With the channels.
        names: Of positions or angles.
        share: Of its range that a channel must have moved by.

    Raises:
        BadRecording: A channel is missing or unusable, or nothing moves.

    >>> rec = Recording.from_arrays([0, 1, 2, 3, 4], {"x": [0.0, 0.0, 1.0, 2.0, 2.0]})
    >>> moving(rec, ["x"])
    (1.0, 3.0)
    """
    spans = []
    for name in names:
        c = recording.as_input(name)
        least = share * float(np.ptp(c.values))
        left = np.flatnonzero(np.abs(c.values - c.values[0]) > least)
        coming = np.flatnonzero(np.abs(c.values - c.values[-1]) > least)
        if least > 0:
            # the last sample at rest before, the first one at rest after
            spans.append((c.time[max(left[0] - 1, 0)], c.time[min(coming[-1] + 1, len(c) - 1)]))
    if not spans:
        raise errors.BadRecording(errors.nothing_moves(recording.name, names))
    return float(min(a for a, _ in spans)), float(max(b for _, b in spans))
