"""Relaxed fits: one functional, and Table I as (approximator, λ-schedule, optimiser).

    method   approximator      λ                     optimiser
    PDA      B-splines         decoupled             two steps: smooth, then regress   (pda.py)
    iPDA     B-splines         finite, continued up  Gauss-Newton on all unknowns      (here)
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from pikanid import errors
from pikanid.approximators import Array
from pikanid.objective.functional import Functional, bind
from pikanid.objective.shooting import Shooting
from pikanid.optimise.covariance import effective_parameters, error_bound, respond, theta_covariance
from pikanid.optimise.gauss_newton import (
    MAX_ITERATIONS,
    BandedSystem,
    Linearisation,
    Outcome,
    Point,
    gauss_newton,
)
from pikanid.optimise.schedules import Schedule, Stage, moved
from pikanid.optimise.smoothing import Smoothed, smooth
from pikanid.problem.chains import Chains
from pikanid.problem.problem import Problem
from pikanid.simulation.vectorfield import VectorField
from pikanid.strategies.data_noise import noise_level, row_noise, standard_errors
from pikanid.strategies.first_points import from_simulation, through_greville, transfer
from pikanid.strategies.grids import Discretisation, Grid
from pikanid.strategies.locks import follows_physics
from pikanid.strategies.settings import RELAXATION, RelaxationSettings
from pikanid.strategies.simulated import step_left

# Moves below this share of the parameter itself count as none (clean data: no standard error).
RELATIVE = 1e-6  # numerical: without noise no standard error says what is near
# Of one datum's share of the cost: θ is then within a hundredth of a standard error.  A misfit's
# share is large, and what ends its stages sooner leads it astray.
UNDER_WAY = 1e-4  # numerical: where a fit at a λ on the way counts as converged
# Of the move that a grid may make: usually 0.01 of a standard error, which is also what "fine"
# steps of integration may move an estimate by.
AGREES = 0.2  # numerical: share of what counts as settled, that a simulated fit may still move by
FEW_PROBES = 4  # numerical: where the limit of λ is the same whatever its unit


@dataclass(frozen=True, eq=False)
class RelaxedFit:
    """What a relaxation found.

    `covariance` is the sandwich of θ (the physics residual is not data), `naive_covariance` the
    θ block of σ²(JᵀJ)⁻¹ that treats it as data.  `data_cost` and `physics_cost` are the two sums of
    squares of Eq. (2), `effective` the number of parameters that the data fit used up.
    """

    problem: Problem
    theta: Array
    covariance: Array
    naive_covariance: Array
    coefficients: tuple[Array, ...] = field(repr=False)
    functional: Functional = field(repr=False)
    grid: Discretisation = field(repr=False)
    lam: float
    stages: tuple[Stage, ...] = field(repr=False)
    data_cost: float
    physics_cost: float
    effective: float
    converged: bool
    warnings: tuple[str, ...] = ()
    shooting: Shooting | None = field(default=None, repr=False)  # with steps chosen at θ, if it was

    @property
    def std(self) -> Array:
        """Standard errors of θ (b,), from the sandwich."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def chains(self) -> Chains:
        """Which spline stands for which states."""
        return self.functional.chains

    @property
    def iterations(self) -> int:
        """Gauss-Newton iterations over all stages."""
        return sum(stage.iterations for stage in self.stages)


@dataclass(frozen=True, eq=False)
class Setup:
    """What stays the same while a fit goes through grids and λ."""

    problem: Problem
    field: VectorField
    chains: Chains
    given_start: bool
    weighted: bool
    nondimensional: bool  # λ in units of N·σ²/(T·s²), s the size of the physics terms
    settings: RelaxationSettings = RELAXATION

    def functional(self, grid: Discretisation, like: Functional | None = None) -> Functional:
        """Eq. (2) on a grid, with the data of one on another grid where that is given."""
        return bind(self.problem, self.field, self.chains, grid.splines(self.problem, self.chains),
                    grid.nodes(self.problem, self.chains), given_start=self.given_start,
                    weighted=self.weighted, like=like)


def start_is_estimated(problem: Problem) -> bool:
    """Whether a free parameter is, or enters, an initial state."""
    free = set(problem.model.free_names)
    return any(free & {s.name for s in state.initial.free_symbols}
               for state in problem.model.states)


