"""Table II's protocol for PIKAN: L-BFGS on coefficients and parameters, grid 10 → 20 → 40.

λ rises 0 → 0.1 with the grid; 500 steps at λ = 1 and G = 40 follow; with sparse data, read as fewer
than half as many samples as collocation points, every λ is doubled.  There the minimiser of Eq. (5)
lies far away (1/l → 0 costs less than resolving θ'' at the switches), so that the figure depends on
where L-BFGS stops: the gradient's norm at the stop is part of the result.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.linalg import LinAlgError

from pikanid import errors
from pikanid.approximators import Array
from pikanid.approximators.kan import ShallowKAN
from pikanid.objective.functional import Functional
from pikanid.optimise.gauss_newton import BandedSystem, Outcome, Point, damped_step
from pikanid.optimise.schedules import Stage
from pikanid.strategies.kan_grids import KanGrid
from pikanid.strategies.kan_shallow import unfitted
from pikanid.strategies.relaxation import RelaxedFit, Setup, conclude

# Grid, λ, steps.
STAGES = (
    (10, 0.0, 200), (20, 0.05, 200), (40, 0.1, 200), (40, 1.0, 500))  # definition: of Table II
COLLOCATION = 501  # definition: of Table II
Progress = Callable[[dict[str, float]], None]


def paper_fit(setup: Setup, degree: int, seed: int, progress: Progress | None
              ) -> tuple[RelaxedFit, dict[str, Any]]:
    """The fit and what L-BFGS said at its stop."""
    theta = setup.problem.guess
    stages: list[Stage] = []
    networks: list[tuple[ShallowKAN, ...]] = []
    samples = min(s.t.size for e in setup.problem.experiments for s in e.samples)
    factor = 2.0 if samples < COLLOCATION / 2 else 1.0
    for cells, usual, steps in STAGES:
        lam = factor * usual
        grid = KanGrid(cells, degree, exact_switches=False, quadrature="sum", count=COLLOCATION,
                       seed=seed)
        functional = setup.functional(grid)
        networks = _refined(networks, functional)
        start = tuple(np.concatenate([n.coefficients[:, 0] for n in own]) for own in networks)
        point, gradient, used = _lbfgs(functional, Point(start, theta), lam, steps)
        theta = point.theta
        for own, c in zip(networks, point.coefficients, strict=True):
            ends = np.cumsum([n.n_basis for n in own])[:-1]
            for network, part in zip(own, np.split(c, ends), strict=True):
                network.set_coefficients(part)
        costs = _costs(functional, point, lam)
        stages.append(Stage(lam, theta, np.full(theta.size, np.nan), *costs, used, used < steps))
        if progress is not None:
            progress({"grid": float(cells), "lam": lam, "data": costs[0], "physics": costs[1]})
    said = {"gradient_norm": gradient, "steps": used}
    system = BandedSystem(functional)
    at = system.linearise(point, lam)
    try:
        step = damped_step(system, at, setup.problem.lower, setup.problem.upper, 1e-8)
    except LinAlgError:
        note = errors.fit_diverged("under L-BFGS")
        return unfitted(setup, grid, functional, point, note, stages), said
    finished = stages[-1].converged
    notes = [] if finished else [errors.lbfgs_stopped(steps, gradient)]
    fit = conclude(setup, grid, system, Outcome(at, step, used, finished), stages, notes)
    return fit, said


def _refined(old: list[tuple[ShallowKAN, ...]], functional: Functional
             ) -> list[tuple[ShallowKAN, ...]]:
    """The networks of a functional, holding the curves of the coarser ones."""
    new = []
    for r, part in enumerate(functional.parts):
        own = []
        for i, network in enumerate(part.approximators):
            assert isinstance(network, ShallowKAN)
            if old and old[r][i].n_basis != network.n_basis:
                finer = old[r][i].refined(network.n_splines - network.degree)
                network.set_coefficients(finer.coefficients)
            elif old:
                network.set_coefficients(old[r][i].coefficients)
            own.append(network)
        new.append(tuple(own))
    return new


def _lbfgs(functional: Functional, point: Point, lam: float, steps: int
           ) -> tuple[Point, float, int]:
    """At most `steps` L-BFGS steps; parameters in units of their guess.  Also ‖∇‖ at the stop."""
    from scipy.optimize import minimize

    problem = functional.problem
    unit = np.where(problem.guess != 0, np.abs(problem.guess), 1.0)
    sizes = np.cumsum([c.size for c in point.coefficients])

    def unpack(z: Array) -> Point:
        *pieces, theta = np.split(z, sizes)
        return Point(tuple(pieces), theta * unit)

    def cost(z: Array) -> tuple[float, Array]:
        at = unpack(z)
        value, gradient = cost_and_gradient(functional, at, lam)
        gradient[sizes[-1]:] *= unit
        return value, gradient

    free = [(None, None)] * int(sizes[-1])
    box = [(b[0] / s, b[1] / s) for b, s in zip(
        zip(problem.lower, problem.upper, strict=True), unit, strict=True)]
    z = np.concatenate([*point.coefficients, point.theta / unit])
    found = minimize(cost, z, jac=True, method="L-BFGS-B", bounds=[*free, *box],
                     options={"maxiter": steps, "maxfun": 10 * steps, "ftol": 1e-15,
                              "gtol": 1e-10, "maxcor": 20})
    return unpack(found.x), float(np.linalg.norm(found.jac)), int(found.nit)


def cost_and_gradient(functional: Functional, at: Point, lam: float) -> tuple[float, Array]:
    """The cost of Eq. (2) and its gradient in [α_1, α_2, ..., θ]."""
    total, by_theta, pieces = 0.0, np.zeros(at.theta.size), []
    for r, c in enumerate(at.coefficients):
        own, (_, columns) = np.zeros(c.size), functional.problem.columns(r)
        for sites, rows in zip(functional.families(r), functional.rows(r, c, at.theta, lam),
                               strict=True):
            total += float(np.sum(rows.residual**2))
            if rows.by_state is not None:
                pulls = np.einsum("me,mes->ms", rows.residual, rows.by_state)
                for pull, table in zip(pulls.T, sites.states, strict=True):
                    own[table.part] += pull @ table.basis
            if rows.by_top is not None:
                for pull, table in zip((rows.residual * rows.by_top).T, sites.tops, strict=True):
                    own[table.part] += pull @ table.basis
            if rows.by_theta is not None:
                by_theta[columns] += np.einsum("me,meb->b", rows.residual, rows.by_theta)
        pieces.append(own)
    return total, 2.0 * np.concatenate([*pieces, by_theta])


def _costs(functional: Functional, point: Point, lam: float) -> tuple[float, float]:
    data = physics = 0.0
    for r, c in enumerate(point.coefficients):
        data += sum(float(np.sum(rows.residual**2))
                    for rows in functional.data_rows(r, c, point.theta))
        physics += float(np.sum(functional.physics_rows(r, c, point.theta, lam).residual**2))
    return data, physics
