"""From a relaxed fit to an `Estimate`.

The verdict is about the parameters, not about the splines, which can follow almost any data: the
model is simulated at the estimate, and that simulation is held against the recording.  The
splines themselves are kept as `estimate.approximator`.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib.metadata import version
from typing import Any, Protocol

import numpy as np

from pikanid import errors
from pikanid.approximators import Array
from pikanid.approximators.bspline import BSpline
from pikanid.estimate import Estimate
from pikanid.estimate.data import Fit, Trajectory
from pikanid.estimate.estimate import total_cost
from pikanid.objective.adequacy import judge
from pikanid.objective.functional import Functional
from pikanid.objective.shooting import Shooting
from pikanid.optimise.box import met
from pikanid.problem.chains import Chains
from pikanid.problem.problem import Problem
from pikanid.strategies.finish import finish
from pikanid.strategies.relaxation import RelaxedFit
from pikanid.strategies.simulated import choose_steps


@dataclass(frozen=True, eq=False)
class SplineTrajectories:
    """The fitted splines: `splines[r][i]` with `coefficients[r][i]` for chain i of recording r."""

    state_names: tuple[str, ...]
    chains: Chains
    splines: tuple[tuple[BSpline, ...], ...]
    coefficients: tuple[tuple[Array, ...], ...]

    def states(self, t: Array, recording: int = 0) -> Array:
        """Approximated states (M, n) of a recording at times t (M,) [s]."""
        pairs = list(zip(self.splines[recording], self.coefficients[recording], strict=True))
        return np.column_stack([pairs[i][0].values(t, pairs[i][1], q) for i, q
                                in zip(self.chains.root, self.chains.order, strict=True)])


class Curves(Protocol):
    """Approximated states, however they are represented."""

    def states(self, t: Array, recording: int = 0) -> Array:
        """Approximated states (M, n) of a recording at times t (M,) [s]."""


def relaxed_estimate(strategy: str, fit: RelaxedFit, settings: Mapping[str, Any],
                     begun: float, curves: Curves | None = None) -> Estimate:
    """Assemble the `Estimate` of a relaxation strategy; `curves` are its splines by default."""
    used = {**settings, "knots": fit.grid.knots, "degree": fit.grid.degree,
            "intervals": fit.grid.n_intervals, "physics": fit.grid.quadrature, "lam": fit.lam,
            "data_cost": fit.data_cost, "physics_cost": fit.physics_cost,
            "effective_parameters": fit.effective,
            "naive_std": [float(s) for s in np.sqrt(np.diag(fit.naive_covariance))]}
    history = [
        {"lam": float(s.lam), "data_cost": s.data_cost, "physics_cost": s.physics_cost,
         "iterations": float(s.iterations),
         **{f.label: float(v) for f, v in zip(fit.problem.free, s.theta, strict=True)}}
        for s in fit.stages]
    return assemble(strategy, fit, used, history, begun,
                    trajectories(fit) if curves is None else curves, fit.shooting)


class Relaxed(Protocol):
    """What an `Estimate` needs of a fit with a free curve."""

    @property
    def problem(self) -> Problem:
        """What was fitted."""

    @property
    def functional(self) -> Functional:
        """Eq. (2) as fitted."""

    @property
    def theta(self) -> Array:
        """Estimate (b,)."""

    @property
    def covariance(self) -> Array:
        """Of θ (b, b)."""

    @property
    def coefficients(self) -> tuple[Array, ...]:
        """Of the curves, one vector a recording."""

    @property
    def converged(self) -> bool:
        """Whether the optimiser stopped at a minimum."""

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences to pass on."""


def assemble(strategy: str, fit: Relaxed, settings: Mapping[str, Any],
             history: list[dict[str, float]], begun: float, curves: Curves,
             shooting: Shooting | None = None) -> Estimate:
    """The `Estimate`: the model simulated at θ, judged, and the curves beside it.

    A `shooting` has its steps chosen at θ already.
    """
    chosen, shooting = shooting is not None, shooting or Shooting(fit.problem)
    try:
        if not chosen:
            choose_steps(shooting, fit.theta)
        finished = all(r.finished for r in shooting.responses(fit.theta))
    except errors.SimulationFailed:
        finished = False
    covariance = fit.covariance.copy()
    stuck = (met(fit.theta, fit.problem.lower, fit.problem.upper) if finished
             else np.diag(covariance) == 0.0)
    covariance[stuck] = covariance[:, stuck] = np.nan
    if finished:
        estimate = finish(strategy, fit.problem, shooting, fit.theta, converged=True,
                          history=history, settings=settings, seed=None, begun=begun,
                          warnings=fit.warnings, approximator=curves, covariance=covariance)
    else:
        estimate = replace(_unsimulated(strategy, fit, curves, history, settings),
                           covariance=covariance)
    return replace(estimate, converged=fit.converged, seconds=time.perf_counter() - begun)


def trajectories(fit: RelaxedFit) -> SplineTrajectories:
    """The splines of a fit, without the machinery that fitted them."""
    splines, coefficients = [], []
    for part, c in zip(fit.functional.parts, fit.coefficients, strict=True):
        splines.append(tuple(a for a in part.approximators if isinstance(a, BSpline)))
        coefficients.append(tuple(c[table.part] for table in part.physics.tops))
    return SplineTrajectories(fit.problem.model.state_names, fit.chains, tuple(splines),
                              tuple(coefficients))


def _unsimulated(strategy: str, fit: Relaxed, curves: Curves,
                 history: list[dict[str, float]], settings: Mapping[str, Any]) -> Estimate:
    """The model diverges at the estimate: all there is to show are the splines."""
    problem, functional = fit.problem, fit.functional
    fits, paths = [], []
    for r, (experiment, part) in enumerate(
            zip(problem.experiments, functional.parts, strict=True)):
        p = problem.parameters(fit.theta, r)
        for samples, sites in zip(experiment.samples, part.data, strict=True):
            x = functional.states(sites, fit.coefficients[r])
            y = functional.vector_field.outputs(sites.t, x, sites.u, p)[:, samples.output]
            output = problem.model.outputs[samples.output]
            fits.append(Fit(experiment.name, output.name, output.unit, samples.t, samples.y, y,
                            samples.sigma))
        grid = np.unique(np.concatenate([s.t for s in experiment.samples]))
        paths.append(Trajectory(grid, curves.states(grid, r)))
    adequacy = judge([f.residual for f in fits], [f.sigma for f in fits],
                     [f.measured for f in fits], fit.theta.size, times=[f.t for f in fits])
    return Estimate(
        model=problem.model, strategy=strategy, free=problem.free, theta=fit.theta,
        covariance=fit.covariance, fits=tuple(fits), trajectories=tuple(paths),
        cost=total_cost(fits), adequacy=replace(adequacy, verdict="misfit"), converged=True,
        settings=settings, history=tuple(history), version=version("pikanid"),
        warnings=(*fit.warnings, errors.estimate_not_simulated()), approximator=curves)
