"""From a nominal fit to edges on a grid that is fine enough, with steps where data ask for them.

Grids follow one another (10, 20, 40 intervals) until the evidence no longer rises.  On each, an
edge gets a step at zero when the linearised evidence for it is strong; on the last, a smoothness
that varies along it.  A refit confirms the choice or takes it back.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pikanid.discrepancy.edges import EdgePlan, extend
from pikanid.discrepancy.fit import penalised_fit
from pikanid.discrepancy.gauge import visit
from pikanid.discrepancy.level import NOWHERE, Level, smoothness_of
from pikanid.discrepancy.offers import finer_gain, step_offers, strongest, variation_offers
from pikanid.discrepancy.settings import USUAL, DiscrepancySettings
from pikanid.discrepancy.smoothness import Smoothness
from pikanid.estimate import Estimate
from pikanid.objective.shooting import Shooting
from pikanid.problem.problem import Problem


@dataclass(frozen=True)
class Search:
    """What stays the same from grid to grid."""

    nominal: Estimate
    problem: Problem
    equation: str
    steps: bool
    adaptive: bool
    settings: DiscrepancySettings = USUAL

    def first(self, plans: Sequence[EdgePlan], intervals: int) -> Level:
        """The coarsest grid, from the nominal fit."""
        nominal = self.nominal
        seen = visit(self.problem, self.equation, plans, nominal.theta, nominal.trajectories)
        placed = [p.over(a, intervals) for p, a in zip(plans, seen.arguments.T, strict=True)]
        return self.stepped(self.anew(placed, [1] * len(placed), seen.size))

    def finer(self, level: Level, intervals: int) -> Level | None:
        """The next grid, over the range visited now; None where it would not pay."""
        placed = tuple(p.over(a, intervals) for p, a in zip(
            level.plans, level.visited.arguments.T, strict=True))
        if finer_gain(level, self.equation, placed) < self.settings.finer:
            return None
        found = self.stepped(self.again(level, placed, level.pieces))
        return found if found.fit.evidence > level.fit.evidence + self.settings.finer else None

    def stepped(self, level: Level) -> Level:
        """The level, with a step at zero in every edge whose data strongly ask for one."""
        strong = self.settings.strong
        for _ in level.plans:
            offer = strongest(step_offers(level, self.equation), strong) if self.steps else None
            better = None if offer is None else self.anew(offer.plans, offer.pieces, level.size)
            if better is None or better.fit.evidence < level.fit.evidence + strong:
                break
            level = better
        return self.pruned(level)

    def pruned(self, level: Level) -> Level:
        """The level without steps that turn out not to be there."""
        fit = level.fit
        V = np.linalg.pinv(fit.information + fit.smoothness.precision(fit.rho), hermitian=True)
        kept = tuple(
            replace(p, step=abs(fit.theta[at[-1]]) > self.settings.sure * np.sqrt(
                V[at[-1], at[-1]]))
            if p.step else p for p, at in zip(level.plans, level.places, strict=True))
        return level if kept == level.plans else self.again(level, kept, level.pieces)

    def varied(self, level: Level) -> Level:
        """The level, with a smoothness that varies along every edge whose data ask for that."""
        strong = self.settings.strong
        for _ in level.plans:
            offer = strongest(variation_offers(level), strong) if self.adaptive else None
            better = None if offer is None else self.again(
                level, offer.plans, offer.pieces, offer.fit.rho)
            if better is None or better.fit.evidence < level.fit.evidence + strong:
                break
            level = better
        return level

    def anew(self, plans: Sequence[EdgePlan], pieces: Sequence[int], size: float) -> Level:
        """Edges from zero: first nearly straight ones, then as the evidence wants them.

        Let loose at once, rough edges would take what parameters and steps explain better.
        """
        theta = self.nominal.theta
        start = {f.label: float(v) for f, v in zip(self.problem.free, theta, strict=True)}
        problem, smoothness = self.structure(plans, pieces, size)
        shooting = Shooting(problem)
        straight = penalised_fit(shooting, _start(problem, start), smoothness, smoothness.stiff,
                                 fixed=True)
        return self.fitted(problem, shooting, plans, straight.theta, smoothness, smoothness.stiff)

    def again(self, level: Level, plans: Sequence[EdgePlan], pieces: Sequence[int],
              rho: np.ndarray | None = None) -> Level:
        """Another structure, from the fit of a level."""
        problem, smoothness = self.structure(plans, pieces, level.size)
        if rho is None:
            rho = level.fit.smoothness.carry(level.fit.rho, smoothness)
        return self.fitted(problem, Shooting(problem), plans,
                           _start(problem, level.regridded(plans)), smoothness, rho)

    def structure(self, plans: Sequence[EdgePlan], pieces: Sequence[int], size: float
                  ) -> tuple[Problem, Smoothness]:
        """The extended problem and the priors of its edges."""
        problem = Problem(extend(self.nominal.fitted_model, self.equation, plans),
                          self.problem.recordings)
        return problem, smoothness_of(problem, plans, size, pieces, self.settings)

    def fitted(self, problem: Problem, shooting: Shooting, plans: Sequence[EdgePlan],
               theta: np.ndarray, smoothness: Smoothness, rho: np.ndarray) -> Level:
        """Fit one structure from θ and ρ."""
        fit = penalised_fit(shooting, theta, smoothness, rho)
        return Level(problem, shooting, tuple(plans), fit, NOWHERE).visiting(
            self.problem, self.equation)


def _start(problem: Problem, values: dict[str, float]) -> np.ndarray:
    return np.array([values.get(f.label, f.guess) for f in problem.free])


def search(nominal: Estimate, problem: Problem, equation: str, plans: Sequence[EdgePlan],
           grid: Sequence[int], steps: bool, adaptive: bool,
           settings: DiscrepancySettings = USUAL) -> Level:
    """Fit edges on one grid after the other, until a finer one brings nothing."""
    setting = Search(nominal, problem, equation, steps, adaptive, settings)
    level = setting.first(plans, grid[0])
    for intervals in grid[1:]:
        finer = setting.finer(level, intervals)
        if finer is None:
            break
        level = finer
    return setting.varied(level)
