"""The answer where formulas stand for what no catalogue holds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pikanid.mismatch.fitting.decisions import below
from pikanid.mismatch.judge.answer import Answer
from pikanid.mismatch.judge.evidence import Evidence
from pikanid.mismatch.judge.verdict import settle


def with_formulas(answer: Answer, evidence: Evidence) -> Answer:
    """The answer where nothing in the catalogue would do, after formulas have been fitted as well.

    A formula is given where it explains about as much as the laws outside the catalogue that kept
    names away, and predicts what is held out; those that do about as well stand beside it.
    """
    if not any(h.symbolic for h in evidence.ranked):
        return answer
    asks = evidence.settings.verdict
    found = settle(evidence)
    totals = {h.key: evidence.total(h) - evidence.handicap(h) for h in found.given}
    least = min((totals[h.key] for h in found.given if h.symbolic), default=-np.inf)
    given = tuple(h for h in found.given if h.symbolic
                  or below(asks.same_law, abs(totals[h.key] - least)))
    if not given or any(h.known and not h.symbolic for h in given):
        return answer
    best = evidence.score(next((h for h in given if h.symbolic), given[0]))
    reach = best + asks.behind * asks.indistinct
    likely = [h for h in evidence.tried if not h.known and h not in given
              and below(evidence.score(h), reach)][:evidence.settings.budget.predicted]
    apart = [evidence.total(h) - evidence.handicap(h) - least
             for h in likely if evidence.predict(h)]
    if any(below(asks.same_law, abs(d)) and below(d, asks.indistinct) for d in apart):
        doubt = "another law outside the catalogue explains it about as well"
        return replace(found, given=given, verdict="unconfirmed", doubt=found.doubt or doubt)
    if len(given) > 1:
        # forms that nobody has tried would do as well
        doubt = "these recordings do not tell which form it has"
        return replace(found, given=given, verdict="unconfirmed", doubt=found.doubt or doubt)
    return replace(found, given=given,
                   verdict="named" if found.verdict == "set" else found.verdict)
