"""What the neighbours of a sample do not tell of it: noise, where the signal is well sampled."""

from __future__ import annotations

import numpy as np

from pikanid.recording.channel import Array, Channel

_UNEVEN = 0.2  # numerical: of an interval, by which one between two samples may differ
_ENOUGH = 8  # limit: evenly sampled neighbourhoods, without which others count
_EXACT = 1e-12  # numerical: of the values, what rounding leaves of nothing
_FOURTH = np.array([1.0, -4.0, 6.0, -4.0, 1.0])  # definition: of a fourth difference
_LONGEST = 2.0  # numerical: times the usual length, as which four intervals may last


def beside_neighbours(channel: Channel) -> Array:
    """(m,) samples less the cubic through their four neighbours, scaled to the noise's deviation.

    Of an evenly sampled signal these are its fourth differences over √70.  Where there are hardly
    any even neighbourhoods the cubic takes the samples where they are (T. Gasser et al., Biometrika
    73, 1986, eq. 2.1, with four neighbours for two).

    >>> t = np.array([0.0, 0.7, 1.1, 2.4, 3.0, 3.3])
    >>> beside_neighbours(Channel("y", t, t**3 - t)).tolist()
    [0.0, 0.0]
    """
    seen = np.isfinite(channel.values)
    time, values = channel.time[seen], channel.values[seen]
    if len(time) < 5:
        return np.empty(0)
    at, y = (np.lib.stride_tricks.sliding_window_view(x, 5) for x in (time, values))
    even = np.all(np.abs(np.diff(at, axis=1) / channel.interval - 1) <= _UNEVEN, axis=1)
    lengths = at[:, 4] - at[:, 0]
    if np.sum(even) >= _ENOUGH:
        # intervals that are meant to be alike differ by rounding and jitter, which is no signal
        fourth = np.convolve(values, _FOURTH, "valid")
        return np.asarray(fourth[even] / np.sqrt(np.sum(_FOURTH**2)))
    use = lengths <= _LONGEST * np.median(lengths)
    weights = _at_middle(at[use])
    left = y[use][:, 2] - np.sum(weights * y[use][:, [0, 1, 3, 4]], axis=1)
    left /= np.sqrt(1 + np.sum(weights**2, axis=1))
    return np.where(np.abs(left) > _EXACT * np.max(np.abs(values)), left, 0.0)


def _at_middle(at: Array) -> Array:
    """(m, 4) weights of the cubic through four of five samples (m, 5) at the middle one."""
    middle, others = at[:, 2:3], at[:, [0, 1, 3, 4]]
    weights = np.ones_like(others)
    for j in range(4):
        for k in range(4):
            if k != j:
                weights[:, j] *= (middle[:, 0] - others[:, k]) / (others[:, j] - others[:, k])
    return weights
