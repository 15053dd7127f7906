"""From a nominal fit to edges on a grid that is fine enough, with steps where data ask for them.

Grids follow one another (10, 20, 40 intervals) until the evidence no longer rises.  On each, an
edge gets a step at zero when the linearised evidence for it is strong; on the last, a smoothness
that varies along it.  A refit confirms the choice or takes it back.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pikanid.discrepancy.edges import OFFSET, EdgePlan, extend
from pikanid.discrepancy.fit import PenalisedFit, penalised_fit
from pikanid.discrepancy.gauge import Visited, visit
from pikanid.discrepancy.screening import step_responses
from pikanid.discrepancy.smoothness import LARGEST, EdgePrior, Smoothness
from pikanid.estimate import Estimate, Trajectory
from pikanid.model import Model
from pikanid.problem import Problem
from pikanid.shooting import Shooting

UNKNOWN = 1e-3  # prior precision of a parameter, in units of its guess: none to speak of
STRONG = 5.0  # log Bayes factor (odds of 150 : 1) that a step or a varying smoothness must reach
SURE = 4.0  # standard deviations that a step must differ from zero by, to stay
FINER = 1.0  # rise of log evidence that a finer grid must bring
PIECES = 9  # of log λ along an edge, where it varies


@dataclass(frozen=True, eq=False)
class Level:
    """The fit on one grid."""

    problem: Problem
    shooting: Shooting
    plans: tuple[EdgePlan, ...]
    fit: PenalisedFit
    visited: Visited

    @property
    def places(self) -> tuple[np.ndarray, ...]:
        """Where the coefficients of every edge stand in θ."""
        return tuple(p.at for p in self.fit.smoothness.priors)

    def trajectories(self) -> list[Trajectory]:
        """The fitted states."""
        return [Trajectory(r.t, r.states)
                for r in self.shooting.responses(self.fit.theta, states=True)]


@dataclass(frozen=True, eq=False)
class Change:
    """A change of one edge: rise of the log evidence in the linear problem, and its ρ then."""

    gain: float
    plans: tuple[EdgePlan, ...]
    pieces: tuple[int, ...]
    rho: np.ndarray


@dataclass(frozen=True)
class Search:
    """What stays the same from grid to grid."""

    nominal: Estimate
    problem: Problem
    equation: str
    steps: bool
    adaptive: bool

    def first(self, plans: Sequence[EdgePlan], intervals: int) -> Level:
        """The coarsest grid, from the nominal fit."""
        nominal = self.nominal
        seen = visit(self.problem, self.equation, plans, nominal.theta, nominal.trajectories)
        placed = [p.over(a, intervals) for p, a in zip(plans, seen.arguments.T, strict=True)]
        return self.stepped(self.anew(placed, [1] * len(placed), seen.size))

    def anew(self, plans: Sequence[EdgePlan], pieces: Sequence[int], size: float) -> Level:
        """Edges from zero: first nearly straight ones, then as the evidence wants them.

        Let loose at once, rough edges would take what parameters and steps explain better.
        """
        theta = self.nominal.theta
        start = {f.label: float(v) for f, v in zip(self.problem.free, theta, strict=True)}
        return self.level(plans, pieces, start, None, size)

    def finer(self, level: Level, intervals: int) -> Level:
        """The next grid, from the fit on the one before, over the range visited now."""
        seen = level.visited
        placed = [p.over(a, intervals) for p, a in zip(level.plans, seen.arguments.T, strict=True)]
        return self.stepped(self.level(
            placed, [p.pieces for p in level.fit.smoothness.priors], self.regridded(level, placed),
            level.fit.rho, level.fit.smoothness.priors[0].size))

    def stepped(self, level: Level) -> Level:
        """The level, with a step at zero in every edge whose data strongly ask for one."""
        for _ in level.plans:
            change = self.step_wanted(level) if self.steps else None
            better = None if change is None else self.anew(
                change.plans, change.pieces, level.fit.smoothness.priors[0].size)
            if better is None or better.fit.evidence < level.fit.evidence + STRONG:
                break
            level = better
        return self.pruned(level)

    def pruned(self, level: Level) -> Level:
        """The level without steps that turn out not to be there."""
        fit = level.fit
        V = np.linalg.pinv(fit.information + fit.smoothness.precision(fit.rho), hermitian=True)
        kept = tuple(
            replace(p, step=abs(fit.theta[at[-1]]) > SURE * np.sqrt(V[at[-1], at[-1]]))
            if p.step else p for p, at in zip(level.plans, level.places, strict=True))
        if kept == level.plans:
            return level
        pieces = [p.pieces for p in fit.smoothness.priors]
        return self.level(kept, pieces, self.regridded(level, kept), fit.rho,
                          fit.smoothness.priors[0].size)

    def varied(self, level: Level) -> Level:
        """The level, with a smoothness that varies along every edge whose data ask for that."""
        for _ in level.plans:
            change = self.variation_wanted(level) if self.adaptive else None
            better = None if change is None else self.level(
                change.plans, change.pieces, self.regridded(level, change.plans), change.rho,
                level.fit.smoothness.priors[0].size)
            if better is None or better.fit.evidence < level.fit.evidence + STRONG:
                break
            level = better
        return level

    def step_wanted(self, level: Level) -> Change | None:
        """The step that the linear problem asks for most, if it does so strongly."""
        fit, priors = level.fit, level.fit.smoothness.priors
        base = fit.smoothness.choose(fit.information, fit.gain, fit.rho)[1]
        answers = step_responses(level.shooting, fit.theta, self.equation, level.plans)
        J = level.shooting.jacobian(fit.theta)
        target = J @ fit.theta - level.shooting.residual(fit.theta)
        found = []
        for k, prior in enumerate(priors):
            plan = prior.plan
            if plan.step or not plan.limits[0] < 0.0 < plan.limits[1]:
                continue
            wider = np.column_stack([J, answers[:, k]]) / fit.noise
            A, b = wider.T @ wider, wider.T @ target / fit.noise
            stepped = replace(plan, step=True)
            others = [*priors]
            others[k] = EdgePrior(stepped, np.append(prior.at, len(fit.theta)), prior.size,
                                  prior.pieces)
            smooth = Smoothness(tuple(others), np.append(fit.smoothness.weak, 0.0))
            rho, cost = smooth.choose(A, b, fit.rho)
            plans = tuple(stepped if j == k else p for j, p in enumerate(level.plans))
            found.append(Change(base - cost, plans, tuple(p.pieces for p in priors), rho))
        return _strongest(found)

    def variation_wanted(self, level: Level) -> Change | None:
        """The edge whose smoothness should vary most, if the linear problem strongly says so."""
        fit, priors = level.fit, level.fit.smoothness.priors
        base = fit.smoothness.choose(fit.information, fit.gain, fit.rho)[1]
        found = []
        for k, prior in enumerate(priors):
            if prior.pieces > 1:
                continue
            others = [*priors]
            others[k] = replace(prior, pieces=PIECES)
            varied = Smoothness(tuple(others), fit.smoothness.weak)
            start = np.concatenate([np.repeat(own, other.pieces // len(own)) for own, other
                                    in zip(fit.smoothness.split(fit.rho), others, strict=True)])
            rho, cost = varied.choose(fit.information, fit.gain, start)
            pieces = tuple(p.pieces for p in others)
            found.append(Change(base - cost, level.plans, pieces, rho))
        return _strongest(found)

    def regridded(self, level: Level, plans: Sequence[EdgePlan]) -> dict[str, float]:
        """The fit of a level as a start on another grid."""
        start = {f.label: float(v)
                 for f, v in zip(level.problem.free, level.fit.theta, strict=True)}
        for old, new, at in zip(level.plans, plans, level.places, strict=True):
            a = np.linspace(*new.limits, 20 * new.size)
            c = np.linalg.lstsq(new.basis(a), old.basis(a) @ level.fit.theta[at], rcond=None)[0]
            start |= dict(zip(new.coefficient_names, map(float, c), strict=True))
        return start

    def level(self, plans: Sequence[EdgePlan], pieces: Sequence[int], start: dict[str, float],
              rho: np.ndarray | None, size: float) -> Level:
        """Fit one structure; without a ρ to begin with, with stiff edges first."""
        model = _extended(self.nominal, self.equation, plans)
        problem = Problem(model, self.problem.recordings)
        smoothness = smoothness_of(problem, plans, size, pieces)
        theta = np.array([start.get(f.label, f.guess) for f in problem.free])
        shooting = Shooting(problem)
        if rho is None:
            rho = smoothness.stiff
            theta = penalised_fit(shooting, theta, smoothness, rho, fixed=True).theta
        fit = penalised_fit(shooting, theta, smoothness, rho)
        level = Level(problem, shooting, tuple(plans), fit, _NOWHERE)
        return visited_by(level, self.problem, self.equation)


_NOWHERE = Visited(np.empty((0, 0)), np.empty(0), np.empty((0, 0)), 1.0)


def visited_by(level: Level, nominal: Problem, equation: str) -> Level:
    """The level with what its own trajectories went through."""
    labels = [f.label for f in level.problem.free]
    own = np.array([level.fit.theta[labels.index(f.label)] for f in nominal.free])
    return replace(level, visited=visit(nominal, equation, level.plans, own, level.trajectories()))


def smoothness_of(problem: Problem, plans: Sequence[EdgePlan], size: float, pieces: Sequence[int]
                  ) -> Smoothness:
    """The priors of edges in the extended model's θ."""
    labels = [f.label for f in problem.free]
    priors = tuple(
        EdgePrior(p, np.array([labels.index(n) for n in p.coefficient_names]), size, k)
        for p, k in zip(plans, pieces, strict=True))
    weak = np.array([UNKNOWN / max(abs(f.guess), UNKNOWN) for f in problem.free]) ** 2
    weak[labels.index(OFFSET)] = 1.0 / (LARGEST * size) ** 2
    for prior in priors:
        weak[prior.at] = 0.0
    return Smoothness(priors, weak)


def search(nominal: Estimate, problem: Problem, equation: str, plans: Sequence[EdgePlan],
           grid: Sequence[int], steps: bool, adaptive: bool) -> Level:
    """Fit edges on one grid after the other, until a finer one brings nothing."""
    setting = Search(nominal, problem, equation, steps, adaptive)
    level = setting.first(plans, grid[0])
    for intervals in grid[1:]:
        finer = setting.finer(level, intervals)
        if finer.fit.evidence < level.fit.evidence + FINER:
            break
        level = finer
    return setting.varied(level)


def _extended(nominal: Estimate, equation: str, plans: Sequence[EdgePlan]) -> Model:
    return extend(nominal.fitted_model, equation, plans)


def _strongest(found: Sequence[Change]) -> Change | None:
    best = max(found, key=lambda c: c.gain, default=None)
    return None if best is None or best.gain < STRONG else best
