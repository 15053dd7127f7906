"""Samples that were left out as outliers, and what is said of them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import groupby

from pikanid.pieces.time_unit import time_unit

NAMED = 5  # layout: outliers whose times are told one by one
APART = 3  # layout: recordings that have a sentence each


@dataclass(frozen=True, order=True)
class LeftOut:
    """One sample: of which output and recording, when [s], and what it was."""

    output: str
    recording: str
    time: float
    value: float = field(default=math.nan, compare=False)


def left_out_sentences(found: Sequence[LeftOut], which: str = "") -> list[str]:
    """How many outliers were left out, of which recordings and outputs; of few also when.

    Args:
        found: In any order.
        which: Before "recording".

    >>> left_out_sentences([LeftOut("y", "run", 3.0), LeftOut("y", "run", 1.25)])
    ["Recording 'run': 2 outliers of 'y' left out, at 1.25 and 3 s."]
    >>> left_out_sentences([LeftOut("T", "week", 3 * 86400.0), LeftOut("T", "week", 5 * 86400.0)])
    ["Recording 'week': 2 outliers of 'T' left out, at 3 and 5 d."]
    """
    which = f"{which} recording".strip()
    return [line for output, each in groupby(sorted(found), lambda one: one.output)
            for line in _of_output(output, list(each), which)]


def _of_output(output: str, found: Sequence[LeftOut], which: str) -> Iterator[str]:
    times = {name: [one.time for one in each]
             for name, each in groupby(found, lambda one: one.recording)}
    if len(times) > APART:
        yield (f"{len(found)} outliers of '{output}' left out in {len(times)} "
               f"{which}s: {', '.join(f'{len(t)} in {n!r}' for n, t in times.items())}.")
        return
    for name, at in times.items():
        count = "1 outlier" if len(at) == 1 else f"{len(at)} outliers"
        size, unit = time_unit(at[-1])
        *before, last = (f"{t / size:.6g}" for t in at)
        when = (f", at {', '.join(before)}{' and ' if before else ''}{last} {unit}"
                if len(at) <= NAMED else f", between {before[0]} and {last} {unit}")
        yield f"{which.capitalize()} '{name}': {count} of '{output}' left out{when}."
