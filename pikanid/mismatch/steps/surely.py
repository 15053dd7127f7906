"""From an answer that leaves something to what is surely there nevertheless."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from pikanid.mismatch.beyond.free_channels import sure_channels
from pikanid.mismatch.beyond.free_curve import (
    with_free_curve,
    with_free_input,
    with_free_sensor,
)
from pikanid.mismatch.case import Case
from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.catalogue.site import Site
from pikanid.mismatch.fitting.decisions import smaller
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.judge.explanations import Explanations, explanations, lasting
from pikanid.mismatch.judge.kinds import kinds_in, members
from pikanid.mismatch.judge.left_over import left_in_train, left_over
from pikanid.mismatch.judge.partial import Doubtful, Part, Present, surely_there
from pikanid.mismatch.judge.verdict import Answer
from pikanid.mismatch.search.neighbours import (
    Job,
    beside,
    with_next_form,
    with_relatives,
    with_walls,
)
from pikanid.mismatch.search.screen import Screen
from pikanid.mismatch.search.search import Search
from pikanid.model import Model

CURVES = ("input curve", "sensor curve")  # definition: families of laws of one channel


def with_sure_part(case: Case, answer: Answer, site: Site) -> Answer:
    """The answer, where not everything is explained, with what is surely there nevertheless, and
    the channels in which something is.
    """
    if answer.verdict not in ("unconfirmed", "unnamed"):
        return answer
    explained, part = _sure(case) if case.proves else (None, None)
    answer = replace(answer, channels=sure_channels(
        case.base, site, case.candidates, case.search.ranked(), explained))
    if part is None or not part.present:
        return answer
    return replace(answer, verdict="partial", given=(part.hypothesis,), part=part)


def _sure(case: Case) -> tuple[Explanations | None, Part | None]:
    """Explanations with all that they are to be compared with, and what is sure of them."""
    assert case.later is not None
    noise = [{name: level.sigma for name, level in records.levels[0].items()}
             for records in (case.records, case.later)]
    search, settings = case.search, case.settings
    search.spent = 0.0  # what is sure has a budget of its own

    def weighed() -> tuple[Explanations | None, Part | None]:
        found = explanations(search.ranked(), search.scale(), case.predicted, noise, settings,
                             case.ahead)
        return found, None if found is None else surely_there(found, search.scale(), settings)

    # a search that what happens once has led leaves what lasts half explained
    for _ in range(settings.budget.effects):
        lead = lasting(search.ranked())[0]
        _one_more(search, lead)
        if lasting(search.ranked())[0] is lead:
            break
    explained, part = weighed()
    for _ in range(settings.budget.rechecked):
        if not _compared(search, part.hypothesis if part else lasting(search.ranked())[0]):
            break
        explained, part = weighed()
    # nothing of an explanation is sure that was not left out of it, of the last one found neither
    while explained and any([search.refine(_without_each_family(h, settings.part.dry), h.key)
                             for h in explained.leaders]):
        explained, part = weighed()
    if explained is None or part is None:
        return explained, None
    return explained, _without_shares(_against_curves(case, part, noise),
                                      _likely(explained, settings.part.rate))


def _likely(explained: Explanations, rate: float) -> list[Candidate]:
    """The effects that explanations hold whose weights are at least `rate` together."""
    held = {e.key: e for w in explained.weighed for e in w.hypothesis.effects}
    return [e for key, e in held.items() if not smaller(sum(
        w.weight for w in explained.weighed if key in w.hypothesis.key), rate)]


def _one_more(search: Search, lead: Hypothesis) -> None:
    """Fit the most promising effects that last beside an explanation's own."""
    if len(lead.effects) < search.settings.budget.effects:
        screen = Screen(lead, [c for c in beside(lead, search.candidates) if c.lasts])
        search.refine([((*lead.effects, c), starts) for c, starts in screen.singles(
            search.settings.budget.beside_one,
            search.settings.search.much * lead.minimum.chi2)], lead.key)


