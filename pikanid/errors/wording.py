"""How what others wrote stands in a sentence of ours: short, on one line, printable."""

from __future__ import annotations

import functools
import reprlib
from collections.abc import Callable, Iterable, Sequence
from typing import Any

LONGEST_PART = 300  # limit: characters that one value may take in a sentence


def listed(names: Iterable[str]) -> str:
    """Names with commas between them, the first 41 at most."""
    every = list(names)
    more = [f"... ({len(every)} in all)"] if len(every) > 41 else []  # 41: `brief` has said so
    return ", ".join([short(str(name), 60) for name in every[:41 - len(more)]] + more) or "(none)"


def did_you_mean(close: Sequence[str]) -> str:
    """The nearest known name as a question, or nothing."""
    return f" Did you mean '{close[0]}'?" if close else ""


def short(text: str, limit: int = 80) -> str:
    """The text, cut off behind `limit` characters."""
    return text if len(text) <= limit else text[: limit - 1] + "…"


def brief(value: Any) -> Any:
    """A value as it may stand in a sentence: of one line, printable, and not too long.

    A file may hold a formula of a million characters, a list of a million numbers, tables nested
    a thousand deep, an integer of a thousand digits, or characters that steer a terminal.

    >>> print(brief("a\\nb" + 400 * "x")[:6], len(brief(400 * "x")))
    a bxxx 300
    >>> brief(7), brief([1, "k"]), brief(10**400)
    (7, [1, 'k'], an integer of about 401 digits)
    """
    if isinstance(value, str):
        line = value if value.isprintable() else _printable(value[: 2 * LONGEST_PART])
        return short(line, LONGEST_PART)
    if isinstance(value, int) and not isinstance(value, bool) and abs(value) >= 10**18:
        return _Huge(value)
    if isinstance(value, list | tuple) and all(isinstance(v, str | int | float) for v in value):
        kept = [brief(v) if not isinstance(v, str) else short(brief(v), 60) for v in value[:40]]
        while len(kept) > 1 and sum(len(str(v)) for v in kept) > 3 * LONGEST_PART:
            kept = kept[:-1]
        more = [f"... ({len(value)} in all)"] if len(value) > len(kept) else []
        return tuple(kept + more) if isinstance(value, tuple) else kept + more
    if isinstance(value, list | tuple | dict | set | frozenset):
        return _AsIs(short(_printable(_NESTED.repr(value)), LONGEST_PART))
    return value


def _printable(text: str) -> str:
    plain = " ".join(text.splitlines())
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in plain)


class _AsIs(str):
    """A text that has its own quotes."""

    def __repr__(self) -> str:
        return str(self)


class _Huge(float):
    """An integer that Python would print with all of its digits, or refuse to."""

    def __new__(cls, value: int) -> _Huge:
        return super().__new__(cls, "inf" if value > 0 else "-inf")

    def __init__(self, value: int) -> None:
        self.digits = int(value.bit_length() * 0.30103) + 1

    def __repr__(self) -> str:
        return f"an integer of about {self.digits} digits"

    __str__ = __repr__

    def __format__(self, form: str) -> str:
        return repr(self)


class _Nested(reprlib.Repr):
    def repr_int(self, x: int, level: int) -> str:
        return repr(brief(x))


_NESTED = _Nested()


def made_brief(sentence: Callable[..., str]) -> Callable[..., str]:
    """The sentence with every value that it is given made `brief`."""

    @functools.wraps(sentence)
    def told(*args: Any, **named: Any) -> str:
        return sentence(*map(brief, args), **{name: brief(v) for name, v in named.items()})

    return told


def of_all(share: float) -> str:
    """A share in percent, or that it is no less than all.

    >>> of_all(0.123), of_all(389.0)
    ('12 %', 'all of it')
    """
    return f"{100 * share:.2g} %" if share < 1 else "all of it"
