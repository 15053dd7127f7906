"""iPDA: splines and parameters fitted together, the physics enforced more and more (Eq. 2, 5)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from pikanid import errors
from pikanid.chains import Form, find_chains
from pikanid.optimise.schedules import Continuation, Fixed, Schedule
from pikanid.problem import Problem
from pikanid.simulation.vectorfield import VectorField
from pikanid.strategies.grids import Grid, Knots, Quadrature, chosen_grid, default_grid
from pikanid.strategies.relaxation import RelaxedFit, Setup, relax

# Table II: cubic splines, about 80 knots, λ = 1e-4 (doubled for the sparse scenario), 15 warm-up
# iterations.  "Sparse" is read as fewer samples than twice the knots.
PAPER_INTERVALS = 80
PAPER_DEGREE = 3
PAPER_LAMBDA = 1e-4
PAPER_WARMUP = 15
# A data cost above this multiple of what the noise explains is suspected to be a lock.
LOCK_FACTOR = 1.5


@dataclass(frozen=True)
class IPDASettings:
    """Options of iPDA; None leaves the choice to the protocol.

    protocol: "default" chooses knots and λ so that neither biases visibly; "paper" is Table II.
    form: "second_order" (a state that is a derivative of another shares its spline) or "state".
    knots: "collocation", "aligned" (repeated at the switches), "uniform", "adaptive" (as many
        samples between any two), "curvature" (denser where the data bend).
    physics: "gauss" (integral, Gauss points), "integral" (trapezoidal over the samples) or "sum".
    lam: a fixed λ, in the units of Eq. (2) under "paper", dimensionless otherwise.
    """

    protocol: Literal["default", "paper"] = "default"
    form: Form = "second_order"
    degree: int | None = None
    intervals: int | None = None
    knots: Knots | None = None
    physics: Quadrature | None = None
    lam: float | None = None
    warmup: int | None = None


def fit_relaxed(problem: Problem, settings: IPDASettings) -> RelaxedFit:
    """iPDA of a model bound to recordings.

    Raises:
        BadSetting: For options that cannot work together, or a delay that is to be estimated.
    """
    _check(settings)
    paper = settings.protocol == "paper"
    field = VectorField(problem.model)
    chains = find_chains(problem.model, settings.form)
    # The paper leaves the start free; an estimated initial state needs its parameters tied.
    given = not paper or _start_is_estimated(problem)
    setup = Setup(problem, field, chains, given_start=given, weighted=not paper,
                  nondimensional=not paper)
    chosen = settings.knots or ("adaptive" if paper else "collocation")
    settle = not paper and chosen == "collocation" and settings.intervals is None
    grid: Grid
    if chosen == "collocation" and settings.physics in (None, "gauss"):
        grid = default_grid(problem, field, chains, degree=settings.degree,
                            intervals=settings.intervals)
    else:
        degree = settings.degree or (PAPER_DEGREE if paper else max(chains.lengths) + 3)
        grid = chosen_grid(
            problem, chosen, degree=degree, intervals=settings.intervals or _paper_knots(problem),
            quadrature=settings.physics or ("sum" if paper else "gauss"))

    def schedule(noise: float) -> Schedule:
        if settings.lam is not None or paper:
            warmup = PAPER_WARMUP if settings.warmup is None else settings.warmup
            return Fixed(_paper_lambda(problem) if settings.lam is None else settings.lam, warmup)
        ceiling = np.inf
        if grid.knots != "collocation":
            ceiling = LOCK_FACTOR * noise**2 * problem.n_samples
        warmup = 3 if settings.warmup is None else settings.warmup
        return Continuation(warmup=warmup, ceiling=ceiling)

    return relax(setup, grid, schedule, refine=settle)


def _paper_knots(problem: Problem) -> int:
    samples = min(s.t.size for e in problem.experiments for s in e.samples)
    return max(4, min(PAPER_INTERVALS, samples // 2))


def _paper_lambda(problem: Problem) -> float:
    samples = min(s.t.size for e in problem.experiments for s in e.samples)
    return PAPER_LAMBDA * (2.0 if samples < 2 * PAPER_INTERVALS else 1.0)


def _start_is_estimated(problem: Problem) -> bool:
    free = set(problem.model.free_names)
    return any(free & {s.name for s in state.initial.free_symbols}
               for state in problem.model.states)


def _check(settings: IPDASettings) -> None:
    for name, least in (("degree", 1), ("intervals", 1), ("warmup", 0)):
        value = getattr(settings, name)
        if value is not None and value < least:
            raise errors.BadSetting(errors.bad_value(name, value, f"at least {least}"))
    if settings.lam is not None and not settings.lam > 0.0:
        raise errors.BadSetting(errors.bad_value("lam", settings.lam, "positive"))
