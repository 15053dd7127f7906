"""Hypotheses next to one: an effect left out, or another one in its place.

Each comes with the starts of its fit, on from where the hypothesis stands.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace

from pikanid.mismatch.catalogue.candidate import CURVES, Candidate
from pikanid.mismatch.detect.tangent import directions
from pikanid.mismatch.fitting.descent import Start
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.search.in_its_place import in_its_place
from pikanid.mismatch.search.screen import Screen, as_strong

WIDER = (0.3, 1.0, 3.0)  # numerical: of the last parameter of a wider law, where fits of it begin
LIKE = 0.5  # numerical: share of what a law does, from which on an open shape is tried
Starts = Sequence[Start | Mapping[str, float]]
Job = tuple[Sequence[Candidate], Starts]


def without_one(h: Hypothesis) -> Iterator[Job]:
    """The hypothesis without each of its effects, where it has several."""
    for effect in h.effects if len(h.effects) > 1 else ():
        yield _rest(h, effect), [h.point]


def beside(h: Hypothesis, candidates: Sequence[Candidate]) -> list[Candidate]:
    """What may be added to a hypothesis."""
    return [c for c in _suiting(h, candidates) if not (c.absent and h.far)]


def _suiting(h: Hypothesis, candidates: Sequence[Candidate]) -> list[Candidate]:
    groups = {e.alike for e in h.effects if e.alike}
    return [c for c in candidates if c.fits and c.suits(h.effects) and c.key not in h.key
            and c.alike not in groups]


def afresh(h: Hypothesis, guess: Mapping[str, float]) -> Iterator[Job]:
    """The same, begun where the nominal model was given, which alone may have been led into another
    minimum; and effects begun where what it leaves shows them as well: a mode, or a moment, may
    have been a wrong one.
    """
    yield h.effects, [h.point_with(guess)]
    for effect in h.effects:
        if len(effect.parameters) > 2:
            for _, starts in Screen(h, [effect]).singles(1):
                yield h.effects, starts


def with_events(h: Hypothesis, candidates: Sequence[Candidate],
                fits: Mapping[frozenset[str], Hypothesis]) -> Iterator[Job]:
    """With what happens once beside a hypothesis, and in the place of each of its effects, however
    much is left there: a push that is as loud as all the rest is beside nothing but that.
    """
    for key in (h.key, *(h.key - {e.key} for e in h.effects)):
        about = fits.get(key)
        if about is not None and about.effects and about.far:
            events = [c for c in _suiting(about, candidates) if c.absent]
            for event, starts in Screen(about, events).singles(1):
                yield (*about.effects, event), starts


def from_its_place(h: Hypothesis, rivals: Iterable[Hypothesis], base: Hypothesis) -> Iterator[Job]:
    """Rivals once more, from where a hypothesis has the parameters of the model (`base`): what a
    valley has led elsewhere would be dismissed for where it went, not for what it is.
    """
    theirs = {n: v for n, v in h.point.items() if n in base.point}
    for rival in rivals:
        if rival.effects and rival.key != h.key:
            yield rival.effects, [{**rival.point, **theirs}]


def with_simpler(h: Hypothesis, candidates: Sequence[Candidate]) -> Iterator[Job]:
    """With a law that one of its effects contains in that one's place."""
    for effect in h.effects:
        for simple in candidates:
            if simple.key in effect.covers and simple.key not in h.key and not effect.next_to:
                size = as_strong(h, effect, simple)
                yield (*_rest(h, effect), simple), [
                    {**h.point, simple.parameters[0].name: size * share} for share in (1.0, 2.0)]


def with_wider(h: Hypothesis, candidates: Sequence[Candidate]) -> Iterator[Job]:
    """With what contains one of its effects as a special case in that one's place: the law of free
    exponent, and laws outside the catalogue.
    """
    for effect in h.effects:
        for other in candidates:
            if effect.key in other.covers and not other.next_to:  # that has starts of its own
                yield _wider(h, effect, other, effect.key)


def with_shapes(h: Hypothesis, candidates: Sequence[Candidate]) -> Iterator[Job]:
    """With the shape of one of its effects left open: what an ideal law lacks another effect may
    make up for.
    """
    yield from with_wider(h, [c for c in candidates if c.refines])