def first_point(system: BandedSystem, probes: int = 16) -> tuple[Point, Smoothed | None]:
    """Splines smoothed through the data, θ at its guess; flat ones where data say too little.

    How smooth they are is told by so many `probes`.
    """
    functional, theta = system.functional, system.functional.problem.guess
    flat = tuple(functional.resting(r, theta) for r in range(len(functional.parts)))
    smoothed = smooth(system.over(functional.smoothing()), Point(flat, theta), probes=probes)
    return (Point(flat, theta), None) if smoothed is None else (smoothed.point, smoothed)


def physics_scale(functional: Functional, point: Point, sigma: float) -> Array:
    """Scale (E,) that makes λ dimensionless: s·√(T/N)/σ.

    At λ = 1 a physics residual as large as the physics itself, s, costs as much as every sample
    being off by its σ.  s is the root mean square of x⁽ᵐ⁾ or of f, whichever is larger.
    """
    tops, rates, total = 0.0, 0.0, 0.0
    for r, part in enumerate(functional.parts):
        sites, c = part.physics, point.coefficients[r]
        rows = functional.physics_rows(r, c, point.theta, 0.0)
        f = sites.weight * np.where(np.isfinite(rows.value), rows.value, 0.0)
        top = sites.weight * rows.target.T
        tops = tops + np.einsum("me,me->e", top, top)
        rates = rates + np.einsum("me,me->e", f, f)
        total += float(sites.weight[:, 0] @ sites.weight[:, 0])
    size = np.sqrt(np.maximum(tops, rates) / total)
    size = np.where(size > 0.0, size, 1.0)
    return size * np.sqrt(total / functional.n_data) / sigma


def relax(setup: Setup, grid: Grid, plans: Callable[[float], Sequence[Schedule]], *,
          refine: bool) -> RelaxedFit:
    """Fit Eq. (2): smooth, warm up, follow the λ-schedule, refine the grid until it has settled.

    It has where the model's simulation has its optimum there as well, or no halving moves θ.
    `plans` is called with the noise level of the data rows (1 where they are divided by σ); the
    schedules after the first are tried only until one explains the data.

    Raises:
        BadSetting: If the splines cannot carry the model, or a delay is to be estimated.
    """
    system, stages, outcome, notes = _from_data(setup, grid, plans)
    if setup.field.switches:
        notes.append(errors.relaxation_smears())
        refine = False  # no grid settles while a kink wanders through it
    if refine and outcome.converged and not notes:
        fit = conclude(setup, grid, system, outcome, stages, notes)
        shooting = Shooting(setup.problem)
        if step_left(shooting, fit.theta, fit.std, RELATIVE) <= AGREES * setup.settings.settled:
            return replace(fit, shooting=shooting)
    gap, settings = 0.0, setup.settings
    for _ in range(settings.refinements if refine else 0):
        grid, before, lam = grid.refined(), outcome.at.point, stages[-1].lam
        coarse = system.functional
        del system, outcome  # most of the memory, and not needed any more
        finer = setup.functional(grid, coarse).with_scale(coarse.scale)
        system = BandedSystem(finer)
        outcome = gauss_newton(system, transfer(coarse, finer, before, through_greville), lam,
                               system.lower, system.upper)
        stages.append(_stage(system, lam, outcome, standard_errors(system, outcome)))
        gap = moved(before.theta, outcome.at.point.theta, stages[-1].std, RELATIVE)
        if gap > settings.misled or not outcome.converged:
            system, stages, outcome, notes = _from_data(setup, grid, plans)
        if gap <= settings.settled:
            break
    if gap > settings.settled:
        notes.append(errors.grid_not_settled(gap, grid.n_intervals))
    if not outcome.converged:
        notes.append(errors.not_converged(stages[-1].lam))
    return conclude(setup, grid, system, outcome, stages, notes)


def _from_data(setup: Setup, grid: Grid, plans: Callable[[float], Sequence[Schedule]]
               ) -> tuple[BandedSystem, list[Stage], Outcome, list[str]]:
    """The whole way on one grid: smooth the data, scale the physics, follow λ."""
    functional = setup.functional(grid)
    system = BandedSystem(functional)
    point, smoothed = first_point(system, FEW_PROBES)
    noise = noise_level(functional, smoothed)
    if setup.nondimensional:
        system = system.over(functional.with_scale(physics_scale(functional, point, noise)))
    return (system, *_best_path(system, point, plans(noise), noise,
                                setup.settings.explained))


