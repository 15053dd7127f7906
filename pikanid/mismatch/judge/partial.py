"""Which physics is surely there although something is left: families of effects, and names.

Where nothing explains everything, the posterior over hypotheses is worth little by itself: all of
them are wrong, and the least wrong one takes all the weight.  What counts beside it is dominance
over the remainder, κ: how many times more the best explanation without a family leaves than the
best one with it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from pikanid.mismatch.catalogue.candidate import Candidate, Family
from pikanid.mismatch.fitting.decisions import below, smaller
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.judge.channels import needed
from pikanid.mismatch.judge.doubt import Predict, worth
from pikanid.mismatch.judge.kinds import Kind, holds, kinds_in, kinds_of, members
from pikanid.mismatch.judge.left_over import left_over
from pikanid.mismatch.judge.prediction import HeldOut
from pikanid.mismatch.search.overdispersion import repeated
from pikanid.mismatch.settings.settings import Settings
from pikanid.mismatch.settings.verdict import PartSettings
from pikanid.model.parts import Parameter


@dataclass(frozen=True)
class Present:
    """A family that is surely there, and its name where that is sure as well.

    Attributes:
        kind: Family of physics, and where.
        effect: The best explanation's member of it.
        names: The effect's ids, where no other member does as well; else empty.
        alternatives: Other members that were compared: names by key.
        probability, probability_family: Posterior of the effect, and of the family.
        dominance, dominance_within: κ over explanations without the family, and without the effect.
        share: Of the held-out misfit's square that the best explanation with it explains.
    """

    kind: Kind
    effect: Candidate
    names: tuple[str, ...]
    alternatives: Mapping[str, str]
    probability: float
    probability_family: float
    dominance: float
    dominance_within: float
    share: float

    @property
    def family(self) -> Family:
        """Of physics."""
        return self.kind.family


@dataclass(frozen=True)
class Doubtful:
    """A family in the best explanation that is not surely there.

    Attributes:
        kind: Family of physics, and where.
        effect: The best explanation's member of it.
        why: It is not sure, in words.
    """

    kind: Kind
    effect: Candidate
    why: str

    @property
    def family(self) -> Family:
        """Of physics."""
        return self.kind.family


@dataclass(frozen=True)
class Part:
    """What is surely there.

    Attributes:
        present: Families, the one that dominates most first.
        doubtful: Others in the best explanation.
        hypothesis: With the fewest effects, that holds what is present.
        overdispersion: What χ² is divided by.
        share: Of the held-out misfit's square that the hypothesis explains.
    """

    present: tuple[Present, ...]
    doubtful: tuple[Doubtful, ...]
    hypothesis: Hypothesis
    overdispersion: float
    share: float


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
    """Explanations, the best first, what χ² is divided by, and the best one that predicts most of
    what the nominal model misses, if there is one.
    """

    weighed: tuple[Weighed, ...]
    overdispersion: float
    lead: Weighed | None


def explanations(ranked: Sequence[Hypothesis], scale: float, predict: Predict,
                 noise: Sequence[dict[str, float]], settings: Settings,
                 ahead: Callable[[Sequence[Callable[[], object]]], None] = lambda jobs: None
                 ) -> Explanations | None:
    """Explanations to be compared, weighed; None where the held-out recordings prove nothing.

    Args:
        ranked: All hypotheses, best first, the nominal model among them.
        scale: That divides χ², as far as the train recordings tell.
        predict: What a hypothesis makes of the held-out recordings.
        noise: σ of each output by name, in the train and in the held-out recordings.
        settings: What is asked.
        ahead: Given work that is all needed, before it is: to do it side by side.
    """
    rule = settings.part
    pool = _pool(ranked, rule)
    ahead([partial(predict, h) for h in pool])
    found = [Weighed(h, p, left_over(h, p, noise), kinds=frozenset(
                 k for e in h.effects for k in kinds_of(e, h, rule.dry)))
             for h in pool if (p := predict(h)) is not None]
    nominal = next((w for w in found if not w.hypothesis.effects), None)
    if nominal is None or len(found) < 2 or below(nominal.predicted.chi2 - len(
            nominal.predicted.rest), settings.least_proof):
        return None
    found, counts = _weighed(found, nominal, scale, settings.verdict.decoy_handicap)
    # of the explanations that predict most of what the nominal model misses
    return Explanations(tuple(found), counts,
                        next((w for w in found if not smaller(w.share, rule.share)), None))


def surely_there(explained: Explanations, scale: float, settings: Settings) -> Part | None:
    """What is there whatever the remainder is; None where nothing is sure.

    Args:
        explained: Explanations, weighed.
        scale: That divides χ², as far as the train recordings tell.
        settings: What is asked.
    """
    rule, found, lead = settings.part, explained.weighed, explained.lead
    if lead is None:
        return None
    examined = [_examined(kind, lead, found, rule, scale * settings.least_proof)
                for kind in kinds_in(lead.hypothesis, rule.dry)]
    present = [p for p in examined if isinstance(p, Present)]
    # that a family is there somewhere says no more where a place of it is sure
    present = [p for p in present if not _elsewhere(p.kind, [o.kind for o in present])]
    if not present:
        return None
    sure = {p.kind for p in present}
    named = {p.effect.key for p in present if p.names}
    # the fewest effects that hold all of it and leave about as much
    enough = [w for w in found if all(k.among(w.kinds) for k in sure) and named <= w.hypothesis.key
              and not smaller(w.share, rule.share)
              and not smaller(rule.within * max(lead.left, rule.floor), w.left)]
    fewest = min(enough, key=lambda w: (len(w.hypothesis.effects), w.score))
    return Part(tuple(sorted(present, key=lambda p: -p.dominance)),
                tuple(
                    d for d in examined if isinstance(d, Doubtful)
                    and not _elsewhere(d.kind, lead.kinds)), fewest.hypothesis,
                explained.overdispersion, fewest.share)


def _elsewhere(kind: Kind, kinds: Iterable[Kind]) -> bool:
    """Whether others of the family say in which place."""
    return not kind.place and any(k.place and k.family == kind.family for k in kinds)


def lasting(ranked: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Without those that hold a formula, or what happens once, which swallows remainders."""
    return [h for h in ranked if not h.symbolic and all(e.lasts for e in h.effects)]


