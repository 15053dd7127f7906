"""One fit of the recordings that a hypothesis was fitted to and of those that it was not."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from operator import lt

import numpy as np

from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.data.whitened import Whitened
from pikanid.mismatch.detect.remainder import residual_tests
from pikanid.mismatch.detect.residual_tests import Detection
from pikanid.mismatch.fitting.descent import impatient
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.fitting.lowest import lowest
from pikanid.optimise.levenberg_marquardt import Minimum


def tested_together(hypothesis: Hypothesis, later: Whitened, apart: Minimum,
                     candidates: tuple[Candidate, ...], rate: float) -> Detection | None:
    """Test what a hypothesis leaves in the recordings that it was fitted to and in others, all
    fitted at once: what is weak in each of them adds up where it is the same in all.

    The fit begins where that of the held-out ones alone ended.
    """
    if (both := fitted_together(hypothesis, later, apart, apart.chi2)) is None:
        return None
    problem, found = both[0].problem, both[1]
    movable = found.movable(problem.lower, problem.upper)
    return residual_tests(both[0], found.theta, found.r, movable, candidates, rate)


def fitted_together(hypothesis: Hypothesis, later: Whitened, apart: Minimum, left: float
                     ) -> tuple[Whitened, Minimum] | None:
    """One fit of all recordings, of which the later ones alone leave χ² of about `left`; none of
    what happens once: that is not the same in all.
    """
    if any(e.absent for e in hypothesis.effects):
        return None
    first = hypothesis.whitened
    count = len(first.records.recordings)
    whitened = Whitened(hypothesis.model, first.records.beside(later.records))
    whitened.step_as(first, later)
    own = {(f.name, f.recording): v for f, v in zip(
        first.problem.free, hypothesis.minimum.theta, strict=True)}
    own |= {(f.name, None if f.recording is None else f.recording + count): v
            for f, v in zip(later.problem.free, apart.theta, strict=True)}
    problem = whitened.problem
    start = np.array([own[f.name, f.recording] for f in problem.free])
    found = lowest(whitened, start, first.settings.budget.held_out)
    if found is None:
        return None
    if found.chi2 > hypothesis.minimum.chi2 + left + first.settings.verdict.missed:
        found = _from_levels(whitened, hypothesis, found)
    return whitened, found


def part_of(both: tuple[Whitened, Minimum], later: Whitened) -> np.ndarray:
    """θ (n,) of the later recordings in a fit of all."""
    whitened, found = both
    first = len(whitened.simulators) - len(later.simulators)
    values = {(f.name, f.recording): v
              for f, v in zip(whitened.problem.free, found.theta, strict=True)}
    return np.array([values[f.name, None if f.recording is None else f.recording + first]
                     for f in later.problem.free])


def _from_levels(whitened: Whitened, hypothesis: Hypothesis, found: Minimum) -> Minimum:
    """The closest of fits that begin where laws without a first step to them may act: a wall that
    was touched once can be soft or hard, and only other recordings tell which.
    """
    problem = whitened.problem

    def at(theta: np.ndarray, values: Mapping[str, float]) -> np.ndarray:
        both = zip(problem.free, theta, strict=True)
        return np.array([values.get(f.name, v) for f, v in both])

    for effect in hypothesis.effects:
        # where a law does not act at all, others do as well
        seen = {whitened.chi2(theta): theta
                for theta in (at(found.theta, level) for level in effect.levels)}
        for chi2 in sorted(seen)[:whitened.settings.budget.levels]:
            theta, name = seen[chi2], effect.parameters[0].name
            size = next(v for f, v in zip(problem.free, theta, strict=True) if f.name == name)
            beside = [at(theta, {name: share * size}) for share in (1.0, *effect.other_minima)]
            theta = min(beside, key=whitened.chi2)
            if whitened.choose_steps(theta):
                other = lowest(whitened, theta, whitened.settings.budget.held_out,
                               impatient(partial(lt, found.chi2), whitened.settings))
                found = min(found, other or found, key=lambda m: m.chi2)
    return found