def with_cousins(h: Hypothesis, candidates: Sequence[Candidate]) -> Iterator[Job]:
    """With what contains the same special case as one of its effects does in that one's place: dry
    friction that is rounded, for a law of free exponent.
    """
    for effect in h.effects:
        for other in candidates:
            shared = [key for key in other.covers if key in effect.covers]
            if shared and other.key not in h.key and effect.key not in other.covers:
                yield _wider(h, effect, other, shared[0])


def _wider(h: Hypothesis, effect: Candidate, other: Candidate, special: str) -> Job:
    """With a law in an effect's place, begun near what is a special case of it."""
    rest = [e for e in h.effects if e is not effect and e is not other]
    size, *more = other.parameters
    if begun := other.covers[special]:
        there = {**h.values, **begun}  # what both have stays as it is
        starts = [{size.name: as_strong(h, effect, other, [there[p.name] for p in more]), **begun}]
    else:
        starts = [{size.name: as_strong(h, effect, other),
                   **{p.name: p.value for p in more if p.name not in h.point},
                   more[-1].name: share * more[-1].value} for share in WIDER]
    return (*rest, other), [{**h.point, **start} for start in starts]


def with_next_form(h: Hypothesis, candidates: Sequence[Candidate]) -> Iterator[Job]:
    """With each law of the form next to one of its effects in that one's place."""
    for effect in h.effects:
        near = [c for c in candidates if c.next_to == effect.key and c.starts is not None]
        states = h.whitened.motion(h.minimum.theta) if near else {}
        for other in near:
            assert other.starts is not None
            yield (*_rest(h, effect), other), [
                {**h.point, **start} for start in other.starts(h.values, states)]


def with_next_sign(h: Hypothesis, candidates: Sequence[Candidate],
                   fits: Mapping[frozenset[str], Hypothesis]) -> Iterator[Job]:
    """The same of laws that show where their fits begin in what is left without the effect: where
    the model was fitted without it, and where it stands beside it.
    """
    for effect in h.effects:
        near = [replace(c, directions=c.signs) for c in candidates
                if c.next_to == effect.key and c.signs is not None]
        without = fits.get(h.key - {effect.key})
        if near and without is not None:
            for other, starts in Screen(without, near).singles(len(near)):
                yield (*_rest(h, effect), other), starts
        for other in near:
            yield (*_rest(h, effect), other), in_its_place(h, effect, other)


def with_open_shape(h: Hypothesis, candidates: Sequence[Candidate],
                    fits: Mapping[frozenset[str], Hypothesis]) -> Iterator[Job]:
    """With a law of open shape in another's place, if the ideal law does half of what that does."""
    for effect in (e for e in h.effects if e.channel == "dynamics"):
        without = fits.get(rest := h.key - {effect.key})
        for other in (c for c in candidates if c.refines and c.site.v == effect.site.v):
            ideal = other.ids[0] + other.site.suffix
            known = fits.get(rest | {ideal})
            if known and without and not {other.key, ideal} & h.key and known.minimum.chi2 < (
                    LIKE * h.minimum.chi2 + (1 - LIKE) * without.minimum.chi2):
                yield _wider(known, next(e for e in known.effects if e.key == ideal), other, ideal)


def with_other_form(h: Hypothesis, candidates: Sequence[Candidate],
                    fits: Mapping[frozenset[str], Hypothesis]) -> Iterator[Job]:
    """With what keeps the name of one of its effects away, if that acts instead, in its place."""
    yield from with_wider(h, candidates)
    yield from with_cousins(h, candidates)
    yield from with_next_form(h, candidates)
    yield from with_next_sign(h, candidates, fits)
    yield from with_open_shape(h, candidates, fits)


def with_parts(h: Hypothesis, candidates: Sequence[Candidate]) -> Iterator[Job]:
    """With the sum of other laws that one of its effects is in that one's place."""
    by_key = {c.key: c for c in candidates}
    for effect in (e for e in h.effects if e.parts):
        assert effect.parts is not None
        rest = {e.key: e for e in _rest(h, effect)}
        for parts in effect.parts([h.values[p.name] for p in effect.parameters]):
            if parts.keys() <= by_key.keys():
                start = {p.name: v + (h.values[p.name] if key in rest else 0.0)
                         for key, values in parts.items()
                         for p, v in zip(by_key[key].parameters, values, strict=True)}
                found = {**rest, **{key: by_key[key] for key in parts}}
                if len(found) <= h.whitened.settings.budget.effects:
                    yield [*found.values()], [{**h.point, **start}]


