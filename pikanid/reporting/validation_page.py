"""A comparison of models as one self-contained page of HTML."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from pikanid.comparison.contender import Estimated
from pikanid.estimate.rounding import rounded
from pikanid.figures import unit_text
from pikanid.model import Model
from pikanid.pieces.html import drawn, tabled, text
from pikanid.pieces.sheet import Sheet
from pikanid.reporting.document import document
from pikanid.reporting.validation_tables import pairs, scores

if TYPE_CHECKING:
    from pikanid.comparison import Validation

MOST = 6  # layout: figures of residuals


def page(found: Validation, title: str,
         compared: Mapping[str, Model | Estimated] | None = None,
         files: Sequence[str] = ()) -> str:
    """The page: the answer, the table, the picture, who is better than whom.

    Args:
        found: To show.
        title: Such as the names of the recordings.
        compared: Models and estimates by name, whose parameters and equations are listed.
        files: What was read, as it was named.
    """
    return document(title, [
        f"<h1>How well is it predicted? {text(title)}</h1>",
        f'<p class="verdict">{text(found.sentence())}</p>',
        f"<p>{text(str(found.protocol))}</p>",
        drawn(found.plot(), "measured and predicted", found.plot(narrow=True)),
        tabled(scores(found)),
        "<h2>Who is better than whom</h2>" + tabled(pairs(found)) if found.pairs else "",
        "<h2>Parameters</h2>" + tabled(parameters(compared)) if compared else "",
        _residuals(found), "".join(f"<p>{text(note)}</p>" for note in found.notes), _next(found)],
        {name: one if isinstance(one, Model) else one.fitted_model
         for name, one in (compared or {}).items()}, [s.recording for s in found.scores],
        files)


def parameters(compared: Mapping[str, Model | Estimated]) -> Sheet:
    """Of every model, a column each, with the standard errors of those that were fitted."""
    cells: dict[tuple[str, str], dict[str, str]] = {}
    for name, one in compared.items():
        bare = one if isinstance(one, Model) else one.fitted_model
        std = {} if isinstance(one, Model) else {
            f.name: float(np.sqrt(one.covariance[k, k])) for k, f in enumerate(one.free)}
        for p in bare.parameters:
            if p.free or p.name in std:
                cells.setdefault((p.name, p.unit), {})[name] = rounded(
                    p.value, std.get(p.name, float("nan")))
    return Sheet(("parameter", *compared, "unit"), tuple(
        (label, *(own.get(name, "-") for name in compared), unit_text(unit) or "-")
        for (label, unit), own in cells.items()))


def _next(found: Validation) -> str:
    """What to do about what is left."""
    own = found.residuals.get(next((n for n in found.ranking if n in found.residuals), ""), ())
    if not own:
        return ""
    advice = ("Nothing is left to explain in these recordings: another excitation would be the "
              "harder test." if all(a.ok for a in own) else
              "What is left is more than noise: 'pikanid diagnose' says which physics is missing.")
    return f"<h2>What to do next</h2><p>{text(advice)}</p>"


def _residuals(found: Validation) -> str:
    """What every model leaves, in sentences; in pictures what the best of them does."""
    said = "".join(f"<li>{text(sentence)}</li>" for sentence, _ in found.left())
    best = next((name for name in found.ranking if found.residuals.get(name)), None)
    if best is None:
        return ""
    figures = "".join(drawn(a.plot(), f"residual of {a.output}", a.plot(narrow=True))
                      for a in found.residuals[best][:MOST])
    return f"<h2>What is left</h2><ul>{said}</ul>{figures}"