def _compared(search: Search, lead: Hypothesis) -> bool:
    """Fit what an explanation is to be compared with: others of its effects' families, and what
    does best without each effect, or each family; whether that found anything.
    """
    found = search.refine([
        *(job for e in lead.effects for job in with_relatives(lead, e, search.candidates)),
        *with_next_form(lead, search.candidates), *with_walls(lead, search.candidates),
        *_without_each_family(lead, search.settings.part.dry)], lead.key)
    return (not search.budget_exhausted and search.closer([lead])) or found


def _without_each_family(lead: Hypothesis, dry: float) -> list[Job]:
    return [(tuple(e for e in lead.effects if e not in own), [lead.point])
            for k in kinds_in(lead, dry) if (own := members(k, lead, dry))]


def _against_curves(case: Case, part: Part, noise: Sequence[dict[str, float]]) -> Part:
    """What is there still once free curves of the states stand for laws that nobody has listed.

    A family is not sure where a free curve in its place leaves little more, of a state that its
    members do not depend on: a magnet is no friction with a memory.  A name is not where a free
    curve beside it, of the state that it depends on, leaves far less: then its form is another one.
    """
    h, rule = part.hypothesis, case.settings.part
    before = case.predicted(h)
    if before is None:
        return part
    own_left = left_over(h, before, noise)
    present, doubtful = [], list(part.doubtful)
    for p in part.present:
        own = members(p.kind, h, rule.dry)
        argument = _argument(p)
        rest = [e for e in h.effects if e not in own]
        others = [s for s in p.effect.site.moving if s != argument]
        # a curve holds a constant, too
        enough = p.dominance * max(own_left, rule.floor)
        rivals = [] if p.family == "constant force" or not own else [
            _left_with_curve(case, h, rest, s, p.effect.site, noise, enough) for s in others]
        kappa = min(rivals, default=np.inf) / max(own_left, rule.floor)
        if smaller(kappa, rule.dominance_of(p.family)):
            doubtful.append(Doubtful(p.kind, p.effect, "a free curve of a state it does not "
                                     f"depend on leaves {kappa:.2g} times as much in its place, "
                                     f"{rule.dominance_of(p.family):.2g} are asked"))
            continue
        if p.names and own:
            beside = min((_left(case, found, noise, own_left / rule.form)
                          for found in _with_its_form_free(case.model, h, p, argument)),
                         default=np.inf)
            if not smaller(own_left / max(beside, rule.floor), rule.form):
                p = replace(p, names=())
        present.append(replace(p, dominance=min(p.dominance, float(kappa))))
    return replace(part, present=tuple(present), doubtful=tuple(doubtful))


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

    return replace(part, present=tuple(p for p in part.present if not why_not(p)), doubtful=(
        *part.doubtful, *(Doubtful(p.kind, p.effect, why) for p in part.present
                          if (why := why_not(p)))))


def _argument(p: Present) -> str:
    """The state that a family's members depend on; empty where it is none, or several."""
    site = p.effect.site
    states = {"dry friction": site.v, "drag": site.v, "restoring force": site.q}
    return states.get(p.family, p.effect.argument)


def _with_its_form_free(nominal: Model, h: Hypothesis, p: Present, argument: str,
                        ) -> Iterator[Hypothesis | None]:
    """An explanation with a free curve beside a named effect, of what that one's law depends on."""
    site = p.effect.site
    if p.family == "input curve":
        yield from (with_free_input(nominal, h, u, site) for u in site.inputs)
    elif p.family == "sensor curve":
        yield with_free_sensor(nominal, h, site)
    elif argument:
        yield with_free_curve(nominal, h, h.effects, argument, site)


def _left_with_curve(case: Case, h: Hypothesis, effects: Sequence[Candidate], argument: str,
                     site: Site, noise: Sequence[dict[str, float]], enough: float) -> float:
    """What these effects and a free curve of a state leave; infinite where that cannot be run."""
    return _left(case, with_free_curve(case.model, h, effects, argument, site), noise, enough)


def _left(case: Case, found: Hypothesis | None, noise: Sequence[dict[str, float]], enough: float
          ) -> float:
    """What a fit leaves in all recordings; in the train ones alone where more than `enough`, which
    decides, is left in these already.
    """
    if found is None:
        return np.inf
    seen = left_in_train(found, noise)
    if smaller(enough, seen):
        return seen
    after = case.predicted(found)
    return np.inf if after is None else left_over(found, after, noise)
