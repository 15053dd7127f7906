"""Recordings that are segments of one: what is seen of them is seen without a break."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pikanid.recording import Channel, Recording


def stretches(recordings: Sequence[Recording]) -> list[list[int]]:
    """Numbers of the recordings that are segments of the same one, in order; most are alone.

    >>> t = np.arange(8.0)
    >>> one = Recording.from_arrays(t, {"y": t})
    >>> pieces = [replace(one.window(a, a + 3), begins={"y_node": a}) for a in (0.0, 4.0)]
    >>> stretches([one, *pieces, one])
    [[0], [1, 2], [3]]
    """
    found: list[list[int]] = []
    for r, recording in enumerate(recordings):
        before = recordings[r - 1] if r else None
        if (before is not None and recording.begins and before.begins
                and recording.name == before.name
                and 0 <= recording.start - before.stop < 0.5 * (before.stop - before.start)):
            found[-1].append(r)
        else:
            found.append([r])
    return found


def as_one(pieces: Sequence[Recording]) -> Recording:
    """Segments put together again."""
    if len(pieces) == 1:
        return pieces[0]
    return pieces[0].with_channels(*(
        _joined([p[name] for p in pieces]) for name in pieces[0].names))


def _joined(parts: Sequence[Channel]) -> Channel:
    time = np.concatenate([c.time for c in parts])
    kept = np.diff(time, prepend=-np.inf) > 0  # an input ends where it goes on
    sigmas = [c.sigma for c in parts]
    sigma = sigmas[0] if sigmas[0] is None or np.ndim(sigmas[0]) == 0 else np.concatenate(
        [np.asarray(s) for s in sigmas])[kept]
    return replace(parts[0], time=time[kept], sigma=sigma,
                   values=np.concatenate([c.values for c in parts])[kept])
