"""The unit in which times read well."""

from __future__ import annotations

from collections.abc import Sequence

# Below hours, seconds are what recordings are made in.
UNITS = (("d", 86400.0, 4.0), ("h", 3600.0, 3.0))  # limit: name, seconds, and from how many on

SHORT = 0.05  # layout: of a unit: shorter windows are told in seconds


def time_unit(longest: float) -> tuple[float, str]:
    """Seconds that a unit for times up to the `longest` [s] holds, and its name.

    >>> time_unit(600.0), time_unit(80_000.0)
    ((1.0, 's'), (3600.0, 'h'))
    """
    return next(((size, name) for name, size, count in UNITS if longest >= count * size),
                (1.0, "s"))


def duration(seconds: float) -> str:
    """In words.

    >>> duration(0.25), duration(9000.0), duration(30_000.0)
    ('0.25 s', '9000 s', '8.3 h')
    """
    size, unit = time_unit(seconds)
    told = seconds / size
    return f"{told:.2g} {unit}" if told < 100 else f"{told:.0f} {unit}"


def spans(windows: Sequence[tuple[float, float]], shown: int) -> str:
    """The first windows of time [s] in words; empty where there are none.

    >>> spans([(0.0, 1.5), (3.0, 4.0)], 1), spans([(0.0, 20_000.0)], 1)
    ('0 to 1.5 s, and 1 more', '0 to 5.5556 h')
    """
    size, unit = time_unit(max((stop for _, stop in windows), default=0.0))
    if any(stop - start < SHORT * size for start, stop in windows[:shown]):
        size, unit = 1.0, "s"
    digits = "g" if size == 1 else ".5g"
    told = ", ".join(f"{start / size:{digits}} to {stop / size:{digits}} {unit}"
                     for start, stop in windows[:shown])
    more = len(windows) - shown
    return f"{told}, and {more} more" if more > 0 else told
