"""PIKAN: a Kolmogorov-Arnold network as the trajectory, fitted together with the parameters.

The approximator of Table I is a real pykan network.  A shallow one with w_b = 0 is a spline (Eq. 4),
so that Gauss-Newton on all unknowns is banded, as in iPDA; its grid is refined 10 → 20 → 40 → ...
until the parameters stay where they are, each grid starting from the last one's curve.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Literal

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import spsolve

from pikanid import errors
from pikanid.approximators import Array
from pikanid.approximators.kan import ShallowKAN
from pikanid.chains import Chains, Form, find_chains
from pikanid.estimate import Estimate
from pikanid.functional import Functional
from pikanid.model import Model
from pikanid.optimise.gauss_newton import BandedSystem, Point
from pikanid.optimise.schedules import Continuation, Fixed, Stage, moved
from pikanid.problem import Problem
from pikanid.recording import Recording
from pikanid.simulation.vectorfield import VectorField
from pikanid.strategies.grids import fastest_rate
from pikanid.strategies.kan_grids import KanGrid
from pikanid.strategies.kan_paper import paper_fit
from pikanid.strategies.relaxation import (
    GRID_SETTLED,
    RelaxedFit,
    Setup,
    conclude,
    first_point,
    follow,
    noise_level,
    physics_scale,
    start_is_estimated,
)
from pikanid.strategies.relaxed_estimate import relaxed_estimate

FIRST_GRID = 10
RADIANS = 1.0  # of the fastest linearised motion, at most, in a cell of the first grid that counts
Progress = Callable[[dict[str, float]], None]


@dataclass(frozen=True)
class PIKAN:
    """Physics-informed KAN.

    Parameters
    ----------
    protocol : "default": Gauss-Newton, refinement until the discretisation no longer shows,
        switches exact; "paper": Table II (cubic, 10 → 20 → 40, λ 0 → 0.1, then 500 L-BFGS steps at
        λ = 1 with 501 collocation points), where the gradient norm at the stop is reported
    grid : cells of the only grid, in place of refinement
    degree : of the edges' splines
    lam : a fixed λ (dimensionless, as in `IPDA`), in place of continuation
    exact_switches : add the known kinks of the trajectory at the input switches
    form : "second_order" or "state", as in `IPDA`
    max_grid : finest grid tried
    seed : of pykan's initial coefficients
    progress : called with loss parts, λ and grid after every stage

    >>> import numpy as np, pikanid as pk
    >>> model = pk.systems.sloshing()
    >>> rec = pk.simulate(model, pk.excitation.two_pulse(), sigma=0.1*np.pi/180, seed=0)
    >>> est = PIKAN().fit(model.with_values(l_theta=0.06, d_theta=0.05), rec)
    >>> round(est.value("l_theta"), 4), type(est.approximator.kan).__mro__[1].__name__
    (0.045, 'MultKAN')
    """

    protocol: Literal["default", "paper"] = "default"
    grid: int | None = None
    degree: int | None = None
    lam: float | None = None
    exact_switches: bool = True
    form: Form = "second_order"
    max_grid: int = 640
    seed: int = 0
    progress: Progress | None = None

    def fit(self, model: Model, recordings: Recording | Sequence[Recording]) -> Estimate:
        """Estimate the model's free parameters from one recording, or from several jointly.

        `estimate.approximator` holds the networks (`.kan` is the pykan model of the first
        recording and chain, `.networks` all of them), which evaluate to the fitted curve.

        Raises
        ------
        pikanid.errors.BadRecording : a channel is missing or unusable
        pikanid.errors.BadSetting : options that cannot work, or a delay to be estimated
        """
        begun = time.perf_counter()
        problem = Problem(model, recordings)
        settings = {k: v for k, v in asdict(replace(self, progress=None)).items()
                    if k != "progress"}
        if self.protocol == "paper":
            fit, more = paper_fit(_setup(problem, self.form, paper=True), self.degree or 3,
                                  self.seed, self.progress)
            settings |= more
        else:
            fit = self._default(problem)
        return relaxed_estimate("pikan", fit, settings, begun, KanTrajectories.of(fit))

    def _default(self, problem: Problem) -> RelaxedFit:
        setup = _setup(problem, self.form, paper=False)
        longest = max(setup.chains.lengths)
        grid = KanGrid(self.grid or FIRST_GRID, self.degree or max(5, longest + 3),
                       self.exact_switches, seed=self.seed)
        if self.grid is None:
            cells = _cells(setup)
            while grid.intervals < cells and grid.intervals < self.max_grid:
                grid = grid.refined()
        functional = setup.functional(grid)
        point, smoothed = first_point(functional)
        noise = noise_level(functional, smoothed)
        scale = physics_scale(functional, point, noise)
        stages: list[Stage] = []
        notes: list[str] = []
        start = 1.0
        while True:
            functional = functional.with_scale(scale)
            system = BandedSystem(functional)
            plan = Fixed(self.lam, 15) if self.lam else Continuation(
                noise**2 * problem.n_samples, True, start=start, factor=10.0, limit=1e8,
                warmup=0 if stages else 3)
            found, outcome, remarks = follow(system, point, plan)
            self._tell(grid, found)
            stages += found
            before = stages[-len(found) - 1] if len(stages) > len(found) else None
            gap = np.inf if before is None else moved(
                before.theta, found[-1].theta, found[-1].std, 1e-6)
            if gap <= GRID_SETTLED or self.grid is not None:
                break
            if 2 * grid.intervals > self.max_grid:
                notes.append(errors.grid_not_settled(gap, grid.intervals))
                break
            grid = grid.refined()
            finer = setup.functional(grid)
            point = _carried(functional, finer, outcome.at.point)
            start, functional = max(1.0, found[-1].lam / 10), finer
        if self.grid is not None:
            notes += remarks
        if not outcome.converged:
            notes.append(errors.not_converged(found[-1].lam))
        return conclude(setup, grid, system, outcome, stages, notes)

    def _tell(self, grid: KanGrid, stages: Sequence[Stage]) -> None:
        if self.progress is not None:
            for s in stages:
                self.progress({"grid": float(grid.intervals), "lam": s.lam, "data": s.data_cost,
                               "physics": s.physics_cost})


@dataclass(frozen=True, eq=False)
class KanTrajectories:
    """The fitted networks: `networks[r][i]` is chain i of recording r."""

    chains: Chains
    networks: tuple[tuple[ShallowKAN, ...], ...]

    @staticmethod
    def of(fit: RelaxedFit) -> KanTrajectories:
        """The networks of a fit, with its coefficients put into the pykan models."""
        found = []
        for part, c in zip(fit.functional.parts, fit.coefficients, strict=True):
            own = []
            for network, table in zip(part.approximators, part.physics.tops, strict=True):
                assert isinstance(network, ShallowKAN)
                network.set_coefficients(c[table.part])
                own.append(network)
            found.append(tuple(own))
        return KanTrajectories(fit.chains, tuple(found))

    @property
    def kan(self) -> Any:
        """The pykan model of the first recording's first chain; kinks stand beside it."""
        return self.networks[0][0].kan

    def states(self, t: Array, recording: int = 0) -> Array:
        """Approximated states (M, n) of a recording at times t (M,) [s]."""
        own = self.networks[recording]
        return np.column_stack([
            own[i].values(t, own[i].coefficients[:, 0], q)
            for i, q in zip(self.chains.root, self.chains.order, strict=True)])