def with_sums(h: Hypothesis, candidates: Sequence[Candidate]) -> Iterator[Job]:
    """With the one law that several of its effects are the sum of in their place."""
    for law in candidates:
        for parts in law.parts([1.0] * len(law.parameters)) if law.parts else ():
            own = [e for e in h.effects if e.key in parts]
            sizes = [h.values[e.parameters[0].name] / parts[e.key][0] for e in own]
            if len(own) == len(parts) and min(sizes) > 0:
                yield (*(e for e in h.effects if e not in own), law), [
                    {**h.point, law.parameters[0].name: sum(sizes) / len(sizes)}]


def reduced(h: Hypothesis, candidates: Sequence[Candidate]) -> Iterator[Job]:
    """Without an effect, or with less than it in its place."""
    yield from without_one(h)
    yield from with_simpler(h, candidates)
    yield from with_parts(h, candidates)


def with_twins(h: Hypothesis, candidates: Sequence[Candidate]) -> Iterator[Job]:
    """With what small motions cannot tell from one of its effects in that one's place, as strong if
    that has a unit in common.
    """
    for effect in h.effects:
        for other in candidates:
            alike = (effect.alike and other.alike == effect.alike) or (
                set(effect.ids) & set(other.instead_of))
            if alike and other.fits and other.key not in h.key:
                sizes = zip(effect.parameters[:1], other.parameters[:1], strict=False)
                start = {there.name: as_strong(h, effect, other) for size, there in sizes
                         if size.unit == there.unit}
                yield (*_rest(h, effect), other), [{**h.point, **start}]


def with_relatives(h: Hypothesis, effect: Candidate, candidates: Sequence[Candidate]
                   ) -> Iterator[Job]:
    """Every other member of an effect's families in that one's place, but forms next to members."""
    for other in candidates:
        if (other.fits and not other.next_to and other.key not in h.key
                and other.site.v == effect.site.v and set(other.families) & set(effect.families)):
            yield (*_rest(h, effect), other), [h.point]


def with_curves(h: Hypothesis, candidates: Sequence[Candidate]) -> Iterator[Job]:
    """With each curve of a channel in the place of a scale error, which may be its slope, from
    every level at which it may act: what a dead zone takes off is far from nothing.
    """
    curves = [c for c in candidates if c.fits and not c.next_to and c.key not in h.key
              and set(c.families) & set(CURVES)]
    gains = [e for e in h.effects if "gain" in e.families]
    if not curves or not gains:
        return
    found = directions(h.whitened, h.minimum.theta, curves)
    for k, curve in enumerate(curves):
        starts = [{**h.point, **sign.start} for sign, owner in zip(
            found.directions, found.owner, strict=True) if owner == k and not sign.scales]
        for gain in gains:
            yield (*_rest(h, gain), curve), starts or [h.point]


def with_bent_scales(h: Hypothesis, candidates: Sequence[Candidate]) -> Iterator[Job]:
    """With each scale of an input that bends in the place of a curve of one: at the few levels that
    a switched input has, all of them pass through the same points.
    """
    bent = [c for c in candidates
            if c.next_to and c.channel == "input" and "gain" in c.families and c.key not in h.key]
    for effect in h.effects:
        if "input curve" in effect.families:
            yield from (((*_rest(h, effect), c), [h.point]) for c in bent)


def with_walls(h: Hypothesis, candidates: Sequence[Candidate]) -> Iterator[Job]:
    """With each wall in the place of a limit of the sensor, at that limit: where a reading stops,
    the motion may.
    """
    for effect in h.effects:
        ids = {*effect.ids, effect.next_to.partition("[")[0]}
        for wall in (c for c in candidates if ids & set(c.stops_like) and c.key not in h.key
                     and c.site.output.name == effect.site.output.name):
            limit = abs(h.values[effect.parameters[0].name])
            place, stiffness, *_ = (p.name for p in wall.parameters)
            yield (*_rest(h, effect), wall), [
                {**h.point, place: limit, stiffness: at}
                for at in sorted({level[stiffness] for level in wall.levels})]


def _rest(h: Hypothesis, effect: Candidate) -> tuple[Candidate, ...]:
    return tuple(e for e in h.effects if e is not effect)


def signature(job: Job) -> object:
    """Tells a job from others: its effects, and where its fits begin."""
    effects, starts = job
    return frozenset(e.key for e in effects), tuple(
        (tuple(sorted(s.values.items())), tuple(sorted(s.origin.items())))
        if isinstance(s, Start) else tuple(sorted(s.items())) for s in starts)
