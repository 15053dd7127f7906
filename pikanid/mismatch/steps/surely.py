"""From an answer that leaves something to what is surely there nevertheless."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from pikanid.mismatch.beyond.patch import FreeCurve
from pikanid.mismatch.case import Case
from pikanid.mismatch.fitting.decisions import smaller
from pikanid.mismatch.fitting.hypothesis import Hypothesis, fitted
from pikanid.mismatch.judge.partial import Part, Present, lasting, left_over, surely_there
from pikanid.mismatch.judge.verdict import Answer
from pikanid.mismatch.search.neighbours import with_next_form, with_relatives
from pikanid.mismatch.search.search import Search


def with_sure_part(case: Case, answer: Answer) -> Answer:
    """The answer, where not everything is explained, with what is surely there nevertheless."""
    if not case.proves or case.later is None or answer.verdict not in (
            "unconfirmed", "unnamed"):
        return answer
    noise = [{name: level.sigma for name, level in records.levels[0].items()}
             for records in (case.records, case.later)]
    search = case.search

    def sure() -> Part | None:
        return surely_there(search.ranked(), search.scale(), case.predicted, noise, case.settings,
                            case.ahead)

    part = sure()
    for _ in range(case.settings.budget.rechecked):
        if not _compared(search, part.hypothesis if part else lasting(search.ranked())[0]):
            break
        part = sure()
    if part is None:
        return answer
    part = replace(part, present=tuple(
        p if _has_its_form(case, part, p, noise) else replace(p, names=()) for p in part.present))
    return replace(answer, verdict="partial", given=(part.hypothesis,), part=part)


def _compared(search: Search, lead: Hypothesis) -> bool:
    """Fit what an explanation is to be compared with: others of its effects' families, and what
    does best without each effect, or each family; whether that found anything.
    """
    families = sorted({f for e in lead.effects for f in e.families})
    without = [tuple(e for e in lead.effects if f not in e.families) for f in families]
    found = search.refine([
        *(job for e in lead.effects for job in with_relatives(lead, e, search.candidates)),
        *with_next_form(lead, search.candidates),
        *((rest, [lead.point]) for rest in without)])
    return search.closer([lead]) or found


def _has_its_form(case: Case, part: Part, p: Present, noise: Sequence[dict[str, float]]) -> bool:
    """Whether a free curve of the state that a law depends on leaves about as much beside it."""
    h, site = part.hypothesis, p.effect.site
    argument = {"dry friction": site.v, "drag": site.v, "restoring force": site.q}.get(p.family)
    before = case.predicted(h)
    if not p.names or argument is None or before is None or p.effect not in h.effects:
        return True
    visited = h.whitened.motion(h.minimum.theta)[argument]
    curve = FreeCurve(argument, float(visited.min()), float(visited.max()), h.model)
    effects = [*h.effects, curve.candidate(site)]
    found = fitted(case.model, effects, h.whitened.records, [h.point], 1)
    after = None if found is None else case.predicted(found)
    if found is None or after is None:
        return True
    rule = case.settings.part
    left = max(left_over(found, after, noise), rule.floor)
    return smaller(left_over(h, before, noise) / left, rule.form)
