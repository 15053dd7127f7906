"""Other places: where a law may act instead, and where effects show if the model went far."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.detect.tangent import directions
from pikanid.mismatch.fitting.decisions import steady
from pikanid.mismatch.fitting.descent import start_from
from pikanid.mismatch.fitting.hypothesis import GIVEN, Hypothesis, unfitted
from pikanid.mismatch.search.neighbours import Job


def elsewhere(h: Hypothesis, candidates: Sequence[Candidate]) -> Iterator[Job]:
    """With the same law at each other place in an effect's place, begun where the answer stands, as
    strong as resembles most what the effect does.
    """
    free = h.whitened.problem.free
    for effect in (e for e in h.effects if e.parameters):
        same = [c for c in candidates if c.fits and set(c.ids) & set(effect.ids)
                and c.site != effect.site and c.key not in h.key]
        found = directions(h.whitened, h.minimum.theta, same)
        size = effect.parameters[0]
        does = h.minimum.J @ np.where([f.name == size.name for f in free],
                                      h.minimum.theta - size.value, 0.0)
        # a law at a place that runs away may be too large to be squared
        largest = np.maximum(np.abs(found.D).max(axis=0, initial=0.0), 1e-100)
        signs = found.D / largest
        along, squares = signs.T @ does, np.maximum(np.sum(signs**2, axis=0), 1e-100)
        for k, other in enumerate(same):
            own = np.flatnonzero(found.owner == k)
            if len(own):
                best = own[np.argmax(steady(along[own] ** 2 / squares[own]))]
                amplitude = float(along[best] / squares[best] / largest[best])
                yield (*(e for e in h.effects if e is not effect), other), [
                    start_from(other, found.directions[best], amplitude, h.point)]


def other_places(base: Hypothesis, about: Hypothesis | None) -> Iterator[Hypothesis]:
    """Where effects are looked for besides, if what is missing has led the nominal model away:
    `about` its guess, and where that is far off as well, the guess as it was given.
    """
    if about is not None and led_away(base, about):
        yield about
        records = about.whitened.records
        if about.far and (given := unfitted(about.model, records, records.guess)):
            yield given


def led_away(base: Hypothesis, about: Hypothesis) -> bool:
    """Whether the nominal model went far from its guess to take up what is missing: to a bound, or
    along a valley that the recording hardly closes, other than `about` the guess.
    """
    return (base.far and base.pinned) or any(
        abs(v - base.values[n]) > max(base.std[n], GIVEN * abs(v)) for n, v in about.values.items())
