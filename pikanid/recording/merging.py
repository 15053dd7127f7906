"""The clocks of recordings that were made together: by how much each began after the first."""

from __future__ import annotations

from collections.abc import Sequence

from pikanid import errors

Span = tuple[str, float, float, float | None]


def delays(spans: Sequence[Span],
           by_date: bool) -> tuple[list[float], float | None, tuple[str, ...]]:
    """Delays [s] to be added to times, POSIX time [s] of the common zero, and what was decided.

    Args:
        spans: (name, first time [s], last time [s], POSIX time of its zero or None) of each.
        by_date: Whether dates count, where all of them are known.

    Raises:
        BadRecording: If by their dates two of them have no time in common.

    >>> delays([("a", 0.0, 9.0, 100.0), ("b", 0.0, 9.0, 102.5)], True)
    ([0.0, 2.5], 100.0, ("Recording 'b' begins 2.5 s after 'a' by the dates in their files.",))
    >>> delays([("a", 0.0, 9.0, None), ("b", 0.0, 9.0, 102.5)], True)[:2]
    ([0.0, 0.0], None)
    """
    began = [b for *_, b in spans if b is not None]
    if not by_date or len(began) < len(spans) or not spans:
        told = 0 < len(began) < len(spans)
        undated = [name for name, _, _, b in spans if b is None]
        return [0.0] * len(spans), None, (errors.note_undated(undated),) if told else ()
    zero = min(began)
    late = [b - zero for b in began]
    first = spans[late.index(0.0)][0]
    begin = max(start + d for (_, start, _, _), d in zip(spans, late, strict=True))
    end = min(stop + d for (_, _, stop, _), d in zip(spans, late, strict=True))
    if begin > end:
        raise errors.BadRecording(errors.recorded_apart([name for name, *_ in spans], begin - end))
    notes = tuple(errors.note_begins_later(name, first, d)
                  for (name, *_), d in zip(spans, late, strict=True) if d)
    return late, zero, notes
