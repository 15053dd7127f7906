"""A table as data: shown on a screen, on a page, in a notebook, or in a Markdown report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Sheet:
    """Headers, rows of text, and the headers of the columns that are set to the right."""

    headers: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    numbers: tuple[str, ...] = ()

    def without_constant(self, *headers: str) -> Sheet:
        """Without those of the named columns in which every row says the same.

        >>> Sheet(("a", "b"), (("x", "1"), ("x", "2")), ("b",)).without_constant("a", "b").headers
        ('b',)
        """
        keep = [k for k, h in enumerate(self.headers)
                if h not in headers or len({row[k] for row in self.rows}) > 1]
        return Sheet(tuple(self.headers[k] for k in keep),
                     tuple(tuple(row[k] for k in keep) for row in self.rows), self.numbers)

    def to_markdown(self) -> str:
        """For a report.

        >>> print(Sheet(("a", "b"), (("x|y", "1"),), ("b",)).to_markdown())
        | a | b |
        | --- | ---: |
        | x\\|y | 1 |
        """
        ruler = ["---:" if h in self.numbers else "---" for h in self.headers]
        return "\n".join(_line(cells) for cells in [self.headers, ruler, *self.rows])


def sentence(text: str) -> str:
    """Text on one line, without control characters that a file could smuggle into a terminal.

    >>> sentence("bad\\x1b[31m name\\nhere")
    'bad [31m name here'
    """
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(sentence(cell).replace("|", "\\|") for cell in cells) + " |"
