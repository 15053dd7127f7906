"""PIKAN with a shallow network: Gauss-Newton while the grid is refined 10 → 20 → 40 → ..."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.linalg import LinAlgError

from pikanid import errors
from pikanid.approximators import Array
from pikanid.approximators.kan import ShallowKAN
from pikanid.objective.functional import Functional
from pikanid.optimise.cholesky import factor_band, solve_band
from pikanid.optimise.gauss_newton import BandedSystem, Outcome, Point
from pikanid.optimise.schedules import LOCKABLE_BIAS, Continuation, Fixed, Stage, moved
from pikanid.strategies.data_noise import noise_level, standard_errors
from pikanid.strategies.first_points import transfer
from pikanid.strategies.grids import fastest_rate
from pikanid.strategies.kan_grids import KanGrid
from pikanid.strategies.relaxation import (
    RELATIVE,
    RelaxedFit,
    Setup,
    conclude,
    first_point,
    follow,
    physics_scale,
)

# Of the fastest linearised motion.
RADIANS = 1.0  # numerical: at most, in a cell of the first grid that counts
FACTOR, LARGEST = 10.0, 1e8  # numerical: of the λ-continuation
RIDGE = 1e-12  # numerical: where the finer space holds a function twice
Tell = Callable[[int, Sequence[Stage]], None]


def shallow_fit(setup: Setup, grid: KanGrid, *, cells: float | None, max_grid: int,
                lam: float | None, tell: Tell) -> RelaxedFit:
    """The fit on one grid, or on finer and finer ones until the parameters stay where they are.

    The first of these has at least `cells` cells; None stands for one grid alone.
    On every grid λ rises tenfold until no parameter moves by more than 0.05 of its standard error;
    the next, finer grid starts from the last one's curve at a tenth of its λ.
    """
    refine, settled = cells is not None, setup.settings.settled
    if cells is not None:
        while grid.intervals < cells and 2 * grid.intervals <= max_grid:
            grid = grid.refined()
    functional = setup.functional(grid)
    point, smoothed = first_point(BandedSystem(functional))
    noise = noise_level(functional, smoothed)
    scale = physics_scale(functional, point, noise)
    stages: list[Stage] = []
    best: tuple[KanGrid, BandedSystem, Outcome] | None = None
    start = 1.0
    while True:
        functional = functional.with_scale(scale)
        system = BandedSystem(functional)
        plan = Fixed(lam, 15) if lam else Continuation(
            noise**2 * setup.problem.n_samples, True, start=start, factor=FACTOR, limit=LARGEST,
            bias=LOCKABLE_BIAS)
        try:
            found, outcome, remarks = follow(system, point, plan)
        except LinAlgError:
            broken = errors.fit_diverged(f"on a grid of {grid.intervals} cells")
            if best is None:
                return unfitted(setup, grid, functional, point, broken)
            return conclude(setup, best[0], best[1], best[2], stages, [broken])
        tell(grid.intervals, found)
        gap = np.inf if not stages else moved(
            stages[-1].theta, found[-1].theta, standard_errors(system, outcome), RELATIVE)
        stages += found
        best = grid, system, outcome
        # where a lock ended the path, a finer grid may take λ further, however little it moved
        if (gap <= settled and not remarks) or not refine or 2 * grid.intervals > max_grid:
            break
        grid = grid.refined()
        finer = setup.functional(grid)
        point = transfer(functional, finer, outcome.at.point, _by_least_squares)
        start, functional = max(1.0, found[-1].lam / FACTOR), finer
    notes = list(remarks) if gap <= settled or not refine else []
    if refine and gap > settled:
        notes.append(errors.grid_not_settled(gap, grid.intervals))
    if not outcome.converged:
        notes.append(errors.not_converged(found[-1].lam))
    return conclude(setup, *best, stages, notes)


def cells_of(setup: Setup) -> float:
    """Cells that the fastest linearised motion asks for."""
    rates = [fastest_rate(setup.problem, setup.field, r) * (e.t1 - e.t0)
             for r, e in enumerate(setup.problem.experiments)]
    return max(rates) / RADIANS


def unfitted(setup: Setup, grid: KanGrid, functional: Functional, point: Point, note: str,
             stages: Sequence[Stage] = ()) -> RelaxedFit:
    """A point without covariances: all there is where no Gauss-Newton step is possible."""
    unknown = np.full((point.theta.size, point.theta.size), np.nan)
    cost = sum(float(np.sum(rows.residual**2)) for r, c in enumerate(point.coefficients)
               for rows in functional.data_rows(r, c, point.theta))
    lam = stages[-1].lam if stages else 0.0
    return RelaxedFit(setup.problem, point.theta, unknown, unknown, point.coefficients, functional,
                      grid, lam, tuple(stages), cost, np.nan, np.nan, False, (note,))


def _by_least_squares(fine: ShallowKAN, coarse: ShallowKAN, own: Array) -> Array:
    """Coefficients of the same curve, by least squares at six points a basis function.

    The finer space holds the coarser one up to kinks that a knot replaces.
    """
    from pikanid.approximators.local_basis import project

    t = np.linspace(fine.start, fine.stop, 6 * fine.n_basis)
    first, local = fine.local(t)
    band, right = np.zeros((fine.n_basis, local.shape[1])), np.zeros((fine.n_basis, 1))
    project(first, local, coarse.values(t, own), band, right)
    band[:, 0] += RIDGE
    return solve_band(factor_band(band.T), right)[:, 0]
