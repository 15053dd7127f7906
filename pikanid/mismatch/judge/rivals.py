"""Explanations that differ in one effect: what stands in its place, and what is the same law."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.fitting.decisions import smaller
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.judge.explanations import Weighed
from pikanid.mismatch.judge.kinds import Kind, holds


def twins(effect: Candidate, lead: Weighed, holders: Sequence[Weighed], enough: float
           ) -> tuple[Candidate, ...]:
    """What small motions cannot tell from an effect, in explanations that leave less than
    `enough` with it in its place.
    """
    own = {e.key for e in lead.hypothesis.effects}
    found = {e.key: e for w in holders if smaller(w.left, enough)
             and all(e.key != effect.key for e in w.hypothesis.effects)
             for e in w.hypothesis.effects if e.alike and e.alike == effect.alike and e.known
             and not set(e.ids) <= set(effect.ids)}
    return tuple(e for key, e in found.items() if key not in own)


def rivals(kind: Kind, effect: Candidate, own: Hypothesis, found: Iterable[Weighed]
           ) -> list[Weighed]:
    """Explanations with another effect of a kind in the place of one of `own`; a law that contains
    the effect is no rival.
    """
    return [w for w in found if kind.among(w.kinds) and not same(w.hypothesis, effect, own)
            and not wider(w.hypothesis, effect)]


def same(h: Hypothesis, effect: Candidate, own: Hypothesis) -> bool:
    """Whether a hypothesis holds an effect of `own`, or in a brief contact a shape of it."""
    brief = effect.brief is not None and effect.brief(own.values)
    return holds(h, effect) or (brief and any(
        set(e.shape_of) & set(effect.ids) and e.site.v == effect.site.v for e in h.effects))


def wider(h: Hypothesis, effect: Candidate) -> bool:
    """Whether one of its laws has an effect as a special case, or is a sum of which it is one."""
    return any(effect.key in law.covers or any(effect.key in parts for parts in (
        law.parts([p.value for p in law.parameters]) if law.parts else ())) for law in h.effects)
