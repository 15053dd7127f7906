"""What a file holds, taken apart entry by entry: type and size of each are known before its use.

An `Entry` is a value with the place where it stands and the error that a wrong one raises.  Every
loader of a file of ours (models, estimates, networks, truths, diagnoses) reads through it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from numbers import Integral, Real
from typing import TYPE_CHECKING, Any

from pikanid import errors

if TYPE_CHECKING:
    import numpy as np

LONGEST_TEXT = 10_000  # limit: characters of one text
MOST_ENTRIES = 100_000  # limit: of one list or table
_CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\ud800-\udfff]")
DEEPEST = 6  # limit: tables within tables, where any content is allowed


@dataclass(frozen=True)
class Entry:
    """A value of a file.

    Attributes:
        value: As the parser of the file's format made it.
        where: What it is, to begin a sentence with: ``"The guess of parameter 'k'"``.
        wrong: Makes the exception from a sentence.
    """

    value: Any
    where: str
    wrong: Callable[[str], errors.PikanidError]

    def fail(self, wanted: str) -> errors.PikanidError:
        """The exception that says what was wanted instead."""
        return self.wrong(errors.bad_value(self.where, self.value, wanted))

    def called(self, where: str) -> Entry:
        """The same under a name of its own."""
        return Entry(self.value, where, self.wrong)

    # --- single values ---------------------------------------------------------------------------

    def number(self, low: float = -math.inf, high: float = math.inf, *, finite: bool = True,
               nan: bool = False) -> float:
        """A real number in [low, high], finite unless told otherwise.

        >>> Entry(3, "x", errors.BadSetting).number(low=0.0)
        3.0
        """
        what = "a number, and finite" if finite else "a number"
        if low > -math.inf or high < math.inf:
            what += f", from {low:g} to {high:g}"
        if not is_number(self.value):
            raise self.fail(what)
        try:
            value = float(self.value)
        except OverflowError:
            raise self.fail(what) from None
        if math.isnan(value):
            if nan:
                return value
            raise self.fail(what)
        if not low <= value <= high or (finite and math.isinf(value)):
            raise self.fail(what)
        return value

    def integer(self, low: int, high: int) -> int:
        """A whole number in [low, high]."""
        if not is_integer(self.value) or not low <= self.value <= high:
            raise self.fail(f"an integer from {low} to {high}")
        return int(self.value)

    def flag(self) -> bool:
        """True or false."""
        if not isinstance(self.value, bool):
            raise self.fail("true or false")
        return self.value

    def text(self, choices: Sequence[str] = (), longest: int = LONGEST_TEXT) -> str:
        """A text, one of `choices` if there are any; without characters that steer a terminal."""
        if choices:
            if not isinstance(self.value, str) or self.value not in choices:
                raise self.fail(" or ".join(map(repr, choices)))
        elif not isinstance(self.value, str):
            raise self.fail("text in quotes")
        elif len(self.value) > longest:
            raise self.fail(f"a text of at most {longest} characters")
        elif _CONTROL.search(self.value):
            raise self.fail("text without control characters")
        return str(self.value)

    # --- what holds others -----------------------------------------------------------------------

    def table(self, required: Sequence[str] = (), optional: Sequence[str] | None = (),
              most: int = MOST_ENTRIES) -> dict[str, Entry]:
        """The entries of a table by their keys; keys beyond `optional` are fine if that is None."""
        if not isinstance(self.value, Mapping):
            raise self.fail("a table")
        if len(self.value) > most:
            raise self.wrong(errors.too_many_entries(self.where, len(self.value), most))
        for key in self.value:
            if not isinstance(key, str) or len(key) > LONGEST_TEXT:
                raise Entry(key, f"A key of {self.where}", self.wrong).fail("a short text")
        if missing := [key for key in required if key not in self.value]:
            raise self.wrong(errors.entry_lacks(self.where, missing))
        if optional is not None and (
                extra := [k for k in self.value if k not in required and k not in optional]):
            raise self.wrong(errors.entry_extra(self.where, extra, [*required, *optional]))
        return {key: Entry(value, f"{self.where}, {key}", self.wrong)
                for key, value in self.value.items()}

    def items(self, least: int = 0, most: int = MOST_ENTRIES) -> list[Entry]:
        """The entries of a list."""
        if not isinstance(self.value, list | tuple) or len(self.value) < least:
            raise self.fail(f"a list of {least} or more" if least else "a list")
        if len(self.value) > most:
            raise self.wrong(errors.too_many_entries(self.where, len(self.value), most))
        return [Entry(value, f"{self.where}[{k}]", self.wrong)
                for k, value in enumerate(self.value)]

    def pair(self) -> tuple[Entry, Entry]:
        """The entries of a list of two."""
        if not isinstance(self.value, list | tuple) or len(self.value) != 2:
            raise self.fail("a list of two")
        first, second = self.items()
        return first, second

    def array(self, *shape: int | None) -> np.ndarray:
        """Nested lists of numbers as an array of this shape, None for a length left open.

        NaN and infinite values pass: in estimates they say that something is not known.

        >>> Entry([[1, 2.5]], "x", errors.BadSetting).array(None, 2)
        array([[1. , 2.5]])
        """
        import numpy as np

        wanted = f"numbers of shape ({', '.join('n' if n is None else str(n) for n in shape)})"
        level, found = [self.value], []
        for n in shape:
            if not all(isinstance(row, list) for row in level):
                raise self.fail(wanted)
            lengths = {len(row) for row in level}
            length = lengths.pop() if lengths else n or 0
            if lengths or (n is not None and length != n):
                raise self.fail(wanted)
            found.append(length)
            level = list(chain.from_iterable(level))
        if not {type(v) for v in level} <= {int, float}:
            raise self.fail(wanted)
        try:
            return np.array(level, float).reshape(found)
        except OverflowError:
            raise self.fail(wanted) from None

    def plain(self, depth: int = DEEPEST) -> Any:
        """Any content of tables, lists, texts, numbers and flags, not nested deeper than `depth`.

        It is for what nothing computes with, such as the options that made an estimate.
        """
        if depth < 0:
            raise self.wrong(errors.entry_too_deep(self.where))
        if isinstance(self.value, Mapping):
            return {k: e.plain(depth - 1) for k, e in self.table(optional=None).items()}
        if isinstance(self.value, list | tuple):
            return [e.plain(depth - 1) for e in self.items()]
        if self.value is None or isinstance(self.value, bool):
            return self.value
        if isinstance(self.value, str):
            return self.text()
        if isinstance(self.value, int):
            return self.integer(-(10**40), 10**40)
        self.number(finite=False, nan=True)
        return self.value


def is_number(value: object) -> bool:
    """Whether it is a real number, as no text, flag or table is.

    >>> is_number(1.5), is_number(True), is_number("1")
    (True, False, False)
    """
    return isinstance(value, Real) and not isinstance(value, bool)


def is_integer(value: object) -> bool:
    """Whether it is a whole number, of NumPy as well.

    >>> is_integer(3), is_integer(True), is_integer(3.0)
    (True, False, False)
    """
    return not isinstance(value, bool) and isinstance(value, Integral)
