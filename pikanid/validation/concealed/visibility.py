"""How visible is a hidden effect, and what else could explain the recording?

The nominal model and every effect of the catalogue (rival) are refitted to the truth without
noise; all differ from the truth by some distance D in σ.  A truth is *nameable* where the nominal
model is at least 5σ away and the best rival that is no twin at least 4σ.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from pikanid import errors
from pikanid.validation.concealed.arrays import Array
from pikanid.validation.concealed.candidate import Candidate, nominal_fit, starts
from pikanid.validation.concealed.effect import Effect, Quantity, Scales
from pikanid.validation.concealed.effects import CATALOGUE
from pikanid.validation.concealed.experiment import Experiment
from pikanid.validation.concealed.fisher import Refit, unexplained
from pikanid.validation.concealed.noise import Noise
from pikanid.validation.concealed.rig import Rig

# A set of concealed cases is a function of its seed alone: none of these can be set.
FROM_NOMINAL, FROM_RIVAL = 5.0, 4.0  # definition: [σ] of a nameable truth
# Rivals that get a rough refit after the screening to first order, and a full one after that.
ROUGH, FULL = 12, 6  # definition: numbers of refits
ROUGH_STEPS = 2  # definition: of a rough refit
IN_PAIRS = 6, 4  # definition: numbers of refits
# A hidden effect without the others: times its size to first order, dampings, and full refits.
SIZES, DAMPINGS, ALONE = np.geomspace(0.3, 3.0, 9), 4, 6  # definition: of starts


@dataclass(frozen=True)
class Visibility:
    """Distances in σ.

    Attributes:
        nominal: Of the refitted nominal model.
        rival: Ids of the best rival explanation; empty where there is none.
        distance: Of the best rival.
        effects: Of the best fit without each hidden effect.
        length: Refitted l of the nominal model [m].
        damping: Refitted d of the nominal model [N s/m].
    """

    nominal: float
    rival: tuple[str, ...]
    distance: float
    effects: tuple[float, ...]
    length: float
    damping: float


def is_rival(rival: Effect, true_effect: Effect) -> bool:
    """Whether naming one instead of the other would be wrong."""
    return not (rival.id == true_effect.id or rival.id in true_effect.twins
                or true_effect.id in rival.covers)


def visibility(truth: Array, experiment: Experiment, noise: Noise, base: Rig,
               true_effects: Sequence[Effect], scales: Scales,
               sizes: Sequence[Mapping[str, float]] = ()) -> Visibility:
    """Compare a truth with the nominal model and with every rival.

    Args:
        truth: (N,) angle without noise [rad].
        experiment: In which it was recorded.
        noise: That it is seen through.
        base: The rig without effects.
        true_effects: What is hidden; rivals leave them and their twins out.
        scales: Of the case.
        sizes: Quantities of each hidden effect: from where its fit alone starts as well.
    """
    target = noise.whitened(truth)
    nominal = nominal_fit(target, experiment, noise, base)
    contest = _Contest(target, experiment, noise, scales)
    clean = Candidate((), scales, experiment, noise, Rig())
    rivals = [c for c in CATALOGUE
              if len(true_effects) != 1 or is_rival(c, true_effects[0])]
    bare = np.array([base.length, base.damping])
    if true_effects and nominal.distance > 1.0:
        contest.enter(clean, (nominal, clean.at(target, bare)), rivals)
    without = [nominal.distance] * len(true_effects)
    if len(true_effects) > 1 and nominal.distance > 1.0:
        drawn = {effect: own for own, effect in zip(sizes, true_effects, strict=False)}
        for k, other in enumerate(true_effects):
            kept = [e for e in true_effects if e is not other and e.kind == "catalogue"]
            part, fit, anchor = contest.only(kept, (nominal, clean.at(target, bare)), base, drawn)
            without[k] = fit.distance
            same = {name for e in kept for name in (e.id, *e.twins)}
            others = [c for c in CATALOGUE if is_rival(c, other) and c.id not in same]
            if kept:
                contest.enter(part, (fit, anchor), others, *IN_PAIRS)
    names, distance = contest.winner()
    return Visibility(nominal.distance, names, min(distance, nominal.distance), tuple(without),
                      float(nominal.values[0]), float(nominal.values[1]))


def without_each(truth: Array, experiment: Experiment, noise: Noise, base: Rig,
                 true_effects: Sequence[Effect], scales: Scales,
                 sizes: Sequence[Mapping[str, float]]) -> tuple[float, ...]:
    """Distance of the best fit without each hidden effect; no rival is looked for.

    Arguments as those of `visibility`.
    """
    target = noise.whitened(truth)
    nominal = nominal_fit(target, experiment, noise, base)
    contest = _Contest(target, experiment, noise, scales)
    anchor = Candidate((), scales, experiment, noise, Rig()).at(
        target, np.array([base.length, base.damping]))
    drawn = dict(zip(true_effects, sizes, strict=True))
    return tuple(
        contest.only([e for e in true_effects if e is not other], (nominal, anchor), base,
                     drawn)[1].distance for other in true_effects)


def _at_truth(effects: Sequence[Effect], base: Rig,
              drawn: Mapping[Effect, Mapping[str, float]]) -> list[Array]:
    """The true values as a start (at most one), where all are known."""
    if not all(effect in drawn for effect in effects):
        return []
    return [np.array([base.length, base.damping,
                      *(drawn[e][q.name] for e in effects for q in e.quantities)])]


class _Contest:
    """Rivals, screened to first order and the best of them refitted."""

    def __init__(self, target: Array, experiment: Experiment, noise: Noise, scales: Scales):
        self.target, self.experiment, self.noise, self.scales = target, experiment, noise, scales
        # By effects, not by their ids: variants of one id have other quantities.
        self.fits: dict[tuple[Effect, ...], Refit] = {}

    def enter(self, against: Candidate, fits: Sequence[Refit], rivals: Sequence[Effect],
              rough: int = ROUGH, full: int = FULL) -> None:
        """Let rivals extend a candidate at several values, and refit the most promising.

        Where a candidate is fitted, its damping has taken the place of what may be missing (dry
        friction above all), and a rival begun there finds nothing left to do: it is begun at the
        true damping as well.
        """
        candidates = [
            Candidate((*against.effects, rival), self.scales, self.experiment, self.noise, Rig())
            for rival in rivals]
        best: dict[tuple[Effect, ...], tuple[Candidate, Refit]] = {}
        for fit in fits:
            screened = [(c, *self._screen(c, fit, rival))
                        for c, rival in zip(candidates, rivals, strict=True)]
            # Stable sorts: of equals the first in the catalogue comes first, in every run.
            screened.sort(key=lambda entry: -entry[1])
            for c, _, start in screened[:rough]:
                found = c.refitted(self.target, start, ROUGH_STEPS)
                if c.effects not in best or found.distance < best[c.effects][1].distance:
                    best[c.effects] = c, found
        closest = sorted(best.values(), key=lambda entry: entry[1].distance)
        for candidate, found in closest[:full]:
            self._keep(candidate, candidate.refitted(self.target, found.values))

    def only(self, effects: Sequence[Effect], begun: tuple[Refit, Refit], base: Rig,
             drawn: Mapping[Effect, Mapping[str, float]]) -> tuple[Candidate, Refit, Refit]:
        """Some effects and no other: candidate, its fit, and it at the true l and d.

        Args:
            effects: Added one after another.
            begun: Fit of the nominal model, and that at the true l and d.
            base: The rig without effects.
            drawn: Quantities of each effect where they are known.
        """
        part = Candidate((), self.scales, self.experiment, self.noise, Rig())
        bare = np.array([base.length, base.damping])
        fit, anchor = begun
        for effect in effects:
            part = replace(part, effects=(*part.effects, effect))
            fit = self.alone(part, (fit, anchor), effect, _at_truth(part.effects, base, drawn))
            anchor = part.at(self.target, np.r_[bare, fit.values[len(bare):]])
        return part, fit, anchor

    def alone(self, candidate: Candidate, fits: Sequence[Refit], effect: Effect,
              more: Sequence[Array]) -> Refit:
        """One effect alone, refitted from where it does most to first order, and from more.

        Where its true size is not known, from others and other dampings as well: what sticks has
        many minima.
        """
        begun = [*more, *(self._screen(candidate, fit, effect)[1] for fit in fits)]
        beside: list[Array] = []
        if effect.quantities and not more:
            size = len(fits[0].values)
            low, *_, high = sorted(max(float(fit.values[1]), 1e-3) for fit in fits)
            dampings = np.geomspace(low, high, DAMPINGS)
            for start, factor, damping in product(begun, SIZES, dampings):
                beside.append(start.copy())
                beside[-1][1], beside[-1][size] = damping, factor * start[size]
        roughly = [candidate.refitted(self.target, start, ROUGH_STEPS) for start in beside]
        roughly.sort(key=lambda fit: fit.distance)
        for start in [*begun, *(found.values for found in roughly[:ALONE])]:
            self._keep(candidate, candidate.refitted(self.target, start))
        return self.fits[candidate.effects]

    def winner(self) -> tuple[tuple[str, ...], float]:
        """Ids and distance of the closest rival."""
        if not self.fits:
            return (), np.inf
        effects = min(self.fits, key=lambda key: self.fits[key].distance)
        return tuple(effect.id for effect in effects), self.fits[effects].distance

    def _keep(self, candidate: Candidate, found: Refit) -> None:
        known = self.fits.get(candidate.effects)
        if known is None or found.distance < known.distance:
            self.fits[candidate.effects] = found

    def _screen(self, candidate: Candidate, fit: Refit, rival: Effect) -> tuple[float, Array]:
        """How much of the residual a rival takes away to first order, and where to start it."""
        now = self.target - fit.residual
        best, best_start = -1.0, np.r_[fit.values, next(starts(rival, self.scales))]
        for start in starts(rival, self.scales):
            try:
                moved = candidate.response(np.r_[fit.values, start]) - now
            except errors.SimulationFailed:
                continue
            moved = unexplained(fit.jacobian, moved)
            square = float(np.sum(moved**2))
            along = float(np.sum(moved * fit.residual)) / max(square, 1e-30)
            size = rival.quantities[0] if rival.quantities else None
            if along < 0.0 and not (size and size.both_ways):
                along = 0.0
            if size and size.grows:
                start[0] = self._scaled(size, start[0], along)
            score = along**2 * square
            if score > best:
                best, best_start = score, np.r_[fit.values, start]
        return best, best_start

    def _scaled(self, size: Quantity, start: float, along: float) -> float:
        """The size that fits best to first order, within bounds and not beyond tenfold."""
        unit = self.scales.of(size.relative)
        excess = (start - size.neutral) * float(np.clip(along, -10.0, 10.0))
        return float(np.clip(size.neutral + excess, size.bounds[0] * unit, size.bounds[1] * unit))