def _pool(ranked: Sequence[Hypothesis], rule: PartSettings) -> list[Hypothesis]:
    """The best lasting hypotheses, the best ones without each family of the first and those with
    another member of it, those that need none of its channels, and the nominal model.
    """
    left = lasting(ranked)
    chosen = left[: rule.pool]
    first = next((h for h in left if h.effects), None)
    for kind in kinds_in(first, rule.dry) if first else ():
        apart = {h.fit: members(kind, h, rule.dry) for h in left}
        own = {e.key for e in apart[first.fit]} if first else set()
        chosen += [h for h in left if not apart[h.fit]][: rule.rivals]
        chosen += [h for h in left if any(e.key not in own for e in apart[h.fit])][: rule.rivals]
    for channel in sorted(needed(first)) if first else ():
        chosen += [h for h in left if channel not in needed(h)][: rule.rivals]
    chosen += [h for h in left if not h.effects]
    return list({h.fit: h for h in chosen}.values())


def _weighed(found: list[Weighed], nominal: Weighed, scale: float,
             handicap: float) -> tuple[list[Weighed], float]:
    """The same with criterion and weights, best first; and what divides χ².

    That is the larger one of the overdispersions of the train recordings and of the best
    prediction: a scale of the train recordings alone lets an overfit win.
    """
    closest = min(found, key=lambda w: w.predicted.chi2)
    level = max(1.0, closest.predicted.chi2 / max(len(closest.predicted.rest), 1))
    counts = max(scale, level * repeated(closest.predicted.rest) ** (1 - 1 / level))
    scores = np.array([(w.hypothesis.minimum.chi2 + w.predicted.deviance) / counts
                       + w.hypothesis.penalty
                       + handicap * sum(not e.known for e in w.hypothesis.effects) for w in found])
    weights = np.exp(-0.5 * (scores - scores.min()))
    before = max(nominal.predicted.misfit**2 - 1, 1e-12)
    made = [replace(w, score=float(s), weight=float(p), share=1 - max(
                w.predicted.misfit**2 - 1, 0.0) / before)
            for w, s, p in zip(found, scores, weights / weights.sum(), strict=True)]
    return sorted(made, key=lambda w: (w.score, w.hypothesis.place())), counts


