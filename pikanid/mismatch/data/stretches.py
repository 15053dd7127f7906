"""Segments of one recording put together again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pikanid.recording import Channel, Recording


def as_one(pieces: Sequence[Recording]) -> Recording:
    """The recording that segments are of, in the order of time; of one, that.

    >>> t = np.arange(8.0)
    >>> whole = Recording.from_arrays(t, {"y": t})
    >>> as_one([whole.window(0, 3), whole.window(4, 7)])["y"].values
    array([0., 1., 2., 3., 4., 5., 6., 7.])
    """
    if len(pieces) == 1:
        return pieces[0]
    return pieces[0].with_channels(*(
        _joined([p[name] for p in pieces]) for name in pieces[0].names))


def once(time: np.ndarray) -> np.ndarray:
    """Which instants (N,) of segments, one after the other, are later than all before: inputs of a
    segment begin where those of the one before end, or earlier.

    >>> once(np.array([0.0, 1, 2, 1, 2, 3]))
    array([ True,  True,  True, False, False,  True])
    """
    return np.asarray(np.diff(np.maximum.accumulate(time), prepend=-np.inf) > 0)


def _joined(parts: Sequence[Channel]) -> Channel:
    time = np.concatenate([c.time for c in parts])
    kept = once(time)
    sigmas = [c.sigma for c in parts]
    sigma = sigmas[0] if sigmas[0] is None or np.ndim(sigmas[0]) == 0 else np.concatenate(
        [np.asarray(s) for s in sigmas])[kept]
    return replace(parts[0], time=time[kept], sigma=sigma,
                   values=np.concatenate([c.values for c in parts])[kept])
