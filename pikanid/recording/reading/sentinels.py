"""Numbers that loggers write where a reading is missing: -9999, 999.99, the end of a range."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np

from pikanid import errors
from pikanid.recording.channel import Channel

NINES = re.compile(r"-?9{3,}(\.0|\.9+)?")  # definition: the customary ones, as they are printed
ENDS = {-(2.0**15), 2.0**15 - 1, 2.0**16 - 1, -(2.0**31), 2.0**31 - 1}  # definition: of integers
DIGITS = (".12", ".6")  # numerical: of double and of single precision
BEYOND = 3.0  # limit: ranges of all other samples, and sizes, that such a number lies beyond them
FEWEST = 3  # limit: other values; of fewer, it is one of the levels that a signal has


def without_sentinels(channel: Channel) -> tuple[Channel, str]:
    """The channel without such numbers, and a sentence that tells of them, or an empty one.

    Only a customary number counts, and only one that is far beyond every other sample: least
    squares would follow nothing else.

    >>> t = np.arange(6.0)
    >>> short, note = without_sentinels(Channel("y", t, [1.1, -9999, 1.3, 1.2, -9999, 0.9]))
    >>> short.values.tolist(), note
    ([1.1, nan, 1.3, 1.2, nan, 0.9], "2 samples of 'y' are -9999 and read as missing.")
    """
    values = channel.values
    known = values[np.isfinite(values)]
    found = [float(v) for v in np.unique(known) if float(v) in ENDS or any(
        NINES.fullmatch(f"{v:{digits}g}") for digits in DIGITS)]
    others = known[~np.isin(known, found)]
    if not found or len(np.unique(others)) < FEWEST:
        return channel, ""
    low, high = float(np.min(others)), float(np.max(others))
    far = BEYOND * max(high - low, abs(low), abs(high))
    gone = [v for v in found if max(low - v, v - high) > far]
    if not gone:
        return channel, ""
    at = np.isin(values, gone)
    return (replace(channel, values=np.where(at, np.nan, values)),
            errors.note_sentinels(channel.name, gone, int(np.sum(at))))
