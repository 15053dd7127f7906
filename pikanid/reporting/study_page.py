"""The report of the study as one self-contained page of HTML."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING

from pikanid.pieces.html import drawn, tabled, text
from pikanid.pieces.sheet import Sheet
from pikanid.reporting.document import document

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Heading:
    """A heading; level 1 is the title."""

    level: int
    text: str


@dataclass(frozen=True)
class Picture:
    """A figure by its name, and what it shows."""

    name: str
    caption: str


@dataclass(frozen=True)
class Printed:
    """Lines as a terminal shows them."""

    text: str


Part = Heading | Picture | Printed | Sheet | str  # text: a paragraph, or lines of a list


def page(parts: Sequence[Part], figures: Mapping[str, Figure],
         narrow: Mapping[str, Figure] = MappingProxyType({})) -> str:
    """The page of a report's parts, with the figures that there are; those for a phone `narrow`.

    >>> "<h1>A</h1>\\n<p>See <code>b</code>.</p>" in page([Heading(1, "A"), "See `b`."], {})
    True
    """
    title = next((p.text for p in parts if isinstance(p, Heading)), "Report")
    return document(title, [_html(part, figures, narrow) for part in parts])


def _html(part: Part, figures: Mapping[str, Figure], narrow: Mapping[str, Figure]) -> str:
    if isinstance(part, Sheet):
        return tabled(part)
    if isinstance(part, Heading):
        return f"<h{part.level}>{text(part.text)}</h{part.level}>"
    if isinstance(part, Printed):
        return f"<pre>{text(part.text)}</pre>"
    if isinstance(part, Picture):
        return (drawn(figures[part.name], part.caption, narrow.get(part.name))
                + f"<p class=small>{text(part.caption)}"
                "</p>") if part.name in figures else ""
    if part.startswith("- "):
        lines = part.removeprefix("- ").split("\n- ")
        return "<ul>" + "".join(f"<li>{_line(line)}</li>" for line in lines) + "</ul>"
    return f"<p>{_line(part)}</p>"


def _line(plain: str) -> str:
    """Text in which backquotes mark code."""
    return re.sub(r"`([^`]*)`", r"<code>\1</code>", text(plain))