def _best_path(system: BandedSystem, point: Point, plans: Sequence[Schedule],
               noise: float, explained: float) -> tuple[list[Stage], Outcome, list[str]]:
    enough = explained * noise**2 * system.functional.n_data
    paths = []
    start: Point | None = point
    for k, plan in enumerate(plans):
        if k == 1:
            start = from_simulation(system.functional)
        if start is None:
            break
        stages, outcome, notes = follow(system, start, plan)
        good = outcome.converged and not notes
        # Both parts of the cost: a path that ended at a weak λ fits data at the physics' expense.
        explains = outcome.at.cost <= enough
        paths.append(((good, explains, stages[-1].lam * (not good), -outcome.at.cost),
                      stages, outcome, notes))
        if good and explains:
            break
    _, stages, outcome, notes = max(paths, key=lambda path: path[0])
    return stages, outcome, notes


def follow(system: BandedSystem, point: Point,
           plan: Schedule) -> tuple[list[Stage], Outcome, list[str]]:
    """Warm up at the first λ, then minimise at every λ that the schedule names."""
    stages: list[Stage] = []
    outcomes: list[Outcome] = []  # the last two: no schedule keeps an earlier one
    lam = plan.next(stages)
    assert lam is not None
    at: Point | Linearisation = point
    if plan.warmup:
        at = gauss_newton(system, point, lam, point.theta, point.theta, iterations=plan.warmup).at
    while lam is not None:
        outcome = gauss_newton(system, at, lam, system.lower, system.upper,
                               iterations=MAX_ITERATIONS, tolerance=UNDER_WAY,
                               enough=plan.enough)
        stages.append(_stage(system, lam, outcome))
        if plan.locked(stages) and follows_physics(system, outcome.at, lam):
            stages[-1] = replace(stages[-1], free=True)
        outcomes, at = [*outcomes[-1:], outcome], outcome.at
        lam = plan.next(stages)
        if lam is None and len(stages) > 1:
            # Against a bound of its errors the estimate had settled: also against themselves?
            stages[-2] = replace(stages[-2], std=standard_errors(system, outcomes[-2]))
            lam = plan.next(stages)
    while True:
        kept = plan.keep(stages)
        found, stage = outcomes[kept - len(stages)], stages[kept]
        if not found.converged:
            break
        # so far as is enough on the way: what then goes no further is no stage to keep
        found = gauss_newton(system, found, stage.lam, system.lower, system.upper,
                             iterations=MAX_ITERATIONS)
        if found.iterations:
            found = replace(found, iterations=stage.iterations + found.iterations)
            stages[kept] = replace(_stage(system, stage.lam, found), free=stage.free)
        if plan.keep(stages) == kept:
            break
    notes = [(errors.relaxation_locked if stage.converged else errors.relaxation_stuck)(
        stage.lam, stages[kept].lam) for stage in stages[kept + 1:]]
    return stages[:kept + 1], found, notes


def _stage(system: BandedSystem, lam: float, outcome: Outcome, std: Array | None = None) -> Stage:
    """A stage with the given standard errors, or else a bound of them."""
    at = outcome.at
    if std is None:
        noise = row_noise(system.functional, at, at.point.theta.size)
        std = error_bound(system, at, outcome.step, noise)
    return Stage(lam, at.point.theta, std, at.data_cost, at.physics_cost, outcome.iterations,
                 outcome.converged)


def conclude(setup: Setup, grid: Discretisation, system: BandedSystem, outcome: Outcome,
              stages: list[Stage], notes: list[str]) -> RelaxedFit:
    """Covariances and effective parameters at the end of a fit."""
    at, step = outcome.at, outcome.step
    response = respond(system, at, step)
    step = replace(step, schur=response.reduced)
    effective = effective_parameters(system, at, step, response.data)
    noise = row_noise(system.functional, at, effective)
    sandwich, naive = theta_covariance(system, at, step, noise, response)
    return RelaxedFit(setup.problem, at.point.theta, sandwich, naive, at.point.coefficients,
                      system.functional, grid, stages[-1].lam, tuple(stages), at.data_cost,
                      at.physics_cost, effective, outcome.converged, tuple(notes))
