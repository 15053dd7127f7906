"""A comparison of models as one self-contained page of HTML."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

from pikanid.figures import embedded
from pikanid.reporting.diagnosis_page import document
from pikanid.reporting.sheet import Sheet
from pikanid.reporting.validation_tables import pairs, scores

if TYPE_CHECKING:
    from pikanid.comparison import Validation

DPI = 110  # layout: pixels an inch


def page(found: Validation, title: str) -> str:
    """The page: the answer, the table, the picture, who is better than whom.

    Args:
        found: To show.
        title: Such as the names of the recordings.
    """
    return document(title, [
        f"<h1>How well is it predicted? {escape(title)}</h1>",
        f'<p class="verdict">{escape(found.sentence())}</p>',
        f"<p>{escape(str(found.protocol))}</p>", _table(scores(found)),
        embedded(found.plot(), "measured and predicted", DPI),
        "<h2>Who is better than whom</h2>" + _table(pairs(found)) if found.pairs else "",
        "".join(f"<p>{escape(note)}</p>" for note in found.notes)])


def _table(sheet: Sheet) -> str:
    head = "".join(f"<th>{escape(h)}</th>" for h in sheet.headers)
    body = "".join("<tr>" + "".join(f"<td>{escape(c)}</td>" for c in row) + "</tr>"
                   for row in sheet.rows)
    return f'<div class="wide"><table><tr>{head}</tr>{body}</table></div>'
