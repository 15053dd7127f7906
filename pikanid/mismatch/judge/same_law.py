"""Hypotheses that are one law under several names: whole exponents and free ones, and twins."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.settings.verdict import VerdictSettings
from pikanid.model.parts import Parameter


def integer_laws(near: list[Hypothesis], asks: VerdictSettings) -> list[Hypothesis]:
    """A power law whose exponent is sharply a whole number is left to the law of that name."""
    kept = [h for h in near if not any(
        (gap := _exponent_gap(h, whole)) is not None and gap < asks.whole and _sharp(h, asks)
        for whole in (0, 1, 2))]
    return kept or near


def _exponent(h: Hypothesis) -> str | None:
    """Name of the exponent of a hypothesis' power law, if it has one."""
    return next((e.exponent.name for e in h.effects if isinstance(e.exponent, Parameter)), None)


def _exponent_gap(h: Hypothesis, whole: float) -> float | None:
    """Standard errors between that exponent and a whole number; one at its lower bound is zero."""
    n = _exponent(h)
    if n is None:
        return None
    if whole == 0 and h.values[n] <= h.model.parameter(n).bounds[0]:
        return 0.0
    return abs(h.values[n] - whole) / max(h.std[n], 1e-9)


def _sharp(h: Hypothesis, asks: VerdictSettings) -> bool:
    n = _exponent(h)
    return n is not None and h.std[n] < asks.sharp


def _open_exponent(h: Hypothesis, whole: float, asks: VerdictSettings) -> bool:
    """Whether the exponent of a hypothesis' power law may be `whole`, or something else as well."""
    gap = _exponent_gap(h, whole)
    return gap is not None and gap < asks.open and not (
        gap < asks.whole and _sharp(h, asks))


def _power_law(h: Hypothesis, effect: Candidate, tried: Sequence[Hypothesis]
               ) -> tuple[Hypothesis, Candidate] | None:
    """The hypothesis with a law of free exponent in the place of one of `h`'s effects, and that
    law.
    """
    rest = h.key - {effect.key}
    return next(((o, e) for o in tried for e in o.effects
                 if effect.key in e.covers and e.known and isinstance(e.exponent, Parameter)
                 and o.key == rest | {e.key}), None)


def _whose_limit(h: Hypothesis, effect: Candidate, known: Sequence[Hypothesis],
                 asks: VerdictSettings) -> Iterator[tuple[Hypothesis, Candidate]]:
    """The hypotheses with a law in the place of one of `h`'s effects whose limit that one is, and
    that the recording does not tell from it; and those laws.
    """
    rest = h.key - {effect.key}
    for o in known:
        for e in o.effects:
            if (e.limit and e.site.v == effect.site.v and {*e.limit.ids} & {*effect.ids}
                    and o.key == rest | {e.key}
                    and o.values[e.limit.parameter] < asks.open * o.std[e.limit.parameter]):
                yield o, e


class Names(NamedTuple):
    """What an effect and those that stand for it are called: ids, and in words."""

    ids: tuple[str, ...]
    words: tuple[str, ...]

    def and_also(self, ids: Iterable[str], *words: str) -> Names:
        """With those of another one."""
        return Names(tuple(dict.fromkeys((*self.ids, *ids))),
                     tuple(dict.fromkeys((*self.words, *words))))


def signature(h: Hypothesis) -> frozenset[str]:
    """Its effects, whatever their shapes are and which of twins they are."""
    return frozenset(map(_group, h.effects))


def _group(e: Candidate) -> str:
    if e.alike:
        return e.alike
    return e.ids[0] + e.site.suffix if e.refines else e.key


def merged_twins(known: list[Hypothesis], tried: Sequence[Hypothesis], asks: VerdictSettings
                 ) -> tuple[list[Hypothesis], dict[frozenset[str], dict[str, Names]]]:
    """Hypotheses that differ in twins only become one; what stands for what is noted.

    A law of whole exponent has the power law as a twin where the recording leaves the exponent
    open, and an effect that has another one as its limit that where it is narrow, or may be
    nothing.  An entry in two shapes is one.
    """
    first: dict[frozenset[str], Hypothesis] = {}
    twins: dict[frozenset[str], dict[str, Names]] = {}
    absorbed = set()
    for h in known:
        leader = first.setdefault(signature(h), h)
        table = twins.setdefault(
            leader.key, {e.key: Names(e.names, (e.name,)) for e in leader.effects})
        for e in leader.effects:
            for o in h.effects:
                if _group(o) == _group(e):
                    # another shape or side of an entry goes by its name
                    new = e.alike and not {*o.names} <= {*table[e.key].ids}
                    table[e.key] = table[e.key].and_also(o.names, *([o.name] if new else []))
        for e in h.effects:
            if leader is h and isinstance(e.exponent, int | float) and (
                    wider := _power_law(h, e, tried)) and _open_exponent(
                        wider[0], e.exponent, asks):
                table[e.key] = table[e.key].and_also(wider[1].names)
                absorbed.add(wider[0].key)
            for wider_one, law in _whose_limit(h, e, known, asks) if leader is h else ():
                table[e.key] = table[e.key].and_also(law.names)
                absorbed.add(wider_one.key)
            if leader is h and e.limit and (
                    h.values[e.limit.parameter] < asks.narrow * e.site.half_range):
                table[e.key] = table[e.key].and_also(e.limit.ids)
    return [h for h in first.values() if h.key not in absorbed], twins
