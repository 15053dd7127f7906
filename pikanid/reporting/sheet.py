"""A table as data: shown on a screen, or written into a Markdown report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from pikanid.reporting.console import sentence

if TYPE_CHECKING:
    from rich.table import Table


@dataclass(frozen=True)
class Sheet:
    """Headers, rows of text, and the headers of the columns that are set to the right."""

    headers: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    numbers: tuple[str, ...] = ()

    def to_rich(self) -> Table:
        """For a screen."""
        from pikanid.reporting.tables import row, table

        made = table(*self.headers, numbers=self.numbers)
        for cells in self.rows:
            row(made, *cells)
        return made

    def to_markdown(self) -> str:
        """For a report.

        >>> print(Sheet(("a", "b"), (("x|y", "1"),), ("b",)).to_markdown())
        | a | b |
        | --- | ---: |
        | x\\|y | 1 |
        """
        ruler = ["---:" if h in self.numbers else "---" for h in self.headers]
        return "\n".join(_line(cells) for cells in [self.headers, ruler, *self.rows])


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(sentence(cell).replace("|", "\\|") for cell in cells) + " |"
