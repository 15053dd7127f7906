"""The channels of a recording as the columns of one table, as files of rows hold them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from pikanid.recording.channel import Array, Channel


def columns(channels: Mapping[str, Channel]) -> Iterator[tuple[str, str, Array, Channel | None]]:
    """(name, unit, values, the channel if these are its values) of every column of the file."""
    time = next(iter(channels.values())).time
    yield "t", "s", time, None
    for name, ch in channels.items():
        if not np.array_equal(ch.time, time):
            yield f"t:{name}", "s", ch.time, None
        yield name, ch.unit, ch.values, ch
        if isinstance(ch.sigma, np.ndarray):
            yield f"sigma:{name}", ch.unit, ch.sigma, None
