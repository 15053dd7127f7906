"""From ranked hypotheses to an answer: what predicts recordings that nothing was fitted to."""

from __future__ import annotations

from collections.abc import Sequence

from pikanid.mismatch.beyond.force_shape import ForceShape
from pikanid.mismatch.beyond.formulas import symbolic_candidates
from pikanid.mismatch.case import Case
from pikanid.mismatch.catalogue.site import Site
from pikanid.mismatch.catalogue.swinging_force import swinging_on_their_own
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.judge.answer import Answer
from pikanid.mismatch.judge.laws_outside import with_formulas
from pikanid.mismatch.judge.verdict import settle
from pikanid.mismatch.search.screen import Screen


def confirmed(case: Case, ranked: Sequence[Hypothesis]) -> Answer:
    """What the held-out recordings leave of the hypotheses, with rivals looked for again."""
    case.clear_later(ranked[0])
    search = case.search
    answer = settle(case.evidence(ranked))
    for _ in range(case.settings.budget.rechecked):
        before = {h.fit for h in search.ranked()}
        if not search.closer(answer.given):
            break
        # one that is better has rivals of its own
        known = search.ranked()[0].fit in before
        answer = settle(case.evidence(
            search.ranked() if known else search.grow(case.adequate)))
    best = search.ranked()[0]
    if answer.verdict == "unnamed" and len(best.effects) == 1 and case.adequate(best):
        # one was enough for the recordings it was fitted to, and is not for the others
        failed = {h.fit for h in search.ranked()}
        answer = settle(case.evidence(search.grow(
            lambda h: case.adequate(h) and h.fit not in failed)))
    return answer


def with_laws_outside(case: Case, answer: Answer, shape: ForceShape, site: Site) -> Answer:
    """The answer, once formulas read from the shape of the force have been offered as well, and
    forces and parameters that swing.
    """
    search = case.search
    search.offer([((law,), [search.base().point]) for law in symbolic_candidates(
        shape, site, case.candidates, case.settings)])
    swinging = swinging_on_their_own(case.sites)
    # one after the other: hundreds of signs of each are as much as a memory should hold
    search.offer([((one,), starts) for law in swinging
                  for one, starts in Screen(search.base(), [law]).singles(1)])
    # one with a size and a phase in every recording takes up a part of anything
    partly = {law.key for law in swinging if not (
        (h := search.fits.get(frozenset({law.key}))) and case.adequate(h))}
    search.fits = {key: h for key, h in search.fits.items() if not key & partly}
    search.candidates = tuple(c for c in search.candidates if c.key not in partly)
    return with_formulas(answer, case.evidence(search.ranked()))
