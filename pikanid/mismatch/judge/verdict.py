"""From ranked hypotheses to an answer: which are given, and how sure one may be."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from pikanid.mismatch.fitting.decisions import below, in_order, smaller
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.judge.answer import Answer, Verdict
from pikanid.mismatch.judge.doubt import why_not
from pikanid.mismatch.judge.evidence import Evidence
from pikanid.mismatch.judge.same_law import integer_laws, merged_twins, signature

NO_ENTRY = "holds a law of no catalogue: others may do the same"


def settle(evidence: Evidence) -> Answer:
    """Choose what is given."""
    tried = evidence.tried
    if not tried or not below(evidence.score(tried[0]), evidence.score(evidence.nominal)):
        return Answer("unnamed", (), tuple(tried[:3]))
    choice = _Choice(evidence)
    near, given = choice.needed(choice.near())
    if evidence.checked:
        given += choice.predicting_better(near)
        given = choice.not_spoken_against(given)
    adequate = given
    if evidence.checked and len(given) > 1:
        given = choice.likely(given)
    given = choice.explaining_all(given)
    if not any(h.known for h in given):
        return choice.without_a_name(near, given)
    return choice.with_names(near, adequate, given)


@dataclass
class _Choice:
    """What is given, step by step, and why the rest is not.

    Attributes:
        evidence: Of all hypotheses.
        reasons: Why hypotheses that are near are not given.
        spare: Why others need not be.
    """

    evidence: Evidence
    reasons: dict[frozenset[str], str] = field(default_factory=dict)
    spare: dict[frozenset[str], str] = field(default_factory=dict)

    @property
    def within(self) -> float:
        return self.evidence.settings.verdict.indistinct

    @property
    def lowest(self) -> float:
        return min(map(self.evidence.handicapped, self.evidence.tried))

    def near(self) -> list[Hypothesis]:
        """What the train recordings do not tell from the best, tested and predicted."""
        evidence = self.evidence
        reach = self.lowest + self.within
        close = [h for h in evidence.tried if below(evidence.score(h) - h.assumed, reach)
                 ][:evidence.settings.budget.tested]
        near = integer_laws(close, evidence.settings.verdict)
        self.spare |= {h.key: "its exponent is a whole number: that law has a name of its own"
                       for h in close if h not in near}
        evidence.ahead([partial(ask, h) for h in near for ask in (evidence.predict, evidence.test)])
        if evidence.checked:
            evidence.ahead([partial(getattr, seen, "detection") for h in near
                            if evidence.adequate(evidence.test(h).p_value)
                            and (seen := evidence.predict(h))])
        return near

    def passes(self, h: Hypothesis) -> bool:
        """Whether a hypothesis is adequate, on the train recordings and on the held-out ones."""
        evidence = self.evidence
        if h.blurred:
            self.reasons[h.key] = "what it calls dry friction rises with all speeds of the motion"
        elif not evidence.adequate(evidence.test(h).p_value):
            self.reasons[h.key] = "leaves something unexplained in the recording"
        elif evidence.checked and ((seen := evidence.predict(h)) is None
                                   or not evidence.adequate(seen.detection.p_value)):
            self.reasons[h.key] = "does not predict the held-out recording"
        return h.key not in self.reasons

    def needed(self, near: list[Hypothesis]) -> tuple[list[Hypothesis], list[Hypothesis]]:
        """What is near, and what of it is adequate, without what holds more than is needed."""
        given = [h for h in near if self.passes(h)]
        needless = [h for h in given if _needless(h, near, given, self.evidence)]
        self.spare |= {h.key: "holds more than is needed" for h in needless}
        return ([h for h in near if h not in needless], [h for h in given if h not in needless])

    def predicting_better(self, near: Sequence[Hypothesis]) -> list[Hypothesis]:
        """What the train recordings speak against a little, and the held-out ones for."""
        evidence = self.evidence
        best = min(map(evidence.total, near))
        reach = self.lowest + evidence.settings.verdict.behind * self.within
        behind = [h for h in evidence.tried if h not in near
                  and below(evidence.handicapped(h), reach)][:evidence.settings.budget.predicted]
        return [h for h in behind if below(evidence.total(h), best) and self.passes(h)]

    def not_spoken_against(self, given: Sequence[Hypothesis]) -> list[Hypothesis]:
        """Without those of which the held-out recordings speak against an effect."""
        evidence = self.evidence
        against = [h for h in given if any(
            o.key < h.key and below(evidence.total(o), evidence.total(h))
            and evidence.speaks(o, h) for o in given)]
        self.reasons |= {h.key: "the held-out recording speaks against one of its effects"
                         for h in against}
        return [h for h in given if h not in against]

    def likely(self, given: Sequence[Hypothesis]) -> list[Hypothesis]:
        """Without those that predict the held-out recording clearly worse than another does."""
        evidence = self.evidence
        reach = min(map(evidence.total, given)) + self.within
        # what says how recordings begin costs in the one and in the other
        kept = [h for h in given if below(
            evidence.total(h) - evidence.handicap(h) - h.assumed - h.begun, reach)]
        self.reasons |= {h.key: "predicts the held-out recording worse"
                         for h in given if h not in kept}
        return in_order(kept, evidence.total, Hypothesis.place)

    def explaining_all(self, given: Sequence[Hypothesis]) -> list[Hypothesis]:
        """Those that one fit of all recordings leaves nothing unexplained of."""
        evidence = self.evidence
        if not evidence.checked:
            return list(given)
        evidence.ahead([partial(getattr, seen, "together") for h in given
                        if (seen := evidence.predict(h))])
        for h in given:
            if (seen := evidence.predict(h)) and (both := seen.together) and smaller(
                    both.p_value, evidence.settings.refusal_together):
                self.reasons[h.key] = "leaves something unexplained in all recordings together"
        return [h for h in given if h.key not in self.reasons]

    def without_a_name(self, near: Sequence[Hypothesis], given: Sequence[Hypothesis]) -> Answer:
        """The answer where no entry of the catalogue explains all."""
        tried = self.evidence.tried
        self.reasons |= {h.key: NO_ENTRY for h in given}
        rest = (*given, *(h for h in near if h not in given))
        most = _largest_part(self.evidence) if not given else ()
        if not most:
            return Answer("unnamed", (), rest[:5], {}, self.reasons)
        merged, twins = merged_twins(list(most), tried, self.evidence.settings.verdict)
        return Answer("unconfirmed", self.evidence.most_probable_first(merged),
                      tuple(h for h in rest if h not in most)[:5], twins, self.reasons)

    def with_names(self, near: Sequence[Hypothesis], adequate: Sequence[Hypothesis],
                   given: Sequence[Hypothesis]) -> Answer:
        """The answer where entries of the catalogue do, and how sure one may be of them."""
        evidence, tried = self.evidence, self.evidence.tried
        asks, proves = evidence.settings.verdict, evidence.proves
        known, outside = ([h for h in given if h.known is of] for of in (True, False))
        doubt = why_not(known[0], evidence) if proves else ""
        if doubt and not outside and (sure := self.sure_by_itself(known, adequate)):
            known += [sure] if all(h is not sure for h in known) else []
            doubt = ""
        merged, twins = merged_twins(known, tried, asks)
        # laws outside the catalogue that would do as well are for the reader to know
        outside = [h for h in outside if not any(self.same(o, h) for o in known)]
        lowest = min(map(evidence.total, known))
        open_to, more = merged_twins(
            [h for h in outside if below(evidence.total(h), lowest + self.within)], tried, asks)
        merged, twins = merged + open_to, {**twins, **more}
        if proves:
            doubt = self.doubted(doubt, known, outside, near, merged)
        verdict: Verdict = ("unconfirmed" if doubt or not proves
                            else "named" if len(merged) == 1 else "set")
        told = set(map(signature, merged))
        others = [h for h in tried if signature(h) not in told][:5]
        return Answer(verdict, evidence.most_probable_first(merged), tuple(others), twins,
                      {**self.spare, **self.reasons}, doubt,
                      tuple(h for h in outside if not any(h is o for o in merged)))

    def same(self, one: Hypothesis, other: Hypothesis) -> bool:
        """Whether two hypotheses that differ in one effect are the same motion in all recordings:
        one law in two forms, as a dead zone that is never entered and an offset.
        """
        if len(signature(one) ^ signature(other)) != 2 or len(one.key ^ other.key) != 2:
            return False
        close = self.evidence.settings.verdict.same
        if not below(abs(one.minimum.chi2 - other.minimum.chi2), close):
            return False
        a, b = self.evidence.predict(one), self.evidence.predict(other)
        return a is None or b is None or below(abs(a.deviance - b.deviance), close)

    def sure_by_itself(self, known: Sequence[Hypothesis], adequate: Sequence[Hypothesis]
                       ) -> Hypothesis | None:
        """The simplest part of the best that is sure, whatever may be there besides, if any is."""
        evidence, best = self.evidence, known[0]
        reach = evidence.total(best) + evidence.settings.verdict.behind * self.within
        simplest = min((h for h in adequate if h.known and _within(h, best) and (
            h is best or below(evidence.total(h), reach))), key=lambda h: len(h.effects))
        if why_not(simplest, evidence):
            return None
        if any(h is simplest for h in known):
            return simplest
        self.reasons.pop(simplest.key, None)  # that more predicts better is not sure
        return next(iter(self.explaining_all([simplest])), None)

    def doubted(self, doubt: str, known: Sequence[Hypothesis], outside: Sequence[Hypothesis],
                near: Sequence[Hypothesis], merged: Sequence[Hypothesis]) -> str:
        """What keeps the answer from being sure: a law outside the catalogue, the doubt about the
        best explanation itself, or else how many others would do.
        """
        evidence, asks, best = self.evidence, self.evidence.settings.verdict, known[0]
        lowest = min(map(evidence.total, known))
        if not best.symbolic and any(below(evidence.total(h), lowest) for h in outside):
            return "a law outside the catalogue is more probable"
        if doubt:
            return doubt
        if any(below(evidence.total(h), lowest - self.within)
               for h in near if h.key in self.reasons):
            return "what explains it far better leaves something unexplained"
        # where one law outside the catalogue does what several effects do, another one may do it
        if any(not h.known and len(h.effects) < len(best.effects) for h in near):
            return "fewer laws, one of them in no catalogue, explain the recording as well"
        laws = [h for h in merged if not h.next_form]  # a name's next form is of one kind with it
        apart: list[Hypothesis] = []
        for h in laws:
            if not any(o.key < h.key for o in laws) and not any(self.same(o, h) for o in apart):
                apart.append(h)
        weak = below(evidence.gained(best, evidence.nominal), asks.minor_strong)
        if (len(apart) > asks.crowd) + any(not h.known for h in laws) + weak > 1:
            return "where all of these would do, a law that nobody has listed may"
        return ""


def _largest_part(evidence: Evidence) -> tuple[Hypothesis, ...]:
    """The smallest known hypotheses that predict held-out data as well as any, and far better than
    nothing does, though not down to the noise: part of what is missing, given as unconfirmed.
    """
    asks, settings = evidence.settings.verdict, evidence.settings
    # what happens once takes up much of any misfit, and no other recording can confirm it
    lasting = [h for h in evidence.tried if h.known and not any(e.absent for e in h.effects)]
    known = in_order(lasting, evidence.score, Hypothesis.place)[:settings.budget.predicted]
    closest = in_order(evidence.tried, evidence.handicapped, Hypothesis.place)[0]
    nominal = evidence.predict(evidence.nominal)
    if not known or nominal is None or (
            not closest.known and evidence.scale < settings.fits.gross
            and below(evidence.handicapped(closest), evidence.score(known[0]))):
        return ()
    found = {h.key: p.misfit for h in known if (p := evidence.predict(h)) is not None}
    lowest = min(found.values(), default=np.inf)
    if smaller(asks.part * nominal.misfit, lowest):
        return ()
    enough = max(asks.alike * lowest, lowest + asks.worth * nominal.misfit)
    good = [h for h in known if not smaller(enough, found.get(h.key, np.inf))]
    fewest = min(len(h.effects) for h in good)
    return tuple(in_order((h for h in good if len(h.effects) == fewest), lambda h: found[h.key],
                          Hypothesis.place, band=0.0)[:3])


def _within(fewer: Hypothesis, more: Hypothesis) -> bool:
    """Whether a hypothesis holds all effects of another one, or laws that contain them."""
    return all(e.key in more.key or any(e.key in law.covers for law in more.effects)
               for e in fewer.effects)


def _needless(h: Hypothesis, near: Sequence[Hypothesis], given: Sequence[Hypothesis],
              evidence: Evidence) -> bool:
    """Whether a hypothesis adds effects to a far better one, or laws outside the catalogue to a
    better one.

    One more effect of the catalogue that is nearly worth its penalty may be there: then it is for
    the reader to know.
    """
    if h.symbolic and any(o.symbolic and len(o.minimum.theta) < len(h.minimum.theta)
                          and not below(evidence.score(h), evidence.score(o)) for o in given):
        return True  # a longer formula for the same
    own, needless = evidence.handicapped(h), evidence.settings.verdict.needless
    return any(o.key < h.key and not below(own, evidence.handicapped(o) + (
        0.0 if o in given and not h.known else needless)) for o in near)
