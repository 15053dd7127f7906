"""How visible is a hidden effect, and what else could explain the recording?

The nominal model and every effect of the catalogue (rival) are refitted to the truth without
noise; all differ from the truth by some distance D in σ.  A truth is *nameable* where the nominal
model is at least 5σ away and the best rival that is no twin at least 4σ.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from pikanid import errors
from pikanid.validation.concealed.arrays import Array
from pikanid.validation.concealed.effect import Effect, Quantity, Scales
from pikanid.validation.concealed.effects import CATALOGUE
from pikanid.validation.concealed.experiment import Experiment
from pikanid.validation.concealed.fisher import MOST_STEPS, Refit, at, refit, unexplained
from pikanid.validation.concealed.noise import Noise
from pikanid.validation.concealed.rig import Rig
from pikanid.validation.concealed.simulate import measured

# A set of concealed cases is a function of its seed alone: none of these can be set.
FROM_NOMINAL, FROM_RIVAL = 5.0, 4.0  # definition: [σ] of a nameable truth
# Rivals that get a rough refit after the screening to first order, and a full one after that.
ROUGH, FULL = 12, 6  # definition: numbers of refits
ROUGH_STEPS = 2  # definition: of a rough refit
IN_PAIRS = 6, 4  # definition: numbers of refits
# A hidden effect without the others: times its size to first order, dampings, and full refits.
SIZES, DAMPINGS, ALONE = np.geomspace(0.3, 3.0, 9), 4, 6  # definition: of starts
# Of l [m] and d [N s/m].
BASE_LOW, BASE_HIGH = np.array([0.003, 0.0]), np.array([1.0, 20.0])  # definition: their bounds
BASE_SCALE = np.array([0.005, 0.1])  # definition: a typical change of these


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


@dataclass(frozen=True)
class Candidate:
    """A rig with free l and d and one or more effects with free quantities."""

    effects: tuple[Effect, ...]
    scales: Scales
    experiment: Experiment
    noise: Noise
    base: Rig

    def response(self, v: Array) -> Array:
        """(N,) whitened response at v = (l, d, quantities of each effect)."""
        return self.noise.whitened(measured(self.rig(v), self.experiment))

    def rig(self, v: Array) -> Rig:
        """The rig at v."""
        rig = self.base._replace(length=float(v[0]), damping=float(v[1]))
        position = 2
        for effect in self.effects:
            values = {}
            for quantity in effect.quantities:
                values[quantity.name] = float(v[position])
                position += 1
            rig = effect.applied(rig, values)
        return rig

    def _columns(self) -> list[tuple[float, float, float]]:
        found = []
        for effect in self.effects:
            for q in effect.quantities:
                unit = self.scales.of(q.relative)
                low, high = (bound * unit for bound in q.bounds)
                typical = abs(q.starts[0] - q.neutral) * unit
                found.append((low, high, typical))
        return found

    def at(self, target: Array, values: Array) -> Refit:
        """As it is at values (p,), not adjusted to a whitened target (N,)."""
        low, high, scale = self._box()
        return at(self.response, target, np.clip(values, low, high), high, scale)

    def refitted(self, target: Array, start: Array, steps: int = MOST_STEPS) -> Refit:
        """Adjusted to a whitened target (N,) in at most so many steps."""
        return refit(self.response, target, start, *self._box(), steps)

    def _box(self) -> tuple[Array, Array, Array]:
        """(p,) lower and upper bounds and scales."""
        low, high, scale = np.array(self._columns()).reshape(-1, 3).T
        return np.r_[BASE_LOW, low], np.r_[BASE_HIGH, high], np.r_[BASE_SCALE, scale]


def starts(effect: Effect, scales: Scales) -> Iterator[Array]:
    """Quantities (k,) from where a fit of an effect may start."""
    choices = [[s * scales.of(q.relative) for s in q.starts] for q in effect.quantities]
    for choice in product(*choices):
        yield np.array(choice, dtype=float)


def is_rival(rival: Effect, true_effect: Effect) -> bool:
    """Whether naming one instead of the other would be wrong."""
    return not (rival.id == true_effect.id or rival.id in true_effect.twins
                or true_effect.id in rival.covers)


def nominal_fit(truth: Array, experiment: Experiment, noise: Noise, base: Rig) -> Refit:
    """The nominal pendulum adjusted to a whitened truth (N,), starting at the true l and d."""
    candidate = Candidate((), Scales(1.0, 1.0, 1.0, 1.0), experiment, noise, Rig())
    return candidate.refitted(truth, np.array([base.length, base.damping]))


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
            part, fit, anchor = clean, nominal, clean.at(target, bare)
            for effect in kept:
                part = replace(part, effects=(*part.effects, effect))
                fit = contest.alone(part, (fit, anchor), effect,
                                    _at_truth(part.effects, base, drawn))
                anchor = part.at(target, np.r_[bare, fit.values[len(bare):]])
            without[k] = fit.distance
            same = {name for e in kept for name in (e.id, *e.twins)}
            others = [c for c in CATALOGUE if is_rival(c, other) and c.id not in same]
            if kept:
                contest.enter(part, (fit, anchor), others, *IN_PAIRS)
    names, distance = contest.winner()
    return Visibility(nominal.distance, names, min(distance, nominal.distance), tuple(without),
                      float(nominal.values[0]), float(nominal.values[1]))


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
