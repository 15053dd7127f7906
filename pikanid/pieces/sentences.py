"""Words as they stand in a sentence."""

from __future__ import annotations

from collections.abc import Sequence

LEAST_P = 1e-12  # layout: p-values below are told as that: of such tails nobody has seen much


def enumerated(names: Sequence[str]) -> str:
    """Names in a sentence; none of them is no words.

    >>> enumerated(["drag", "a delay", "a tilt"])
    'drag, a delay and a tilt'
    """
    *first, last = names or ("",)
    return f"{', '.join(first)} and {last}" if first else last


def p_text(p: float, digits: int = 2) -> str:
    """A p-value in words: below some size only that it is.

    >>> p_text(0.0312), p_text(2e-300)
    ('p = 0.031', 'p < 1e-12')
    """
    return f"p < {LEAST_P:g}" if p < LEAST_P else f"p = {p:.{digits}g}"
