"""Which physics is surely there although something is left: families of effects, and names."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from pikanid.mismatch.catalogue.candidate import Candidate, Family
from pikanid.mismatch.fitting.decisions import below, smaller
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.judge.doubt import EXPLAINED_AWAY, no_size, worth
from pikanid.mismatch.judge.explanations import (
    Explanations,
    Weighed,
    dominance,
    not_ruled_out,
    spread,
)
from pikanid.mismatch.judge.kinds import Kind, holds, kinds_in, members
from pikanid.mismatch.judge.rivals import rivals, same, twins, wider
from pikanid.mismatch.settings.settings import Settings
from pikanid.model.parts import Parameter

MORE = 1.05  # layout: times as much, that is not told as "about as much"


@dataclass(frozen=True)
class Instead:
    """A family that may be there in another one's place.

    Attributes:
        kind: Family of physics, and where.
        effect: The best explanation's with it member of it.
    """

    kind: Kind
    effect: Candidate


@dataclass(frozen=True)
class Present:
    """A family that is surely there, and its name where that is sure as well.

    Attributes:
        kind: Family of physics, and where.
        effect: The best explanation's member of it.
        names: The effect's ids and those of its twins, where no other member does as well; else
            empty.
        alternatives: Other members that were compared: names by key.
        probability, probability_family: Posterior of the effect, and of the family.
        dominance, dominance_within: κ over explanations without the family, and without the effect.
        share: Of the held-out misfit's square that the best explanation with it explains.
        instead: Another family, where only that one of both is there is sure: what is said of the
            family holds for both together, and no name is sure.
        twins: What small motions cannot tell from the effect and does about as well.
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
    instead: Instead | None = None
    twins: tuple[Candidate, ...] = ()

    @property
    def family(self) -> Family:
        """Of physics."""
        return self.kind.family

    @property
    def kinds(self) -> tuple[Kind, ...]:
        """The families one of which is there."""
        return (self.kind,) if self.instead is None else (self.kind, self.instead.kind)


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
        spread: How far apart explanations that are not ruled out have its parameters, by name.
    """

    present: tuple[Present, ...]
    doubtful: tuple[Doubtful, ...]
    hypothesis: Hypothesis
    overdispersion: float
    share: float
    spread: Mapping[str, float] = field(default_factory=dict)


def surely_there(explained: Explanations, scale: float, settings: Settings) -> Part:
    """What is there whatever the remainder is; where nothing is, what keeps the families of the
    best explanation from being sure.

    Args:
        explained: Explanations, weighed.
        scale: That divides χ², as far as the train recordings tell.
        settings: What is asked.
    """
    rule, found = settings.part, explained.weighed
    lead = explained.lead(rule.share) or found[0]
    examined = [
        _with_a_size(_one_of_two(kind, lead, found, settings, scale),
                     lead.hypothesis, explained.overdispersion, settings)
        for kind in kinds_in(lead.hypothesis, rule.dry)]
    little = EXPLAINED_AWAY if lead.hypothesis.explained_away() else ""
    if smaller(lead.share, rule.share):
        little = (f"the best explanation with it explains {max(lead.share, 0.0):.0%} of the "
                  f"held-out misfit, sure from {rule.share:.0%} on")
    if little:
        examined = [one if isinstance(one, Doubtful) else Doubtful(one.kind, one.effect, little)
                    for one in sorted(examined, key=lambda one: isinstance(one, Doubtful))]
    doubtful = tuple(d for d in examined if isinstance(d, Doubtful)
                     and not _elsewhere(d.kind, lead.kinds))
    present = [p for p in examined if isinstance(p, Present)]
    # that a family is there somewhere says no more where a place of it is sure
    present = [p for p in present if not _elsewhere(p.kind, [o.kind for o in present])]
    if not present:
        return Part((), doubtful, lead.hypothesis, explained.overdispersion, lead.share)
    sure = {p.kind for p in present}
    named = {p.effect.key for p in present if p.names}
    # the fewest effects that hold all of it and leave about as much
    enough = [w for w in found if all(k.among(w.kinds) for k in sure) and named <= w.hypothesis.key
              and not smaller(w.share, rule.share)
              and not smaller(rule.within * max(lead.left, rule.floor), w.left)]
    fewest = min(enough, key=lambda w: (len(w.hypothesis.effects), w.score))
    apart = spread(fewest.hypothesis, not_ruled_out(fewest, found, rule))
    if fewest.hypothesis.explained_away(explained.overdispersion):
        lost = tuple(Doubtful(p.kind, p.effect, EXPLAINED_AWAY) for p in present)
        return Part((), (*lost, *doubtful), lead.hypothesis, explained.overdispersion, lead.share)
    # a law of which others as good have another size altogether has no name: any that is like it
    present = [replace(p, names=()) if p.names and no_size(
        p.effect, fewest.hypothesis, explained.overdispersion, settings, apart) else p
        for p in present]
    return Part(tuple(sorted(present, key=lambda p: -p.dominance)), doubtful, fewest.hypothesis,
                explained.overdispersion, fewest.share, apart)


def _elsewhere(kind: Kind, kinds: Iterable[Kind]) -> bool:
    """Whether others of the family say in which place."""
    return not kind.place and any(k.place and k.family == kind.family for k in kinds)


def _with_a_size(one: Present | Doubtful, h: Hypothesis, overdispersion: float,
                 settings: Settings) -> Present | Doubtful:
    """The same; not sure where the remainder leaves open whether there is any of it."""
    if isinstance(one, Doubtful):
        return one
    why = no_size(one.effect, h, overdispersion, settings)
    return Doubtful(one.kind, one.effect, why) if why else one


def _one_of_two(kind: Kind, lead: Weighed, found: Sequence[Weighed], settings: Settings,
                scale: float) -> Present | Doubtful:
    """A family of the leading explanation, surely there; else that it is or another one, which all
    explanations hold that do nearly as well without it; else why neither is sure.

    A family that is improbable is not one of two.
    """
    rule = settings.part
    alone = _examined(kind, lead, found, settings, scale)
    if isinstance(alone, Present) or smaller(
            sum(w.weight for w in found if kind.among(w.kinds)), rule.rate):
        return alone
    asked = rule.dominance_of(kind.family)
    others = [w for w in found if not kind.among(w.kinds)][: rule.rivals]
    near = [w for w in others if smaller(dominance(lead, [w], rule), asked)]
    shared = frozenset.intersection(*(w.kinds for w in near)) if near else frozenset()
    instead = [Instead(other, members(other, near[0].hypothesis, rule.dry)[0])
               for other in sorted(shared - lead.kinds)]
    either = (_examined(kind, lead, found, settings, scale, other) for other in instead)
    return max((one for one in either if isinstance(one, Present)),
               key=lambda one: one.dominance, default=alone)


def _left(w: Weighed) -> float:
    """χ² that an explanation leaves in all recordings."""
    return w.hypothesis.minimum.chi2 + w.predicted.deviance


def _examined(kind: Kind, lead: Weighed, found: Sequence[Weighed], settings: Settings,
              scale: float, instead: Instead | None = None) -> Present | Doubtful:
    """A family of the leading explanation: surely there, or why not.

    Args:
        kind: Of an effect of it.
        lead: The best explanation that predicts.
        found: All explanations, best first.
        settings: What is asked.
        scale: That divides χ², as far as the train recordings tell.
        instead: Another family: whether it or that one is there.
    """
    rule, proof = settings.part, scale * settings.least_proof
    strong = scale * settings.verdict.minor_strong
    either = (kind,) if instead is None else (kind, instead.kind)
    holders = [w for w in found if any(k.among(w.kinds) for k in either)]
    others = [w for w in found if not any(k.among(w.kinds) for k in either)]
    own_effects = members(kind, lead.hypothesis, rule.dry)
    effect = own_effects[0]
    total = sum(w.weight for w in holders)
    kappa, asked = dominance(lead, others, rule), max(rule.dominance_of(k.family) for k in either)
    if smaller(total, 1 - rule.rate):
        return Doubtful(kind, effect, f"its probability is {total:.3g}")
    if smaller(kappa, asked):
        return Doubtful(kind, effect, "without it the best explanation leaves " + (
            "less" if kappa < 1 else f"{kappa:.2g} times as much, sure from {asked:.2g} on"
            if kappa >= MORE else "about as much"))
    found_more = min((_left(w) for w in others), default=np.inf) - _left(lead)
    if below(found_more, strong):
        return Doubtful(kind, effect, "it explains so little that it may stand for anything of its "
                        f"size (it lowers chi-squared by {found_more:.0f}, {strong:.0f} are asked)")
    listed = [w for w in holders if (own_of := members(kind, w.hypothesis, rule.dry))
              and all(e.known for e in own_of)]
    if smaller(max((dominance(w, others, rule) for w in listed), default=0.0), asked):
        return Doubtful(kind, effect, "only a law outside the catalogue explains so much of it")
    # what does less than a law that is in no catalogue may be a facet of what that stands for
    if smaller(kappa, max((dominance(lead, [w for w in found if not holds(w.hypothesis, e)], rule)
                           for e in lead.hypothesis.effects if not e.known), default=0.0)):
        return Doubtful(kind, effect, "beside it a law outside the catalogue explains more")
    if others and below(power := worth(effect, lead.predicted, others[0].predicted), proof):
        return Doubtful(kind, effect, "the held-out recording could not have refuted it (it is "
                        f"worth {power:.2g} of chi-squared there, {proof:.2g} are asked)")
    # where a law that contains the effect leaves far less, the effect's form is another one
    other_form = not smaller(lead.left, rule.form * max(min(
        (w.left for w in holders if not holds(w.hypothesis, effect)
         and wider(w.hypothesis, effect)), default=np.inf), rule.floor))
    own = sum(w.weight for w in holders if same(w.hypothesis, effect, lead.hypothesis))
    within = dominance(lead, rivals(kind, effect, lead.hypothesis, holders), rule)
    # what needs a law outside the catalogue beside it has no name of its own, and a free exponent
    # takes up what other laws leave
    clearly = rule.dominance if isinstance(effect.exponent, Parameter) else rule.within
    blurred = effect.key in lead.hypothesis.blurred
    # as sure as the family itself, where much is left
    clearly = rule.dominance if smaller(lead.share, rule.exact) else clearly
    exact = instead is None and all(e.known for e in own_effects) and not (
        blurred or other_form or smaller(own, 1 - rule.rate) or smaller(within, clearly))
    alike = twins(effect, lead, holders, clearly * max(lead.left, rule.floor))
    compared = {e.key: e.name for w in holders for k in either
                for e in members(k, w.hypothesis, rule.dry) if e.key != effect.key}
    names = dict.fromkeys(i for e in (effect, *alike) for i in e.ids)
    return Present(kind, effect, tuple(names) if exact else (),
                   compared, own, total, kappa, within, lead.share, instead, alike)
