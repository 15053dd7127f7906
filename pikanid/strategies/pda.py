"""PDA: splines fitted to the data alone, then parameters to the splines' derivatives.

    ĉ = argmin ‖(y - h(Bc))/σ‖² + ρ·roughness,   p̂ = argmin ∫ |x̂⁽ᵐ⁾ - f(x̂, u; p)|² dt

No simulation, no coupling: fast, and biased by whatever the splines cannot follow or smooth away.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import ClassVar, Literal

import numpy as np
from numpy.linalg import LinAlgError

from pikanid import errors
from pikanid.approximators import Array, LinearApproximator
from pikanid.estimate import Estimate
from pikanid.formula.expressions import symbol
from pikanid.model import Model
from pikanid.objective.functional import Functional
from pikanid.optimise.box import met
from pikanid.optimise.cholesky import factor_band, solve_band
from pikanid.optimise.covariance import invert
from pikanid.optimise.gauss_newton import BandedSystem, Point
from pikanid.optimise.levenberg_marquardt import descend
from pikanid.optimise.smoothing import Smoothed, smooth
from pikanid.problem.chains import Form, find_chains
from pikanid.problem.problem import Problem
from pikanid.recording import Recording
from pikanid.simulation.vectorfield import VectorField
from pikanid.strategies.data_noise import row_noise
from pikanid.strategies.grids import Knots, Quadrature, check_options, chosen_grid, paper_intervals
from pikanid.strategies.relaxation import RelaxedFit, Setup, start_is_estimated
from pikanid.strategies.relaxed_estimate import relaxed_estimate

PAPER_DEGREE = 3  # definition: of Table II
# The smoothed derivative of order m + SMOOTHER is penalised by default; the regression needs m.
SMOOTHER = 1  # numerical: derivatives beyond the highest that the regression needs
MOST_INTERVALS_A_SAMPLE = 0.5  # limit: more would follow the noise between samples
SWITCHES_A_SAMPLE = 0.05  # numerical: with more, free to bend at each, splines smooth nothing
REGRESSION_STEPS = 50  # limit: of a problem of a few unknowns


@dataclass(frozen=True)
class PDA:
    """Principal differential analysis: smooth, then regress.

    Args:
        protocol: "default" smooths by generalised cross-validation, knots aligned with the
            switches; "paper" is Table II: least-squares cubic splines with about 80 knots, sums at
            the samples.
        form, degree, intervals, knots, physics: See `IPDA`.
        smoothing: ρ, the weight of roughness; None chooses it by cross-validation ("paper": none).

    >>> import numpy as np, pikanid as pk
    >>> model = pk.systems.sloshing()
    >>> rec = pk.simulate(model, pk.excitation.two_pulse(), sigma=0.1*np.pi/180, seed=0)
    >>> est = PDA().fit(model.with_values(l_theta=0.06, d_theta=0.05), rec)
    >>> round(est.value("l_theta"), 2)  # the true 0.045, biased by the smoothing
    0.05
    """

    name: ClassVar[str] = "pda"
    slow: ClassVar[bool] = False
    protocol: Literal["default", "paper"] = "default"
    form: Form = "second_order"
    degree: int | None = None
    intervals: int | None = None
    knots: Knots | None = None
    physics: Quadrature | None = None
    smoothing: float | None = None

    def fit(self, model: Model, recordings: Recording | Sequence[Recording]) -> Estimate:
        """Estimate the model's free parameters from one recording, or from several jointly.

        Raises:
            BadRecording: A channel is missing or unusable.
            BadSetting: The outputs do not determine every spline, or a parameter acts where
                derivatives do not show it.
        """
        begun = time.perf_counter()
        fit = fit_decoupled(Problem(model, recordings), self)
        return relaxed_estimate(self.name, fit, asdict(self), begun)


def fit_decoupled(problem: Problem, settings: PDA) -> RelaxedFit:
    """PDA of a model bound to recordings.

    Raises:
        BadSetting: See `PDA.fit`.
    """
    check_options(settings, degree=1, intervals=1, smoothing=0)
    paper = settings.protocol == "paper"
    chains = find_chains(problem.model, settings.form)
    degree = settings.degree or (PAPER_DEGREE if paper else max(chains.lengths) + 3)
    grid = chosen_grid(
        problem, settings.knots or ("adaptive" if paper or _crowded(problem) else "aligned"),
        degree=degree,
        intervals=settings.intervals or (paper_intervals(problem) if paper else _fine(problem)),
        quadrature=settings.physics or ("sum" if paper else "gauss"))
    given = not paper and not start_is_estimated(problem)
    setup = Setup(problem, VectorField(problem.model), chains, given_start=given,
                  weighted=not paper, nondimensional=False)
    functional = setup.functional(grid)
    extra = min(SMOOTHER, degree - max(chains.lengths))
    system = BandedSystem(functional.smoothing(extra))
    rho = settings.smoothing if settings.smoothing is not None or not paper else 0.0
    smoothed = smooth_data(system, rho)
    point, converged = regress(functional, smoothed.point)
    noise = row_noise(functional, system.linearise(point, 0.0), smoothed.effective)
    covariance = _covariance(functional, system, point, smoothed.rho, noise)
    at = BandedSystem(functional).linearise(point, 1.0)
    return RelaxedFit(problem, point.theta, covariance, covariance, point.coefficients, functional,
                      grid, 0.0, (), at.data_cost, at.physics_cost, smoothed.effective, converged)


def smooth_data(system: BandedSystem, rho: float | None) -> Smoothed:
    """The data-only fit with a given roughness weight, or with the cross-validated one.

    Raises:
        BadSetting: The outputs do not determine every spline.
    """
    functional = system.functional
    theta = functional.problem.guess
    flat = Point(tuple(functional.resting(r, theta) for r in range(len(functional.parts))), theta)
    found = smooth(system, flat, rho)
    unseen = [functional.problem.model.state_names[functional.chains.root.index(i)]
              for i in range(len(functional.chains.top)) if not _is_seen(functional, i)]
    if found is None or unseen:
        names = unseen or functional.problem.model.state_names
        raise errors.BadSetting(errors.smoothing_undetermined(list(names)))
    return found


def regress(functional: Functional, point: Point) -> tuple[Point, bool]:
    """θ that minimises the physics residual of fixed splines, within bounds (Gauss-Newton).

    Raises:
        BadSetting: A parameter has no influence on the derivatives.
    """
    problem = functional.problem
    theta, lower, upper = point.theta.copy(), problem.lower.copy(), problem.upper.copy()
    for k, value in _first_states(functional, point).items():
        theta[k] = lower[k] = upper[k] = value
    found = descend(lambda q: _physics(functional, replace(point, theta=q)), theta, lower, upper,
                    REGRESSION_STEPS, lambda at: 1e-12 * at.cost)
    assert found is not None
    idle = [f.label for f, g, fixed in zip(problem.free, np.diag(found.at.gram), lower >= upper,
                                           strict=True) if g <= 0.0 and not fixed]
    if idle:
        raise errors.BadSetting(errors.relaxation_cannot_see(
            idle, "it does not act on the derivatives of the states"))
    return replace(point, theta=found.theta), found.converged


def _first_states(functional: Functional, point: Point) -> dict[int, float]:
    """Initial states that are parameters of their own, read off the smooth curve at t0."""
    problem, found = functional.problem, {}
    chains = functional.chains
    for r, (e, part) in enumerate(zip(problem.experiments, functional.parts, strict=True)):
        for state, i, q in zip(problem.model.states, chains.root, chains.order, strict=True):
            for k, f in enumerate(problem.free):
                if state.initial == symbol(f.name) and f.recording in (None, r):
                    own = point.coefficients[r][part.physics.tops[i].part]
                    spline = part.approximators[i]
                    assert isinstance(spline, LinearApproximator)
                    found[k] = float((spline.basis(np.array([e.t0]), q) @ own)[0])
    return found


@dataclass(frozen=True, eq=False)
class _Physics:
    """Sum of squares of the physics residual, and its normal equations."""

    cost: float
    gram: Array
    slope: Array

    def normal(self) -> tuple[Array, Array]:
        return self.gram, self.slope


def _physics(functional: Functional, point: Point) -> _Physics:
    size = point.theta.size
    cost, gram, slope = 0.0, np.zeros((size, size)), np.zeros(size)
    for r, c in enumerate(point.coefficients):
        _, columns = functional.problem.columns(r)
        rows = functional.physics_rows(r, c, point.theta, 1.0)
        assert rows.by_theta is not None
        jacobian = rows.by_theta.reshape(-1, columns.size)
        residual = rows.residual.ravel()
        cost += float(residual @ residual)
        gram[np.ix_(columns, columns)] += jacobian.T @ jacobian
        slope[columns] += jacobian.T @ residual
    return _Physics(cost, gram, slope)


def _covariance(functional: Functional, system: BandedSystem, point: Point, rho: float,
                noise: list[Array | float]) -> Array:
    """Noise carried through both steps: dθ = -(J_θᵀJ_θ)⁻¹ J_θᵀJ_c A⁻¹ B_dᵀ dε (residuals small)."""
    problem = functional.problem
    gram = _physics(functional, point).gram
    stuck = met(point.theta, problem.lower, problem.upper)
    stuck[list(_first_states(functional, point))] = True  # these are not regressed
    bread = invert(gram, ~stuck)
    coupled = BandedSystem(functional).linearise(point, 1.0)
    alone = BandedSystem(functional).linearise(point, 0.0)
    penalised = system.linearise(point, rho)
    meat, first = np.zeros_like(bread), 0
    for r, part in enumerate(functional.parts):
        columns, order = system.columns[r], system.assemblers[r].order
        try:
            factor = factor_band(penalised.blocks[r].band)
        except LinAlgError:  # a handful of samples: the cross-validated weight can vanish
            names = problem.model.state_names
            raise errors.BadSetting(errors.smoothing_undetermined(list(names))) from None
        border = coupled.blocks[r].border - alone.blocks[r].border
        carried = np.zeros((part.n_coefficients, columns.size))
        carried[order[part.held.size:]] = solve_band(factor, border)
        rows = functional.data_rows(r, point.coefficients[r], point.theta)
        for sites, row in zip(part.data, rows, strict=True):
            assert row.by_state is not None
            response = np.zeros((sites.t.size, point.theta.size))
            for s, table in enumerate(sites.states):
                own = row.by_state[:, 0, s, None] * (table.basis @ carried[table.part])
                response[:, columns] += own
            response *= np.reshape(noise[first], (-1, 1))
            meat += response.T @ response
            first += 1
    return bread @ meat @ bread


def _is_seen(functional: Functional, chain: int) -> bool:
    """Whether any output depends on a state of the chain."""
    model = functional.problem.model
    names = {model.state_names[s] for s, i in enumerate(functional.chains.root) if i == chain}
    return any(names & {q.name for q in o.expression.free_symbols} for o in model.outputs)


def _crowded(problem: Problem) -> bool:
    """Whether inputs switch so often that splines free to bend at every switch smooth nothing."""
    switches = sum(e.breakpoints().size for e in problem.experiments)
    return switches > 8 + SWITCHES_A_SAMPLE * problem.n_samples


def _fine(problem: Problem) -> int:
    samples = max(s.t.size for e in problem.experiments for s in e.samples)
    return max(8, int(MOST_INTERVALS_A_SAMPLE * samples))
