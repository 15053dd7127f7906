"""From an answer that leaves something to what is surely there nevertheless."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

from pikanid.mismatch.beyond.free_channels import sure_channels
from pikanid.mismatch.case import Case
from pikanid.mismatch.catalogue.candidate import CURVES, Candidate, Family
from pikanid.mismatch.catalogue.site import Site
from pikanid.mismatch.fitting.decisions import smaller
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.judge.answer import Answer
from pikanid.mismatch.judge.explanations import (
    Explanations,
    explained_share,
    explanations,
    lasting,
)
from pikanid.mismatch.judge.kinds import Kind, kinds_in, members
from pikanid.mismatch.judge.partial import Doubtful, Instead, Part, Present, surely_there
from pikanid.mismatch.search.neighbours import (
    Job,
    beside,
    with_bent_scales,
    with_curves,
    with_next_form,
    with_next_sign,
    with_relatives,
    with_sums,
    with_walls,
    with_wider,
)
from pikanid.mismatch.search.screen import Screen
from pikanid.mismatch.search.search import Search
from pikanid.mismatch.steps.against_curves import against_curves

TOGETHER = "several effects together can take up most of anything, and none is sure by itself"


def with_sure_part(case: Case, answer: Answer, site: Site) -> Answer:
    """The answer, where not everything is explained, with what is surely there nevertheless, and
    the channels in which something is.

    Several effects together take up most of anything: an answer of so many says that it is all only
    if each of them has to be there by its name whatever is left.
    """
    several = answer.verdict in ("named", "set") and all(
        len(h.effects) > case.settings.part.all_of for h in answer.given)
    if answer.verdict not in ("unconfirmed", "unnamed") and not several:
        return answer
    explained, part = _sure(case) if case.proves else (None, None)
    if several and part is not None and _is_all(part, answer.given):
        return answer
    answer = replace(answer, channels=sure_channels(
        case.base, site, case.candidates, case.search.ranked(), explained))
    if part is None or not part.present:
        answer = replace(answer, closest=part)
        return replace(answer, verdict="unconfirmed", doubt=TOGETHER) if several else answer
    if answer.verdict == "unconfirmed":
        part = _with_the_rest(case, part, answer.given)
    shown = part.hypothesis
    others = tuple(h for h in (*answer.given, *answer.others) if h.key != shown.key)
    doubts = {h.key: answer.doubt for h in answer.given if answer.doubt}
    return replace(answer, verdict="partial", given=(shown,), part=part, others=others,
                   reasons={**answer.reasons, **doubts})


def _with_the_rest(case: Case, part: Part, given: Sequence[Hypothesis]) -> Part:
    """The part, shown by an explanation that leaves nothing, although not all of that is sure, if
    one that is given holds what is.
    """
    before = case.predicted(case.base)
    for h in given:
        after = case.predicted(h)
        if before and after and case.adequate(h) and {p.effect.key for p in part.present} <= h.key:
            rest = [k for k in kinds_in(h, case.settings.part.dry)
                    if not k.among([p.kind for p in part.present])]
            why = "it explains the rest, and nothing has confirmed it"
            return replace(
                part, hypothesis=h, overdispersion=case.search.scale(), spread={},
                share=explained_share(before, after), doubtful=tuple(
                    Doubtful(k, members(k, h, case.settings.part.dry)[0], why) for k in rest))
    return part


def _is_all(part: Part, given: Sequence[Hypothesis]) -> bool:
    """Whether every effect that is given is sure by its name."""
    names = {name for p in part.present for name in p.names}
    return all(names & set(e.ids) for h in given for e in h.effects)


def _sure(case: Case) -> tuple[Explanations | None, Part | None]:
    """Explanations with all that they are to be compared with, and what is sure of them."""
    assert case.later is not None
    noise = [{o: records.sigma(o) for o in records.levels[0]}
             for records in (case.records, case.later)]
    search, settings, rule = case.search, case.settings, case.settings.part
    search.spent = 0.0  # what is sure has a budget of its own

    def weighed() -> tuple[Explanations | None, Part | None]:
        evidence = case.evidence(search.ranked())
        found = explanations(evidence, noise)
        return found, None if found is None else surely_there(found, evidence.scale, settings)

    # a search that what happens once has led leaves what lasts half explained
    for _ in range(settings.budget.effects):
        lead = lasting(search.ranked())[0]
        _one_more(search, lead)
        if lasting(search.ranked())[0] is lead:
            break
    explained, part = weighed()
    for _ in range(settings.budget.rechecked):
        if not _compared(search, part.hypothesis if part and part.present else
                         lasting(search.ranked())[0]):
            break
        explained, part = weighed()
    # nothing of an explanation is sure that was not left out of it, of the last one found neither
    while explained and any([
            *(search.refine(_without_each_family(h, rule.dry), h.key)
              for h in explained.leaders(rule.share)), _without_either(search, explained, part)]):
        explained, part = weighed()
    if explained is None or part is None or not part.present:
        return explained, part
    return explained, _without_shares(against_curves(case, explained, part, noise),
                                      _likely(explained, rule.rate))


def _likely(explained: Explanations, rate: float) -> list[Candidate]:
    """The effects that explanations hold whose weights are at least `rate` together."""
    held = {e.key: e for w in explained.weighed for e in w.hypothesis.effects}
    return [e for key, e in held.items() if not smaller(sum(
        w.weight for w in explained.weighed if key in w.hypothesis.key), rate)]


def _one_more(search: Search, lead: Hypothesis, but: Collection[Family] = ()) -> bool:
    """Fit the most promising effects that last beside an explanation's own, but those of some
    families; whether that found anything.
    """
    if len(lead.effects) >= search.settings.budget.effects:
        return False
    screen = Screen(lead, [c for c in beside(lead, search.candidates)
                           if c.lasts and not set(c.families) & set(but)])
    return search.refine([((*lead.effects, c), starts) for c, starts in screen.singles(
        search.settings.budget.beside_one,
        search.settings.search.much * lead.minimum.chi2)], lead.key)


def _without_either(search: Search, explained: Explanations, part: Part | None) -> bool:
    """Fit what may explain as much without both of two families of which one is there; whether that
    found anything.
    """
    found, lead = False, explained.leaders(search.settings.part.share)[0]
    for p in (p for p in part.present if p.instead) if part else ():
        own = {e.key for e in members(p.kind, lead, search.settings.part.dry)}
        if rest := search.fits.get(lead.key - own):
            found |= _one_more(search, rest, [k.family for k in p.kinds])
    return found


def _compared(search: Search, lead: Hypothesis) -> bool:
    """Fit what an explanation is to be compared with: others of its effects' families, laws that
    contain one of them, one law that is the sum of several, curves whose slope a scale error may
    be, and scales that bend as a curve does, and what does best without each effect, or each
    family; whether that found anything.
    """
    found = search.refine([
        *(job for e in lead.effects for job in with_relatives(lead, e, search.candidates)),
        *with_next_form(lead, search.candidates),
        *with_next_sign(lead, search.candidates, search.fits), *with_walls(lead, search.candidates),
        *with_sums(lead, search.candidates), *with_curves(lead, search.candidates),
        *with_bent_scales(lead, search.candidates), *with_wider(lead, search.candidates),
        *_without_each_family(lead, search.settings.part.dry)], lead.key)
    return (not search.budget_exhausted and search.closer([lead])) or found


def _without_each_family(lead: Hypothesis, dry: float) -> list[Job]:
    return [(tuple(e for e in lead.effects if e not in own), [lead.point])
            for k in kinds_in(lead, dry) if (own := members(k, lead, dry))]


def _without_shares(part: Part, likely: Sequence[Candidate]) -> Part:
    """The part without what a law beside it does itself whose form is not sure: a curve of an input
    or sensor has a slope of its own, and a wall that may be a lossy one takes energy out.
    """
    unsure = [p for p in part.present if not p.names]
    curve = next((p for p in unsure if p.family in CURVES), None)
    walls = {p.kind.place: p.effect.name for p in unsure
             if p.family == "restoring force" and p.effect.other_minima}
    lossy = {e.site.v for e in likely if e.covers and e.other_minima}

    def why_not(p: Present) -> str:
        if p.family == "gain" and curve:
            return f"the {curve.family}, whose form is not sure, has a slope of its own"
        if p.family == "drag" and p.kind.place in walls.keys() & lossy:
            return f"{walls[p.kind.place]}, whose form is not sure, takes energy out"
        return ""

    return replace(part, present=tuple(
        _or_its_curve(p) for p in part.present if not why_not(p)), doubtful=(
        *part.doubtful, *(Doubtful(p.kind, p.effect, why) for p in part.present
                          if (why := why_not(p)))))


def _or_its_curve(p: Present) -> Present:
    """Of a scale that bends, that it is there or a curve: either has a slope."""
    if p.family != "gain" or p.effect.known or p.instead is not None:
        return p
    curve: Family = "input curve" if p.effect.channel == "input" else "sensor curve"
    return replace(p, names=(), instead=Instead(Kind(curve), p.effect))
