"""What the neighbours of a sample do not tell of it: noise, where the signal is well sampled."""

from __future__ import annotations

from typing import Any

import numpy as np

from pikanid.recording.channel import Array

_UNEVEN = 0.2  # numerical: of an interval, by which one is no whole number of usual ones
_GRID = 0.9  # numerical: share of the intervals that are whole numbers on an even grid
_SHORTEST = 1 / 3  # numerical: share of the neighbourhoods, the shortest, that tell of noise
_ENOUGH = 60  # numerical: as many in any case, where there are so many: fewer say little
_LEAST = 1e-3  # numerical: of a usual interval, as which a repeated time counts
LONGEST = 2.0  # numerical: times the usual length, as which one may last
_EXACT = 1e-12  # numerical: of the values, what rounding leaves of nothing


def beside_neighbours(time: Array, values: Array) -> Array:
    """(m,) samples less the cubic through their four neighbours, scaled to the noise's deviation.

    Of an evenly sampled signal these are its fourth differences over √70; elsewhere the cubic takes
    the samples where they are (T. Gasser et al., Biometrika 73, 1986, eq. 2.1, with four neighbours
    for two).  Of longer neighbourhoods, as beside gaps, a cubic knows less: the shortest count.

    Args:
        time: (N,), increasing.
        values: (N,) there; what is missing is left out.

    >>> t = np.array([0.0, 0.7, 1.1, 2.4, 3.0, 3.3])
    >>> beside_neighbours(t, t**3 - t).tolist()
    [0.0, 0.0]
    """
    seen = np.isfinite(values)
    time, values = time[seen], values[seen]
    if len(time) < 5:
        return np.empty(0)
    weights, lengths = neighbour_weights(time)
    use = are_short(lengths)
    y = np.lib.stride_tricks.sliding_window_view(values, 5)[use]
    left = np.sum(weights[use] * y, axis=1) / np.sqrt(np.sum(weights[use] ** 2, axis=1))
    return np.where(np.abs(left) > _EXACT * np.max(np.abs(values)), left, 0.0)


def are_short(lengths: Array) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """Which neighbourhoods (N,) tell of noise by their lengths (N,): longer ones, as beside gaps,
    leave a motion room.
    """
    wanted = min(max(int(_SHORTEST * len(lengths)), _ENOUGH), len(lengths)) - 1
    longest = min(float(np.partition(lengths, wanted)[wanted]), LONGEST * np.median(lengths))
    return np.asarray(lengths <= longest * (1 + 1e-9))


def neighbour_weights(time: Array) -> tuple[Array, Array]:
    """What takes the cubic through four samples from the one between them, at times (N,): weights
    (N - 4, 5), 1 in the middle, and lengths (N - 4,) in usual intervals.

    >>> weights, lengths = neighbour_weights(np.array([0.0, 1.0, 2.0, 3.0, 4.0]))
    >>> (6 * weights).round(9).tolist(), lengths.tolist()
    ([[1.0, -4.0, 6.0, -4.0, 1.0]], [4.0])
    """
    at = np.lib.stride_tricks.sliding_window_view(_places(time), 5)
    weights = np.ones(at.shape)
    others = (0, 1, 3, 4)
    for j in others:
        for k in others:
            if k != j:
                weights[:, j] *= (at[:, 2] - at[:, k]) / (at[:, j] - at[:, k])
        weights[:, j] *= -1.0
    return weights, at[:, 4] - at[:, 0]


def _places(time: Array) -> Array:
    """Times (N,) in usual intervals: intervals that are meant to be alike differ by rounding and
    jitter, which is no signal.
    """
    steps = np.diff(time)
    steps = steps / max(float(np.median(steps)), 1e-300)
    whole = np.maximum(np.rint(steps), 1.0)
    near = np.abs(steps - whole) <= _UNEVEN
    if np.mean(near) >= _GRID:
        steps = np.where(near, whole, steps)
    return np.concatenate([[0.0], np.cumsum(np.maximum(steps, _LEAST))])
