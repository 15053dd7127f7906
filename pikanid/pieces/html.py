"""Pieces of HTML, the same on every page and in notebooks: text, tables, figures, equations."""

from __future__ import annotations

import base64
import re
from html import escape
from typing import TYPE_CHECKING

from pikanid.figures import POWERS, image

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from pikanid.pieces.sheet import Sheet

NUMBER = re.compile(r"(?<![\w.])(-?\d+(?:\.\d+)?)e([+-]\d+)(?![\w.])")
MINUS = re.compile(r"(?<![\w)\]-])-(?=[\w(.])")  # lines are not broken after it, unlike a hyphen
FITS = 34  # layout: characters of a row that a phone shows side by side
CARDS = 14  # layout: rows that a phone shows one below the other; more of them are scrolled
SHORT = 24  # layout: characters of a cell that is not broken


def text(plain: str) -> str:
    """Text as HTML, with numbers as they are printed in books.

    >>> text("p = 2e-05 < 1, not x1e-05"), text("Bouc-Wen (-c*v)")
    ('p = 2×10⁻⁵ &lt; 1, not x1e-05', 'Bouc-Wen (−c*v)')
    """
    return escape(MINUS.sub("−", NUMBER.sub(_power, plain)))


def _power(found: re.Match[str]) -> str:
    mantissa = "" if found[1] in ("1", "1.0") else f"{found[1]}×"
    return f"{mantissa}10{str(int(found[2])).translate(POWERS)}"


def tabled(sheet: Sheet, caption: str = "") -> str:
    """A table.  Wider than a phone, its rows are shown as cards there, many rows are scrolled."""
    columns = list(zip(sheet.headers, *sheet.rows, strict=True))
    width = sum(max(map(len, column)) for column in columns)
    cards = " cards" if width > FITS and len(sheet.rows) <= CARDS else ""
    head = "".join(f"<th{_kind(h, h in sheet.numbers)}>{text(h)}</th>" for h in sheet.headers)
    body = "".join("<tr>" + "".join(
        f'<td{_kind(c, h in sheet.numbers)} data-label="{escape(h)}">{text(c)}</td>'
        for h, c in zip(sheet.headers, row, strict=True)) + "</tr>" for row in sheet.rows)
    named = f"<caption>{text(caption)}</caption>" if caption else ""
    return (f'<div class="wide{cards}"><table>{named}<thead><tr>{head}</tr></thead>'
            f"<tbody>{body}</tbody></table></div>")


def _kind(cell: str, number: bool) -> str:
    kinds = [*(["number"] if number else []), *(["whole"] if len(cell) <= SHORT else [])]
    return f' class="{" ".join(kinds)}"' if kinds else ""


def drawn(figure: Figure, shows: str, narrow: Figure | None = None) -> str:
    """A figure in vectors, on the colour of the page.

    Args:
        figure: For desktops and print.
        shows: What a reader who cannot see it is told.
        narrow: The same for a phone; without it, a phone scrolls the figure sideways.
    """
    phone = "" if narrow is None else (
        f'<source media="screen and (max-width: 40rem)" srcset="{_source(narrow)}">')
    return (f'<div class="figure{"" if narrow is None else " fits"}"><picture>{phone}'
            f'<img alt="{escape(shows)}" src="{_source(figure)}"></picture></div>')


def _source(figure: Figure) -> str:
    content = image(figure, ".svg", transparent=True)
    return f"data:image/svg+xml;base64,{base64.b64encode(content).decode()}"
