"""What held-out recordings cannot speak of: one part of a train recording predicted from the other.

A limit that the held-out motion never meets is neither confirmed nor refuted there.  Where the
train recording meets it again and again, its second part is one that could have refuted what the
first one says.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from scipy.ndimage import maximum_filter1d

from pikanid.mismatch.case import Case
from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.data.whitened import Records
from pikanid.mismatch.fitting.decisions import below
from pikanid.mismatch.fitting.extended import extended
from pikanid.mismatch.fitting.fit import fitted
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.judge.doubt import worth
from pikanid.mismatch.judge.prediction import held_out

LEAST = 50  # numerical: samples of either part
CALM = 0.01  # numerical: of the largest square difference, below which two fits agree
SHARES = (0.5, 0.2, 0.05, 0.01)  # numerical: of what tells fits apart, at which parts are tried


def worth_within_train(case: Case, effect: Candidate, with_it: Hypothesis, without: Hypothesis
                       ) -> float:
    """χ² that an effect is worth in the second part of each train recording, as predicted from
    the first part, where it acts in either; 0 where that does not speak for it.

    The second part begins in the middle of a motion, so that its initial state is estimated.

    Args:
        case: What is diagnosed; keeps what it has been told.
        effect: That does not act in the held-out recordings.
        with_it, without: Explanations to be compared, fitted to all of the train recordings.
    """
    key = effect.key, with_it.fit, without.fit
    if key not in case.within_train:
        case.within_train[key] = _worth(case, effect, with_it, without)
    return case.within_train[key]


def _worth(case: Case, effect: Candidate, with_it: Hypothesis, without: Hypothesis) -> float:
    if any(e.absent or e.per_recording for e in with_it.effects + without.effects):
        return 0.0
    begins = [c for c in case.candidates if c.per_recording and not c.absent]
    model = extended(case.model, begins)
    asked = case.settings.verdict.shown * case.search.scale()
    for first, second in _parts(case.records, with_it, without):
        one, other = (fitted(model, h.effects, first, [h.point], 1, settled=h.key)
                      for h in (with_it, without))
        # what does not act in the first part predicts nothing
        if one is None or other is None or below(other.minimum.chi2 - one.minimum.chi2, asked):
            continue
        a, b = (held_out(h, model, second, case.candidates, case.rate) for h in (one, other))
        if a is not None and b is not None and below(a.deviance, b.deviance) and (
                found := worth(effect, a, b)):
            return found
    return 0.0


def _parts(records: Records, one: Hypothesis, other: Hypothesis
           ) -> Iterator[tuple[Records, Records]]:
    """Both parts of all recordings, cut where a share of what tells two fits apart has been seen
    and, if anywhere, they agree again: what is met is not met again while it lasts.  Neither is too
    short.
    """
    apart = [(np.concatenate([s.t for s in e.samples]), ((a.y - b.y) / sigma) ** 2)
             for e, sigma, a, b in zip(
                 one.whitened.problem.experiments, one.whitened.sigma,
                 *(h.whitened.responses(h.minimum.theta) for h in (one, other)), strict=True)]
    outputs = len(records.levels[0])
    for share in SHARES:
        cuts = []
        for t, square in apart:
            order = np.argsort(t, kind="stable")
            seen = np.cumsum(square[order])
            at = int(np.searchsorted(seen, share * seen[-1]))
            # of several outputs not all may show it
            apart_here = maximum_filter1d(square[order], 2 * outputs + 1)
            calm = np.flatnonzero(apart_here[at:] < CALM * square.max())
            at += int(calm[0]) if calm.size else 0
            if min(at, len(t) - at) >= LEAST:
                cuts.append(float(t[order][at]))
        if len(cuts) == len(apart):
            yield (replace(records, recordings=tuple(r.window(r.start, cut) for r, cut in zip(
                       records.recordings, cuts, strict=True))),
                   replace(records, recordings=tuple(r.window(cut, r.stop) for r, cut in zip(
                       records.recordings, cuts, strict=True))))
