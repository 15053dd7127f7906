"""The bias experiment: estimates against the grid size, with and without exact switches."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import LinAlgError

from pikanid.errors import PikanidError
from pikanid.estimate import Estimate
from pikanid.model import Model, systems
from pikanid.optimise.schedules import Fixed
from pikanid.problem.chains import Chains, find_chains
from pikanid.problem.problem import Problem
from pikanid.recording import Recording, excitation
from pikanid.simulation import simulate
from pikanid.simulation.vectorfield import VectorField
from pikanid.strategies.grids import Grid, Quadrature, chosen_grid
from pikanid.strategies.ipda import IPDA, PAPER_DEGREE, PAPER_LAMBDA, PAPER_WARMUP
from pikanid.strategies.pikan import PIKAN
from pikanid.strategies.relaxation import RelaxedFit, Setup, relax
from pikanid.validation.study import slosh

GRIDS = (10, 20, 40, 80, 160, 320, 640)
SHOWN_GRID = 80  # of the physics residual
LAMBDAS = (1e-6, 1e-5, 1e-4, 1e-3)
RELEASE = 0.17  # initial angle [rad] of the control without input
TRUTH = np.array(list(slosh.TRUE.values()))
Fit = Callable[[int, Model, Recording], Estimate | RelaxedFit]


@dataclass(frozen=True, eq=False)
class BetweenSamples(Grid):
    """The sum of Eq. (5) over the midpoints between samples: no node on a switch."""

    def nodes(self, problem: Problem, chains: Chains) -> list[tuple[np.ndarray, np.ndarray]]:
        """Times and weights of the physics residual, for every recording."""
        return [(0.5 * (t[1:] + t[:-1]), np.ones(t.size - 1))
                for t, _ in super().nodes(problem, chains)]


@dataclass(frozen=True)
class Series:
    """Relative errors (grids, 2) of l and d; NaN where there was no result.

    `locked` marks grids where l is off by more than its own size: 1/l → 0 costs less there than
    resolving the motion.
    """

    name: str
    kind: str  # "ipda", "uniform", "exact" or "released"
    error: np.ndarray = field(repr=False)
    locked: np.ndarray = field(repr=False)  # (grids,)

    def order(self, parameter: int) -> float:
        """Exponent q of |error| ~ hᑫ, by least squares over G >= 80."""
        used = np.array(GRIDS) >= 80
        good = used & ~self.locked & np.isfinite(self.error[:, parameter])
        if good.sum() < 3:
            return float("nan")
        size = np.log(np.abs(self.error[good, parameter]))
        return float(-np.polyfit(np.log(np.array(GRIDS)[good]), size, 1)[0])


def paper_style(lam: float, physics: Quadrature = "sum") -> Fit:
    """iPDA on uniform cubic splines, second-order form, one λ."""
    return lambda grid, model, rec: IPDA(
        protocol="paper", knots="uniform", intervals=grid, physics=physics, lam=lam,
        ).fit(model, rec)


def between_samples(lam: float) -> Fit:
    """As `paper_style`, physics summed over the midpoints between samples."""

    def fit(grid: int, model: Model, recording: Recording) -> RelaxedFit:
        problem = Problem(model, recording)
        setup = Setup(problem, VectorField(model), find_chains(model, "second_order"),
                      given_start=False, weighted=False, nondimensional=False)
        even = chosen_grid(problem, "uniform", degree=PAPER_DEGREE, intervals=grid,
                           quadrature="sum")
        nodes = BetweenSamples(even.knots, even.breakpoints, even.degree, even.quadrature)
        return relax(setup, nodes, lambda noise: [Fixed(lam, PAPER_WARMUP)], refine=False)

    return fit


def network(degree: int, exact: bool) -> Fit:
    """PIKAN on one grid, λ by its own rule."""
    return lambda grid, model, rec: PIKAN(
        grid=grid, degree=degree, exact_switches=exact).fit(model, rec)


def series(name: str, kind: str, fit: Fit, recordings: list[Recording],
           model: Model | None = None) -> Series:
    """Root mean square over the recordings (with its sign, where there is one recording)."""
    start = (model or slosh.model()).with_values(slosh.START)
    errors = np.full((len(GRIDS), len(recordings), 2), np.nan)
    for g, grid in enumerate(GRIDS):
        for r, recording in enumerate(recordings):
            try:
                errors[g, r] = fit(grid, start, recording).theta / TRUTH - 1
            except (PikanidError, LinAlgError) as problem:
                print(f"{name}, G = {grid}: {problem}", flush=True)
    error = errors[:, 0] if len(recordings) == 1 else np.sqrt(np.mean(errors**2, axis=1))
    return Series(name, kind, error, ~(np.abs(errors[:, :, 0]).max(axis=1) < 1.0))


def clean() -> list[Series]:
    """Noise-free recordings; the last series has no input and starts at an angle."""
    recording = slosh.recording(slosh.SCENARIOS[0], 0)
    found = [series(f"iPDA, cubic, λ = {lam:g}", "ipda", paper_style(lam), [recording])
             for lam in LAMBDAS]
    found += [series(f"iPDA, cubic, λ = {PAPER_LAMBDA:g}, {text}", "ipda", fit, [recording])
              for text, fit in (("between samples", between_samples(PAPER_LAMBDA)),
                                ("Gauss points", paper_style(PAPER_LAMBDA, "gauss")))]
    found += [
        series(f"PIKAN, degree {k}, {'exact switches' if exact else 'uniform knots alone'}",
               "exact" if exact else "uniform", network(k, exact), [recording])
        for exact in (False, True) for k in (3, 5)]
    released = systems.sloshing().with_values(slosh.TRUE).with_initial(theta=RELEASE)
    free = simulate(released, excitation.free_decay(duration=5.0, dt=0.01))
    found += [series(f"PIKAN, degree {k}, no input at all", "released", network(k, False), [free],
                     released) for k in (3, 5)]
    return found


def noisy(seeds: int) -> list[Series]:
    """Root mean square errors over seeds at σ = 0.1°."""
    scenario = next(s for s in slosh.SCENARIOS if s.label == "dense, 0.1°")
    recordings = [slosh.recording(scenario, seed) for seed in range(seeds)]
    return [
        series(f"PIKAN, degree {k}, {'exact switches' if exact else 'uniform knots alone'}",
               "exact" if exact else "uniform", network(k, exact), recordings)
        for exact in (False, True) for k in (3, 5)]


def switches() -> np.ndarray:
    """When the input switches (S,) [s]."""
    problem = Problem(slosh.model(), slosh.recording(slosh.SCENARIOS[0], 0))
    return problem.experiments[0].breakpoints()


def physics_residual(grid: int, exact: bool, t: np.ndarray) -> np.ndarray:
    """θ̈ - f (M,) [rad/s²] of a cubic KAN fitted to clean data, at the times t (M,)."""
    recording = slosh.recording(slosh.SCENARIOS[0], 0)
    estimate = network(3, exact)(grid, slosh.model().with_values(slosh.START), recording)
    problem = Problem(estimate.fitted_model, recording)
    curve = estimate.approximator.networks[0][0]
    f = VectorField(problem.model).rhs(
        t, estimate.approximator.states(t), problem.experiments[0].inputs(t),
        problem.parameters(estimate.theta, 0))
    return curve.values(t, curve.coefficients[:, 0], 2) - f[:, 1]


def near_switches(grid: int, exact: bool) -> tuple[float, float, float]:
    """Root mean square of θ̈ - f [rad/s²], its share within a cell of a switch, their share of time.

    The first share is of ∫(θ̈ - f)².
    """
    t = np.linspace(0.0, 5.0, 20001)
    square = physics_residual(grid, exact, t) ** 2
    near = np.abs(t[:, None] - switches()).min(axis=1) <= 5.0 / grid
    return (float(np.sqrt(square.mean())), float(square[near].sum() / square.sum()),
            float(near.mean()))
