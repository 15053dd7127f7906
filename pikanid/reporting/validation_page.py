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

MOST = 6  # layout: figures of residuals
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
        _residuals(found), "".join(f"<p>{escape(note)}</p>" for note in found.notes)])


def _residuals(found: Validation) -> str:
    """What every model leaves, in sentences; in pictures what the best of them does."""
    said = "".join(f"<li>{escape(sentence)}</li>" for sentence, _ in found.left())
    best = next((name for name in found.ranking if found.residuals.get(name)), None)
    if best is None:
        return ""
    figures = "".join(embedded(a.plot(), f"residual of {escape(a.output)}", DPI)
                      for a in found.residuals[best][:MOST])
    return f"<h2>What is left</h2><ul>{said}</ul>{figures}"


def _table(sheet: Sheet) -> str:
    head = "".join(f"<th>{escape(h)}</th>" for h in sheet.headers)
    body = "".join("<tr>" + "".join(f"<td>{escape(c)}</td>" for c in row) + "</tr>"
                   for row in sheet.rows)
    return f'<div class="wide"><table><tr>{head}</tr>{body}</table></div>'
