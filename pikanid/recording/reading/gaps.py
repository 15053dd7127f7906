"""Stretches of a recording without samples, between others at a steady rate."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pikanid import errors
from pikanid.recording.channel import Array, Channel

LONG = 10.0  # numerical: usual intervals from which on samples are missing
STEADY = 0.95  # numerical: share of the intervals that are about the usual one; else none is usual
ABOUT = 1.5  # numerical: usual intervals that still are about one


def note_gaps(channels: Sequence[Channel]) -> tuple[str, ...]:
    """A sentence for each time base that has such stretches.

    >>> t = np.delete(np.arange(100) / 10, np.s_[40:60])
    >>> note_gaps([Channel("y", t, t)])
    ('No samples of y between 3.9 s and 6 s: inputs are held or interpolated there.',)
    """
    bases: dict[bytes, list[Channel]] = {}
    for channel in channels:
        bases.setdefault(channel.time.tobytes(), []).append(channel)
    notes = []
    for alike in bases.values():
        if gaps := _gaps(alike[0].time):
            (start, stop), *shorter = gaps
            notes.append(errors.note_gap([c.name for c in alike], start, stop, len(shorter)))
    return tuple(notes)


def _gaps(t: Array) -> list[tuple[float, float]]:
    """Where they begin and end [s], the longest first."""
    steps = np.diff(t)
    usual = float(np.median(steps)) if len(steps) else 0.0
    if not len(steps) or np.mean(steps < ABOUT * usual) < STEADY:
        return []
    wide = np.flatnonzero(steps > LONG * usual)
    return [(float(t[k]), float(t[k + 1])) for k in wide[np.argsort(-steps[wide], kind="stable")]]
