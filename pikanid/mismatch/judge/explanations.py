"""Explanations that are compared with each other, weighed by what they predict and leave.

Where nothing explains everything, the posterior over hypotheses is worth little by itself: all of
them are wrong, and the least wrong one takes all the weight.  What counts beside it is dominance
over the remainder, κ: how many times more the best explanation without something leaves than the
best one with it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from pikanid.mismatch.fitting.decisions import below, smaller
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.judge.channels import needed
from pikanid.mismatch.judge.evidence import Evidence
from pikanid.mismatch.judge.kinds import Kind, kinds_in, kinds_of, members
from pikanid.mismatch.judge.left_over import left_over
from pikanid.mismatch.judge.prediction import HeldOut
from pikanid.mismatch.search.overdispersion import repeated
from pikanid.mismatch.settings.verdict import PartSettings


@dataclass(frozen=True)
class Weighed:
    """A hypothesis with what it predicts, its criterion S, posterior weight, and what it leaves of
    σ² in all recordings.
    """

    hypothesis: Hypothesis
    predicted: HeldOut
    left: float
    score: float = 0.0
    weight: float = 0.0
    share: float = 0.0
    kinds: frozenset[Kind] = field(default_factory=frozenset)


@dataclass(frozen=True)
class Explanations:
    """Explanations, the best first, and what χ² is divided by."""

    weighed: tuple[Weighed, ...]
    overdispersion: float

    def lead(self, share: float) -> Weighed | None:
        """The best one that predicts a share of what the nominal model misses, if there is one."""
        return next((w for w in self.weighed if not smaller(w.share, share)), None)

    def leaders(self, share: float) -> tuple[Hypothesis, ...]:
        """What leads, and what would if it predicted enough."""
        first = self.weighed[0].hypothesis
        best = self.lead(share)
        lead = best.hypothesis if best else first
        return (lead,) if lead is first else (lead, first)


def explanations(evidence: Evidence, noise: Sequence[dict[str, float]]) -> Explanations | None:
    """Explanations to be compared, weighed; None where the held-out recordings prove nothing.

    Args:
        evidence: Of all hypotheses.
        noise: σ of each output by name, in the train and in the held-out recordings.
    """
    rule, predict = evidence.settings.part, evidence.predict
    pool = _pool(evidence.ranked, rule)
    evidence.ahead([partial(predict, h) for h in pool])
    found = [Weighed(h, p, left_over(h, p, noise), kinds=frozenset(
                 k for e in h.effects for k in kinds_of(e, h, rule.dry)))
             for h in pool if (p := predict(h)) is not None]
    nominal = next((w for w in found if not w.hypothesis.effects), None)
    if nominal is None or len(found) < 2 or below(nominal.predicted.chi2 - len(
            nominal.predicted.rest), evidence.settings.least_proof):
        return None
    found, counts = _weighed(found, nominal, evidence)
    return Explanations(tuple(found), counts)


def lasting(ranked: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Without those that hold a formula, or what happens once, which swallows remainders, or an
    effect that could have any size.
    """
    return [h for h in ranked if not h.symbolic and all(
        e.lasts and h.determines(e) for e in h.effects)]


def _pool(ranked: Sequence[Hypothesis], rule: PartSettings) -> list[Hypothesis]:
    """The best lasting hypotheses, the best ones without each family of the first, and without it
    and each that stands in its place, those with another member of it, beside its own and in its
    place, those that need none of its channels, and the nominal model.
    """
    left = lasting(ranked)
    chosen = left[: rule.pool]
    first = next((h for h in left if h.effects), None)
    for kind in kinds_in(first, rule.dry) if first else ():
        apart = {h.fit: members(kind, h, rule.dry) for h in left}
        own = {e.key for e in apart[first.fit]} if first else set()
        without = [h for h in left if not apart[h.fit]]
        chosen += without[: rule.rivals]
        for other in sorted({k for h in without[: rule.rivals] for k in kinds_in(h, rule.dry)}):
            chosen += [h for h in without if not members(other, h, rule.dry)][: rule.rivals]
        others = [h for h in left if any(e.key not in own for e in apart[h.fit])]
        chosen += others[: rule.rivals]
        chosen += [h for h in others if all(e.key not in own for e in apart[h.fit])][: rule.rivals]
    for channel in sorted(needed(first)) if first else ():
        chosen += [h for h in left if channel not in needed(h)][: rule.rivals]
    chosen += [h for h in left if not h.effects]
    return list({h.fit: h for h in chosen}.values())


def _weighed(found: list[Weighed], nominal: Weighed, evidence: Evidence
             ) -> tuple[list[Weighed], float]:
    """The same with criterion and weights, best first; and what divides χ².

    That is the larger one of the overdispersions of the train recordings and of the best
    prediction: a scale of the train recordings alone lets an overfit win.
    """
    closest = min(found, key=lambda w: w.predicted.chi2)
    level = max(1.0, closest.predicted.chi2 / max(len(closest.predicted.rest), 1))
    counts = max(evidence.scale, level * repeated(closest.predicted.rest) ** (1 - 1 / level))
    louder = replace(evidence, scale=counts)
    scores = np.array([louder.total(w.hypothesis) for w in found])
    weights = np.exp(-0.5 * (scores - scores.min()))
    made = [replace(w, score=float(s), weight=float(p),
                    share=explained_share(nominal.predicted, w.predicted))
            for w, s, p in zip(found, scores, weights / weights.sum(), strict=True)]
    return sorted(made, key=lambda w: (w.score, w.hypothesis.place())), counts


def explained_share(before: HeldOut, after: HeldOut) -> float:
    """Of the square of what the nominal model misses of held-out recordings, beside noise."""
    return 1 - max(after.misfit**2 - 1, 0.0) / max(before.misfit**2 - 1, 1e-12)


def dominance(lead: Weighed, others: Sequence[Weighed], rule: PartSettings) -> float:
    """κ: how many times more the best of its rivals leaves; infinite where it has none."""
    least = min((w.left for w in others[: rule.rivals]), default=np.inf)
    return float(least / max(lead.left, rule.floor))


def not_ruled_out(given: Weighed, found: Iterable[Weighed], rule: PartSettings
                  ) -> list[Hypothesis]:
    """Explanations that leave less than κ times as much as that which is given."""
    return [w.hypothesis for w in found
            if smaller(w.left, rule.dominance * max(given.left, rule.floor))]


def spread(given: Hypothesis, near: Sequence[Hypothesis]) -> dict[str, float]:
    """Root mean square distance of each parameter's estimates in explanations `near` from that
    which is given.

    Which of them is right, if one is, is in no standard error: between models it adds to that
    within one (S. T. Buckland, K. P. Burnham and N. H. Augustin, Biometrics 53, 1997, eq. 9, with
    equal weights).
    """
    # another effect may have the same name for something else
    of = {p.name: e.key for e in given.effects for p in e.parameters}

    def apart(name: str, value: float) -> float:
        squares = [(h.values[name] - value) ** 2 for h in near
                   if name not in of or of[name] in h.key]
        return float(np.sqrt(np.mean(squares)))

    return {name: apart(name, value) for name, value in given.values.items()}
