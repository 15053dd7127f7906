"""iPDA: splines and parameters fitted together, the physics enforced more and more (Eq. 2, 5)."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Literal

from pikanid import errors
from pikanid.estimate import Estimate
from pikanid.model import Model
from pikanid.optimise.schedules import LOCKABLE_BIAS, Continuation, Fixed, Schedule
from pikanid.problem.chains import Form, find_chains
from pikanid.problem.problem import Problem
from pikanid.recording import Recording
from pikanid.settings import of_kind
from pikanid.simulation.vectorfield import VectorField
from pikanid.strategies.grids import (
    PAPER_INTERVALS,
    Grid,
    Knots,
    Quadrature,
    check_options,
    chosen_grid,
    default_grid,
    paper_intervals,
)
from pikanid.strategies.relaxation import RelaxedFit, Setup, relax, start_is_estimated
from pikanid.strategies.relaxed_estimate import relaxed_estimate
from pikanid.strategies.settings import RELAXATION, RelaxationSettings, recorded

# Table II: cubic splines, about 80 knots, λ = 1e-4 (doubled for the sparse scenario), 15 warm-up
# iterations.  "Sparse" is read as fewer samples than twice the knots.
PAPER_DEGREE = 3  # definition: of Table II
PAPER_LAMBDA = 1e-4  # definition: of Table II
PAPER_WARMUP = 15  # definition: of Table II
# Of a sample's share of the noise: θ is then within a tenth of a standard error of its place at
# that λ, and where the bias falls a hundredfold from λ to λ that hides a thousandth at most.
ENOUGH = 1e-2  # numerical: that a fit at a λ on the way may still promise
STEADY_STARTS = (1e4, 1e8)  # numerical: λ at which physics keeps to the guess, as shooting does


@dataclass(frozen=True)
class IPDA:
    """Iterated principal differential analysis: Gauss-Newton on splines and parameters together.

    Args:
        protocol: "default" chooses knots and λ so that neither biases visibly; "paper" is Table II.
            None elsewhere leaves the choice to it.
        form: "second_order" (a state that is another's derivative shares its spline) or "state".
        degree: Of the splines, for the longest chain.
        intervals: Between knots, per recording.
        knots: "collocation" (as many coefficients as physics conditions), "aligned" (repeated at
            the input switches), "uniform", "adaptive" (equally many samples between any two) or
            "curvature" (denser where the data bend).
        physics: "gauss" (integral by Gauss points), "integral" (trapezoidal rule over the samples)
            or "sum" (over the samples, Eq. 5).
        lam: A fixed λ, as in Eq. (2) under "paper", else dimensionless: at 1 a physics residual as
            large as the physics itself costs as much as every sample being off by its σ.
        warmup: Iterations at the first λ in which only the splines move; by default none, under
            "paper" 15.
        settings: When grid and λ count as settled.

    >>> import numpy as np, pikanid as pk
    >>> model = pk.systems.sloshing()
    >>> rec = pk.simulate(model, pk.excitation.two_pulse(), sigma=0.1*np.pi/180, seed=0)
    >>> est = IPDA().fit(model.with_values(l_theta=0.06, d_theta=0.05), rec)
    >>> round(est.value("l_theta"), 4)
    0.045
    """

    name: ClassVar[str] = "ipda"
    slow: ClassVar[bool] = False
    protocol: Literal["default", "paper"] = "default"
    form: Form = "second_order"
    degree: int | None = None
    intervals: int | None = None
    knots: Knots | None = None
    physics: Quadrature | None = None
    lam: float | None = None
    warmup: int | None = None
    settings: RelaxationSettings = RELAXATION

    def fit(self, model: Model, recordings: Recording | Sequence[Recording]) -> Estimate:
        """Estimate the model's free parameters from one recording, or from several jointly.

        Raises:
            BadRecording: A channel is missing or unusable.
            BadSetting: Options that cannot work together, or a delay to be estimated.
        """
        begun = time.perf_counter()
        fit = fit_relaxed(Problem(model, recordings), self)
        return relaxed_estimate(self.name, fit, recorded(self), begun)


def fit_relaxed(problem: Problem, settings: IPDA) -> RelaxedFit:
    """iPDA of a model bound to recordings, with all that it found on the way.

    Raises:
        BadSetting: Options that cannot work together, or a delay to be estimated.
    """
    check_options(settings, degree=1, intervals=1, warmup=0)
    if settings.lam is not None and not settings.lam > 0.0:
        raise errors.BadSetting(errors.bad_value("lam", settings.lam, "positive"))
    paper = settings.protocol == "paper"
    field = VectorField(problem.model)
    chains = find_chains(problem.model, settings.form)
    # The paper leaves the start free; an estimated initial state needs its parameters tied.
    given = not paper or start_is_estimated(problem)
    setup = Setup(problem, field, chains, given_start=given, weighted=not paper,
                  nondimensional=not paper,
                  settings=of_kind(settings.settings, RelaxationSettings))
    chosen = settings.knots or ("adaptive" if paper else "collocation")
    settle = not paper and chosen == "collocation" and settings.intervals is None
    grid: Grid
    if chosen == "collocation" and settings.physics in (None, "gauss"):
        grid = default_grid(problem, field, chains, degree=settings.degree,
                            intervals=settings.intervals)
    else:
        degree = settings.degree or (PAPER_DEGREE if paper else max(chains.lengths) + 3)
        grid = chosen_grid(
            problem, chosen, degree=degree,
            intervals=settings.intervals or paper_intervals(problem),
            quadrature=settings.physics or ("sum" if paper else "gauss"))

    def plans(noise: float) -> list[Schedule]:
        if settings.lam is not None or paper:
            warmup = PAPER_WARMUP if settings.warmup is None else settings.warmup
            return [Fixed(settings.lam or _paper_lambda(problem), warmup)]
        gentle = Continuation(noise**2 * problem.n_samples, grid.locks,
                              warmup=settings.warmup or 0)
        if grid.locks:
            return [replace(gentle, factor=10.0, bias=LOCKABLE_BIAS)]
        # Weak physics at first tolerates a bad guess; where that goes astray, strong physics keeps
        # to the guess, as shooting does.
        steady = replace(gentle, factor=100.0, warmup=0)
        return [replace(gentle, enough=ENOUGH * noise**2),
                *(replace(steady, start=start) for start in STEADY_STARTS)]

    return relax(setup, grid, plans, refine=settle)


def _paper_lambda(problem: Problem) -> float:
    samples = min(s.t.size for e in problem.experiments for s in e.samples)
    return PAPER_LAMBDA * (2.0 if samples < 2 * PAPER_INTERVALS else 1.0)
