"""A comparison of models as one self-contained page of HTML."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import TYPE_CHECKING

from pikanid.reporting.document import document, drawn, tabled
from pikanid.reporting.validation_tables import pairs, scores

if TYPE_CHECKING:
    from pikanid.comparison import Validation
    from pikanid.model import Model

MOST = 6  # layout: figures of residuals


def page(found: Validation, title: str, models: Mapping[str, Model] | None = None) -> str:
    """The page: the answer, the table, the picture, who is better than whom.

    Args:
        found: To show.
        title: Such as the names of the recordings.
        models: By name, whose equations are listed.
    """
    return document(title, [
        f"<h1>How well is it predicted? {escape(title)}</h1>",
        f'<p class="verdict">{escape(found.sentence())}</p>',
        f"<p>{escape(str(found.protocol))}</p>",
        drawn(found.plot(), "measured and predicted"), tabled(scores(found)),
        "<h2>Who is better than whom</h2>" + tabled(pairs(found)) if found.pairs else "",
        _residuals(found), "".join(f"<p>{escape(note)}</p>" for note in found.notes)],
        models or {}, [s.recording for s in found.scores])


def _residuals(found: Validation) -> str:
    """What every model leaves, in sentences; in pictures what the best of them does."""
    said = "".join(f"<li>{escape(sentence)}</li>" for sentence, _ in found.left())
    best = next((name for name in found.ranking if found.residuals.get(name)), None)
    if best is None:
        return ""
    figures = "".join(drawn(a.plot(), f"residual of {a.output}")
                      for a in found.residuals[best][:MOST])
    return f"<h2>What is left</h2><ul>{said}</ul>{figures}"
