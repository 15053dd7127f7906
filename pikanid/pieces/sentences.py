"""Words as they stand in a sentence."""

from __future__ import annotations

from collections.abc import Sequence


def enumerated(names: Sequence[str]) -> str:
    """Names in a sentence; none of them is no words.

    >>> enumerated(["drag", "a delay", "a tilt"])
    'drag, a delay and a tilt'
    """
    *first, last = names or ("",)
    return f"{', '.join(first)} and {last}" if first else last