def _examined(kind: Kind, lead: Weighed, found: Sequence[Weighed], rule: PartSettings,
              proof: float) -> Present | Doubtful:
    """A family of the leading explanation: surely there, or why not.

    Args:
        kind: Of an effect of it.
        lead: The best explanation that predicts.
        found: All explanations, best first.
        rule: What is asked.
        proof: χ² that the family must be worth in the held-out recordings.
    """
    holders = [w for w in found if kind.among(w.kinds)]
    others = [w for w in found if not kind.among(w.kinds)]
    own_effects = members(kind, lead.hypothesis, rule.dry)
    effect = own_effects[0]
    total = sum(w.weight for w in holders)
    kappa = dominance(lead, others, rule)
    if smaller(total, 1 - rule.rate):
        return Doubtful(kind, effect, f"its probability is {total:.3g}")
    if smaller(kappa, rule.dominance):
        return Doubtful(kind, effect, "without it the best explanation leaves "
                        f"{kappa:.2g} times as much, {rule.dominance:.2g} are asked")
    if smaller(max((dominance(w, others, rule) for w in holders if any(
            e.known for e in members(kind, w.hypothesis, rule.dry))), default=0.0), rule.dominance):
        return Doubtful(kind, effect, "only a law outside the catalogue explains so much of it")
    # what does less than a law that is in no catalogue may be a facet of what that stands for
    if smaller(kappa, max((dominance(lead, [w for w in found if not holds(w.hypothesis, e)], rule)
                           for e in lead.hypothesis.effects if not e.known), default=0.0)):
        return Doubtful(kind, effect, "beside it a law outside the catalogue explains more")
    if others and below(power := worth(effect, lead.predicted, others[0].predicted), proof):
        return Doubtful(kind, effect, "the held-out recording could not have refuted it (it is "
                        f"worth {power:.2g} of chi-squared there, {proof:.2g} are asked)")
    same = [w for w in holders if holds(w.hypothesis, effect)]
    # a law that contains the effect is no rival of it
    rivals = [w for w in holders if w not in same and not any(
        _contains(e, effect) for e in w.hypothesis.effects)]
    own = sum(w.weight for w in same)
    within = dominance(lead, rivals, rule)
    # what needs a law outside the catalogue beside it has no name of its own, and a free exponent
    # takes up what other laws leave
    asked = rule.dominance if isinstance(effect.exponent, Parameter) else rule.within
    blurred = effect.key in lead.hypothesis.blurred
    exact = all(e.known for e in own_effects) and not (
        blurred or smaller(own, 1 - rule.rate) or smaller(within, asked)
        # as sure as the family itself, whatever is left
        or (smaller(lead.share, rule.exact) and smaller(within, rule.dominance)))
    compared = {e.key: e.name for w in holders for e in members(kind, w.hypothesis, rule.dry)
                if e.key != effect.key}
    return Present(kind, effect, effect.ids if exact else (),
                   compared, own, total, kappa, within, lead.share)


def _contains(law: Candidate, effect: Candidate) -> bool:
    """Whether a law has an effect as a special case, or is a sum of which it is one."""
    sums = law.parts([p.value for p in law.parameters]) if law.parts else ()
    return effect.key in law.covers or any(effect.key in parts for parts in sums)


def dominance(lead: Weighed, others: Sequence[Weighed], rule: PartSettings) -> float:
    """κ: how many times more the best of its rivals leaves; infinite where it has none."""
    least = min((w.left for w in others[: rule.rivals]), default=np.inf)
    return float(least / max(lead.left, rule.floor))