def _setup(problem: Problem, form: Form, *, paper: bool) -> Setup:
    return Setup(problem, VectorField(problem.model), find_chains(problem.model, form),
                 given_start=not paper or start_is_estimated(problem), weighted=not paper,
                 nondimensional=not paper)


def _cells(setup: Setup) -> float:
    """Cells that the fastest linearised motion asks for."""
    rates = [fastest_rate(setup.problem, setup.field, r) * (e.t1 - e.t0)
             for r, e in enumerate(setup.problem.experiments)]
    return max(rates) / RADIANS


def _carried(old: Functional, new: Functional, point: Point) -> Point:
    """The same curves on a finer grid, by least squares at six points a basis function.

    The finer space holds the coarser one up to kinks that a knot replaces.
    """
    coefficients = []
    for r, (before, after) in enumerate(zip(old.parts, new.parts, strict=True)):
        pieces = []
        for i, fine in enumerate(after.approximators):
            coarse = before.approximators[i]
            assert isinstance(fine, ShallowKAN) and isinstance(coarse, ShallowKAN)
            t = np.linspace(fine.start, fine.stop, 6 * fine.n_basis)
            basis = fine.basis(t)
            values = coarse.basis(t) @ point.coefficients[r][before.physics.tops[i].part]
            normal = basis.T @ basis + 1e-12 * sparse.eye_array(fine.n_basis)
            pieces.append(spsolve(normal.tocsc(), basis.T @ values))
        coefficients.append(new.complete(r, np.concatenate(pieces), point.theta))
    return Point(tuple(coefficients), point.theta)
