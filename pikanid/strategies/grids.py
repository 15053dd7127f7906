"""Where the splines have their knots and the physics its nodes.

The default is the *collocation grid*: between neighbouring breakpoints every chain of order m has a
polynomial of degree k + m - 1, joined with m - 1 continuous derivatives, and the physics is
taken at k Gauss points.  There are then exactly as many coefficients as conditions, so that the
physics residual can vanish for *any* parameters: raising λ never locks the fit, and its limit is a
Gauss-Runge-Kutta simulation of order 2k (de Boor and Swartz, SIAM J. Numer. Anal. 10, 1973).
Splines smoother than that have more conditions than coefficients; they are there for the paper's
protocol and for those who ask.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, Protocol, get_args

import numpy as np

from pikanid import errors
from pikanid.approximators import Array, LinearApproximator
from pikanid.approximators.bspline import (
    BSpline,
    aligned_breakpoints,
    curvature_breakpoints,
    knots_from_breakpoints,
    sample_breakpoints,
    split_breakpoints,
)
from pikanid.approximators.tables import gauss_nodes
from pikanid.formula.expressions import symbol
from pikanid.problem.chains import Chains, Form
from pikanid.problem.problem import Experiment, Problem
from pikanid.simulation.vectorfield import VectorField

Knots = Literal["collocation", "aligned", "uniform", "adaptive", "curvature"]
Quadrature = Literal["gauss", "integral", "sum"]

# First spacing: this many radians of the fastest linearised motion an interval.
RADIANS = 1.5  # numerical: of the fastest linearised motion, in an interval: the first spacing
PAPER_INTERVALS = 80  # definition: of Table II
_EVENLY = np.linspace(0.0, 1.0, 32)  # numerical: where the motion's rate is looked at


class Discretisation(Protocol):
    """What a relaxation needs to know of its approximators and physics nodes."""

    @property
    def knots(self) -> str:
        """How the knots were placed."""

    @property
    def quadrature(self) -> str:
        """How the physics is summed."""

    @property
    def degree(self) -> int:
        """Degree of the longest chain's approximator."""

    @property
    def n_intervals(self) -> int:
        """Intervals of all recordings together."""

    def splines(self, problem: Problem, chains: Chains
                ) -> Sequence[tuple[LinearApproximator, ...]]:
        """One approximator a chain, for every recording."""

    def nodes(self, problem: Problem, chains: Chains) -> Sequence[tuple[Array, Array]]:
        """Times and weights of the physics residual, for every recording."""


@dataclass(frozen=True, eq=False)
class Grid:
    """Breakpoints (E + 1,) of every recording; `degree` is that of the longest chain's spline."""

    knots: Knots
    breakpoints: tuple[Array, ...]
    degree: int
    quadrature: Quadrature = "gauss"

    def splines(self, problem: Problem, chains: Chains) -> list[tuple[BSpline, ...]]:
        """One spline a chain, for every recording."""
        longest = max(chains.lengths)
        joint = self.degree - longest + 1  # multiplicity that lets derivative m jump
        if joint < 1:
            raise errors.BadSetting(errors.degree_too_low(self.degree, longest))
        out = []
        for experiment, breakpoints in zip(problem.experiments, self.breakpoints, strict=True):
            inner = breakpoints[1:-1]
            times: int | np.ndarray = 1
            if self.knots == "collocation":
                times = joint
            elif self.knots == "aligned":
                times = np.where(np.isin(inner, experiment.breakpoints()), joint, 1)
            lower = longest if self.knots in ("collocation", "aligned") else 0
            out.append(tuple(
                BSpline(degree, knots_from_breakpoints(breakpoints, degree, times))
                for degree in (self.degree - (longest - m if lower else 0)
                               for m in chains.lengths)))
        return out

    def nodes(self, problem: Problem, chains: Chains) -> list[tuple[Array, Array]]:
        """Times and weights of the physics residual, for every recording."""
        out = []
        for experiment, breakpoints in zip(problem.experiments, self.breakpoints, strict=True):
            if self.quadrature == "gauss":
                # A switch that is no breakpoint splits its interval: no node straddles it.
                panels = np.union1d(breakpoints, experiment.breakpoints())
                joint = self.degree - max(chains.lengths) + 1
                count = joint if self.knots == "collocation" else self.degree
                out.append(gauss_nodes(panels, count))
                continue
            t = np.unique(np.concatenate([samples.t for samples in experiment.samples]))
            weights = np.ones(t.size)
            if self.quadrature == "integral":  # trapezoidal rule over the samples
                weights = np.zeros(t.size)
                weights[1:] += 0.5 * np.diff(t)
                weights[:-1] += 0.5 * np.diff(t)
            out.append((t, weights))
        return out

    def refined(self) -> Grid:
        """Every interval halved."""
        return replace(self, breakpoints=tuple(map(split_breakpoints, self.breakpoints)))

    @property
    def locks(self) -> bool:
        """Whether there are more physics conditions than coefficients to meet them."""
        return self.knots != "collocation" or self.quadrature != "gauss"

    @property
    def n_intervals(self) -> int:
        """Intervals of all recordings together."""
        return sum(b.size - 1 for b in self.breakpoints)


