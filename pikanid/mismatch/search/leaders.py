"""Which hypotheses a search goes on from."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from pikanid.mismatch.fitting.decisions import in_order
from pikanid.mismatch.fitting.hypothesis import Hypothesis


def leading(ranked: Iterable[Hypothesis]) -> list[Hypothesis]:
    """Hypotheses to extend, best first: none that only adds effects to a better one."""
    found: list[Hypothesis] = []
    for h in ranked:
        if h.effects and not any(o.key < h.key for o in found):
            found.append(h)
    return found


def an_event(h: Hypothesis) -> bool:
    """Whether it is what happens once, alone: that may be beside anything that lasts, whatever the
    search for it has cost.
    """
    return len(h.effects) == 1 and h.effects[0].absent


def wide(h: Hypothesis, fits: Mapping[frozenset[str], Hypothesis]) -> bool:
    """Whether a law that one of its effects contains does nearly as well in that one's place: then
    more is added to the simpler one.
    """
    far = h.whitened.settings.fits.far
    simpler = (fits.get(h.key - {e.key} | {part}) for e in h.effects for part in e.covers)
    return any(o is not None and o.minimum.chi2 < far * h.minimum.chi2 for o in simpler)


def to_extend(ranked: Sequence[Hypothesis], fits: Mapping[frozenset[str], Hypothesis]
              ) -> list[Hypothesis]:
    """Hypotheses that effects are added to, best first: the leading ones that are not wide.

    From far off all that is left counts for a few rows, and a price is more than any gain: there
    what leaves least comes first.
    """
    if ranked[0].far:
        ranked = in_order(ranked, lambda h: h.minimum.chi2, Hypothesis.place)
    return [h for h in leading(ranked) if not wide(h, fits)] or [*ranked[:1]]


def closest_of_each(fits: Iterable[Hypothesis]) -> list[Hypothesis]:
    """The hypothesis that fits best of each number of effects from two on, most effects first.

    What a first step out of a large misfit does not see can come to light beside another effect,
    which then has to go.
    """
    several = [h for h in fits if len(h.effects) > 1 and h.known]
    counts = sorted({len(h.effects) for h in several}, reverse=True)
    return [min((h for h in several if len(h.effects) == n), key=lambda h: h.minimum.chi2)
            for n in counts]


def siblings(h: Hypothesis, ranked: Iterable[Hypothesis]) -> list[Hypothesis]:
    """The best of those that have another effect of the same family in the place of one, however
    far behind: they may have been led elsewhere.
    """
    return [o for o in ranked if _are_siblings(o, h)][:h.whitened.settings.budget.rivals]


def _are_siblings(one: Hypothesis, other: Hypothesis) -> bool:
    own = [e for e in one.effects if e.key not in other.key]
    theirs = [e for e in other.effects if e.key not in one.key]
    return len(own) == len(theirs) == 1 and bool({*own[0].families} & {*theirs[0].families})
