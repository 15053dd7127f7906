"""Where Table II's PIKAN stops: the estimate against the number of L-BFGS steps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import OptimizeResult, minimize

from pikanid.approximators.kan import ShallowKAN
from pikanid.objective.functional import Functional
from pikanid.optimise.gauss_newton import BandedSystem, Point, gauss_newton
from pikanid.problem.chains import find_chains
from pikanid.problem.problem import Problem
from pikanid.simulation.vectorfield import VectorField
from pikanid.strategies.kan_grids import KanGrid
from pikanid.strategies.kan_paper import COLLOCATION, STAGES
from pikanid.strategies.relaxation import Setup, first_point
from pikanid.validation.study import slosh

LOOK = (0, 10, 20, 50, 100, 200, 500, 1000, 2000)  # steps of a stage after which to look
MOST = LOOK[-1]  # in the last stage, where the protocol stops after STAGES[-1][2]
# Table II gives λ "0 → 0.1" and then 1, not at which grid λ rises: two readings.
READINGS = {
    "λ rises with the grid": STAGES,
    "λ = 1 at the end alone": tuple(
        (cells, lam if lam == STAGES[-1][1] else 0.0, steps) for cells, lam, steps in STAGES),
}
LENGTHS = (0.03, 0.04, 0.045, 0.05, 0.06, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 20.0, 100.0, 1e3, 1e4)
OPTIONS = {"ftol": 1e-15, "gtol": 1e-10, "maxcor": 20}  # those of `protocol="paper"`
WIDE = {"l_theta": (1e-3, 1e4), "d_theta": (0.0, 1e4)}  # bounds that do not stop the minimiser


@dataclass(frozen=True)
class Stop:
    """What L-BFGS would return if it were stopped after so many steps of a stage."""

    cells: int
    lam: float
    steps: int
    theta: np.ndarray  # l [m], d [N s/m]
    cost: float
    gradient: float  # norm, in coefficients and in parameters over their guesses


def descent(stages: Sequence[tuple[int, float, int]], seed: int) -> tuple[list[Stop], Stop]:
    """Stops along all stages with physics on clean data; the minimum that Gauss-Newton finds there.

    The model's bounds (l below 2 m) hold for L-BFGS, not for the minimum.
    """
    setup = _setup(wide=False)
    theta, network = setup.problem.guess, None
    stops: list[Stop] = []
    for number, (cells, lam, most) in enumerate(stages):
        functional = setup.functional(KanGrid(
            cells, 3, exact_switches=False, quadrature="sum", count=COLLOCATION, seed=seed))
        own = functional.parts[0].approximators[0]
        assert isinstance(own, ShallowKAN)
        if network is not None:
            finer = network if network.n_basis == own.n_basis else network.refined(cells)
            own.set_coefficients(finer.coefficients)
        network = own
        last = number == len(stages) - 1
        most = MOST if last else most
        path = _lbfgs(functional, np.concatenate([own.coefficients[:, 0], theta]), lam,
                      [*(k for k in LOOK if k < most), most])
        if lam > 0.0:
            stops += [_stop(functional, z, cells, lam, k) for k, z in path]
        end = path[-1][1]
        own.set_coefficients(end[:own.n_basis])
        theta = end[own.n_basis:]
    setup = _setup(wide=True)
    free = setup.functional(KanGrid(
        cells, 3, exact_switches=False, quadrature="sum", count=COLLOCATION, seed=seed))
    found = gauss_newton(BandedSystem(free), _point(free, end), lam, setup.problem.lower,
                         setup.problem.upper, iterations=500)
    at = found.at.point
    return stops, _stop(free, np.concatenate([*at.coefficients, at.theta]), cells, lam,
                        found.iterations)


def profile(lengths: Sequence[float] = LENGTHS) -> list[Stop]:
    """The least loss of the last stage for given l, over coefficients and d (Gauss-Newton)."""
    setup, (cells, lam, _) = _setup(wide=True), STAGES[-1]
    functional = setup.functional(KanGrid(
        cells, 3, exact_switches=False, quadrature="sum", count=COLLOCATION))
    system = BandedSystem(functional)
    point, _ = first_point(system)
    found = []
    for length in lengths:
        low, high = (np.array([length, end]) for end in WIDE["d_theta"])
        start = Point(point.coefficients, np.array([length, slosh.TRUE["d_theta"]]))
        outcome = gauss_newton(system, start, lam, low, high, iterations=500)
        at = outcome.at.point
        found.append(_stop(functional, np.concatenate([*at.coefficients, at.theta]), cells, lam,
                           outcome.iterations))
    return found


def _setup(*, wide: bool) -> Setup:
    model = slosh.model().with_values(slosh.START)
    problem = Problem(model.with_bounds(**WIDE) if wide else model,
                      slosh.recording(slosh.SCENARIOS[0], 0))
    return Setup(problem, VectorField(problem.model), find_chains(problem.model, "second_order"),
                 given_start=False, weighted=False, nondimensional=False)


def _lbfgs(functional: Functional, start: np.ndarray, lam: float, steps: Sequence[int]
           ) -> list[tuple[int, np.ndarray]]:
    """Iterates (coefficients, θ) after the given numbers of steps, as far as there are any."""
    unit = _unit(functional)
    seen = [start / unit]

    def note(intermediate_result: OptimizeResult) -> None:
        seen.append(intermediate_result.x.copy())

    def cost(z: np.ndarray) -> tuple[float, np.ndarray]:
        value, gradient = _cost(functional, z * unit, lam)
        return value, gradient * unit

    problem = functional.problem
    free = start.size - problem.guess.size
    low = np.concatenate([np.full(free, -np.inf), problem.lower]) / unit
    high = np.concatenate([np.full(free, np.inf), problem.upper]) / unit
    minimize(cost, seen[0], jac=True, method="L-BFGS-B", callback=note,
             bounds=list(zip(low, high, strict=True)),
             options={**OPTIONS, "maxiter": steps[-1], "maxfun": 10 * steps[-1]})
    reached = [*(k for k in steps if k < len(seen) - 1), min(steps[-1], len(seen) - 1)]
    return [(k, seen[k] * unit) for k in reached]


def _cost(functional: Functional, z: np.ndarray, lam: float) -> tuple[float, np.ndarray]:
    at = _point(functional, z)
    residual = functional.residual(at.coefficients, at.theta, lam)
    jacobian = functional.jacobian(at.coefficients, at.theta, lam)
    return float(residual @ residual), 2 * (jacobian.T @ residual)


def _stop(functional: Functional, z: np.ndarray, cells: int, lam: float, steps: int) -> Stop:
    value, gradient = _cost(functional, z, lam)
    norm = float(np.linalg.norm(gradient * _unit(functional)))
    return Stop(cells, lam, steps, _point(functional, z).theta, value, norm)


def _point(functional: Functional, z: np.ndarray) -> Point:
    size = functional.parts[0].n_coefficients
    return Point((z[:size],), z[size:])


def _unit(functional: Functional) -> np.ndarray:
    """Parameters are counted in units of their guess."""
    return np.concatenate([np.ones(functional.parts[0].n_coefficients), functional.problem.guess])