def default_grid(problem: Problem, field: VectorField, chains: Chains, *, degree: int | None,
                 intervals: int | None) -> Grid:
    """Collocation grid: breakpoints at all switches, between them as fine as the motion asks.

    The first spacing is 1.5 radians of the fastest eigenvalue of ∂f/∂x at the initial state and
    guess, at most four samples or a 64th of the duration (or the duration over `intervals`).
    Four Gauss points an interval, order 8; two where the inputs switch so often that the switches
    alone resolve the motion.
    """
    breakpoints, crowded = [], 0
    for r, experiment in enumerate(problem.experiments):
        duration = experiment.t1 - experiment.t0
        if intervals is None:
            coarse = duration / np.clip(experiment.n_samples / 4, 8, 64)
            spacing = min(coarse, RADIANS / max(fastest_rate(problem, field, r), 1e-300))
            spacing = max(spacing, duration / (4 * experiment.n_samples + 64))
        else:
            spacing = duration / intervals
        switches = experiment.breakpoints()
        crowded += switches.size > 4 * duration / spacing
        breakpoints.append(aligned_breakpoints(experiment.t0, experiment.t1, switches, spacing))
    points = 2 if 2 * crowded > len(problem.experiments) else 4
    chosen = points + max(chains.lengths) - 1 if degree is None else degree
    return Grid("collocation", tuple(breakpoints), chosen)


def check_options(settings: Any, **least: float) -> None:
    """Refuse options outside their choices, or below `least`.

    Raises:
        BadSetting: Naming the option and what it may be.
    """
    choices = {"protocol": ("default", "paper"), "form": get_args(Form), "knots": get_args(Knots),
               "physics": get_args(Quadrature)}
    for name, known in choices.items():
        value = getattr(settings, name)
        if value is not None and value not in known:
            raise errors.BadSetting(errors.bad_value(name, value, "one of " + ", ".join(known)))
    for name, bound in least.items():
        value = getattr(settings, name)
        if value is not None and not value >= bound:
            raise errors.BadSetting(errors.bad_value(name, value, f"at least {bound:g}"))


def chosen_grid(problem: Problem, knots: Knots, *, degree: int, intervals: int,
                quadrature: Quadrature) -> Grid:
    """A grid as asked for: about `intervals` intervals in every recording."""
    breakpoints = []
    for experiment in problem.experiments:
        start, stop = experiment.t0, experiment.t1
        if knots in ("collocation", "aligned"):
            breakpoints.append(aligned_breakpoints(
                start, stop, experiment.breakpoints(), (stop - start) / intervals))
        elif knots in ("adaptive", "curvature"):
            samples = max(experiment.samples, key=lambda s: s.t.size)
            breakpoints.append(
                sample_breakpoints(samples.t, start, stop, intervals) if knots == "adaptive" else
                curvature_breakpoints(samples.t, samples.y, start, stop, intervals))
        else:
            breakpoints.append(np.linspace(start, stop, intervals + 1))
    return Grid(knots, tuple(breakpoints), degree, quadrature)


def paper_intervals(problem: Problem) -> int:
    """Table II's about 80 knots, fewer where there are fewer than two samples an interval."""
    samples = min(s.t.size for e in problem.experiments for s in e.samples)
    return max(4, min(PAPER_INTERVALS, samples // 2))


def fastest_rate(problem: Problem, field: VectorField, r: int) -> float:
    """How fast the linearised motion is [1/s]: |eigenvalue| of ∂f/∂x over the inputs met.

    States that are measured are where the samples say, the others at their initial value.  The
    largest at the start counts, and the upper quartile over the samples (noise may say anything).
    """
    experiment: Experiment = problem.experiments[r]
    p = problem.parameters(problem.guess, r)
    t = experiment.t0 + (experiment.t1 - experiment.t0) * _EVENLY
    states = {symbol(name): k for k, name in enumerate(problem.model.state_names)}
    x = np.empty((64, len(states)))  # at the start, then along the samples
    x[:] = experiment.initial(p)
    for samples in experiment.samples:
        state = states.get(problem.model.outputs[samples.output].expression)
        if state is not None:
            x[32:, state] = np.interp(t, samples.t, samples.y)
    u = experiment.inputs(t)
    with np.errstate(all="ignore"):
        _, fx, _ = field.linearised_rhs(range(len(states)), ())(
            np.concatenate([t, t]), x, np.concatenate([u, u]), p)
    usable = np.isfinite(fx).all(axis=(1, 2))
    rates = _largest_eigenvalue(fx[usable])
    begin = np.count_nonzero(usable[:32])
    at_start, along = rates[:begin], rates[begin:]
    # the upper quartile; np.quantile takes longer than all the rest
    quartile = np.interp(0.75 * (along.size - 1), np.arange(along.size), np.sort(along)) if (
        along.size) else 0.0
    return max(float(at_start.max(initial=0.0)), float(quartile))


def _largest_eigenvalue(matrices: Array) -> Array:
    """Largest |eigenvalue| (K,) of matrices (K, n, n); those of two rows from their equation."""
    if matrices.shape[1:] != (2, 2):
        return np.abs(np.linalg.eigvals(matrices)).max(axis=1, initial=0.0)
    (a, b), (c, d) = matrices.transpose(1, 2, 0)
    middle, bent = 0.5 * (a + d), 0.25 * (a - d) ** 2 + b * c
    return np.where(bent < 0.0, np.hypot(middle, np.sqrt(np.abs(bent))),
                    np.abs(middle) + np.sqrt(np.abs(bent)))
