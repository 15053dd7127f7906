"""`Level`: edges of one structure, fitted, and what their trajectories went through."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pikanid.discrepancy.edges import OFFSET, EdgePlan
from pikanid.discrepancy.fit import PenalisedFit
from pikanid.discrepancy.gauge import Visited, visit
from pikanid.discrepancy.settings import USUAL, DiscrepancySettings
from pikanid.discrepancy.smoothness import EdgePrior, Smoothness
from pikanid.estimate.data import Trajectory
from pikanid.objective.shooting import Shooting
from pikanid.problem.problem import Problem

UNKNOWN = 1e-3  # numerical: prior precision of a parameter, in units of its guess: none to speak of


@dataclass(frozen=True, eq=False)
class Level:
    """The fit of one structure: grid, steps, pieces of log λ."""

    problem: Problem
    shooting: Shooting
    plans: tuple[EdgePlan, ...]
    fit: PenalisedFit
    visited: Visited

    @property
    def places(self) -> tuple[np.ndarray, ...]:
        """Where the coefficients of every edge stand in θ."""
        return tuple(p.at for p in self.fit.smoothness.priors)

    @property
    def pieces(self) -> tuple[int, ...]:
        """Pieces of log λ, edge by edge."""
        return tuple(p.pieces for p in self.fit.smoothness.priors)

    @property
    def size(self) -> float:
        """Root mean square of the equation's right-hand side, as the priors take it."""
        return self.fit.smoothness.priors[0].size

    def trajectories(self) -> list[Trajectory]:
        """The fitted states."""
        return [Trajectory(r.t, r.states)
                for r in self.shooting.responses(self.fit.theta)]

    def visiting(self, nominal: Problem, equation: str) -> Level:
        """The level with what its own trajectories went through."""
        labels = [f.label for f in self.problem.free]
        own = np.array([self.fit.theta[labels.index(f.label)] for f in nominal.free])
        seen = visit(nominal, equation, self.plans, own, self.trajectories())
        return replace(self, visited=seen)

    def regridded(self, plans: Sequence[EdgePlan]) -> dict[str, float]:
        """The fit as a start on another grid."""
        start = {f.label: float(v) for f, v in zip(self.problem.free, self.fit.theta, strict=True)}
        for old, new, at in zip(self.plans, plans, self.places, strict=True):
            a = np.linspace(*new.limits, 20 * new.size)
            c = np.linalg.lstsq(new.basis(a), old.basis(a) @ self.fit.theta[at], rcond=None)[0]
            start |= dict(zip(new.coefficient_names, map(float, c), strict=True))
        return start


NOWHERE = Visited(
    np.empty((0, 0)), np.empty(0), np.empty((0, 0)), 1.0)  # definition: nothing visited


def smoothness_of(problem: Problem, plans: Sequence[EdgePlan], size: float, pieces: Sequence[int],
                  settings: DiscrepancySettings = USUAL) -> Smoothness:
    """The priors of edges in the extended model's θ."""
    labels = [f.label for f in problem.free]
    priors = tuple(
        EdgePrior(p, np.array([labels.index(n) for n in p.coefficient_names]), size, k,
                  settings.largest)
        for p, k in zip(plans, pieces, strict=True))
    weak = np.array([UNKNOWN / max(abs(f.guess), UNKNOWN) for f in problem.free]) ** 2
    weak[labels.index(OFFSET)] = 1.0 / (settings.largest * size) ** 2
    for prior in priors:
        weak[prior.at] = 0.0
    return Smoothness(priors, weak, settings)
