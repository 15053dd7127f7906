"""From an optimum of a shooting fit to an `Estimate`: covariance, verdict, warnings."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from pikanid import errors
from pikanid.estimate import Estimate
from pikanid.estimate.data import Fit, Trajectory
from pikanid.estimate.estimate import total_cost
from pikanid.estimate.outlying import loose_warning, outlying_warning
from pikanid.estimate.rounding import with_unit
from pikanid.formula.units import parse
from pikanid.objective.shooting import Shooting
from pikanid.optimise.box import met
from pikanid.optimise.propagation import propagated
from pikanid.problem.problem import FreeParameter, Problem
from pikanid.storage.version import __version__
from pikanid.strategies.growth import growth
from pikanid.uncertainty.bounded import with_bounds
from pikanid.uncertainty.information import Directions, undetermined_warnings
from pikanid.uncertainty.settings import USUAL, UncertaintySettings


def finish(strategy: str, problem: Problem, shooting: Shooting, theta: np.ndarray, *,
           converged: bool, history: Sequence[Mapping[str, float]], settings: Mapping[str, Any],
           seed: int | None, begun: float, warnings: Sequence[str] = (),
           approximator: Any = None, uncertainty: UncertaintySettings = USUAL,
           covariance: np.ndarray | None = None, stable: bool = False) -> Estimate:
    """Assemble the `Estimate` at θ; its `covariance`, unless given, is that of least squares.

    Whether errors grow along the recordings is looked at, unless they are known to be `stable`.
    """
    jacobian = shooting.jacobian(theta)
    adequacy = shooting.adequacy(theta)
    r = shooting.residual(theta)
    scale = float(r @ r) / adequacy.dof if adequacy.source != "given" else 1.0
    at_bound = met(theta, problem.lower, problem.upper)
    shown = Directions.of(jacobian, ~at_bound)

    def wider(known: np.ndarray) -> np.ndarray:
        return with_bounds(known, jacobian / scale**0.5, r / scale**0.5, theta, problem.lower,
                           problem.upper, at_bound) if at_bound.any() else known

    cov = wider(shown.covariance * scale)
    covariance = cov if covariance is None else wider(covariance)
    fits, trajectories = evaluate(problem, shooting, theta, covariance)
    notes = [*warnings, *problem.model.unit_disagreements]
    if not converged:
        notes.append("The optimiser stopped before it converged: raise max_evaluations or give "
                     "better guesses.")
    notes += bounds_met(problem.free, theta, at_bound)
    misfit = adequacy.verdict == "misfit"
    grown = max(growth(problem, theta)) if misfit and not stable else 0.0
    advice = "" if strategy == "nls" else "; NLS follows it in segments"
    if grown:
        notes.append(f"The plant is unstable: errors grow by e^{grown:.0f} along the recording, "
                     "which no simulation from one start follows. So neither the verdict nor the "
                     f"standard errors say anything about these estimates{advice}.")
    elif misfit:
        notes.append("The model, simulated at these estimates, does not explain the recording: "
                     "they are biased or make up for missing physics, and standard errors mean "
                     "little.")
    # what a bound holds may be what nothing else determines
    whole = Directions.of(jacobian, np.ones(len(theta), bool)) if at_bound.any() else shown
    if not grown:
        notes += whole.warnings(problem.free, uncertainty)
        notes += undetermined_warnings(problem.free, theta, cov, uncertainty)
    held = [e.held for e in problem.experiments for _ in e.samples]
    notes += filter(None, map(outlying_warning, fits, held))
    notes += filter(None, map(loose_warning, fits))
    for e in problem.experiments:
        if e.unused:
            notes.append(f"Recording '{e.name}': the model does not use {', '.join(e.unused)}.")
        if e.uncertain:
            notes.append(f"Recording '{e.name}': standard errors and the verdict leave out those "
                         f"of {', '.join(e.uncertain)}; of an acceleration that was derived of a "
                         "position, pikanid.bootstrap(..., positions=...) counts them.")
    return Estimate(
        model=problem.model, strategy=strategy, free=problem.free, theta=np.array(theta),
        covariance=covariance, fits=fits, trajectories=trajectories, cost=total_cost(fits),
        adequacy=adequacy, converged=converged, settings=settings, history=tuple(history),
        warnings=tuple(notes), seconds=time.perf_counter() - begun, seed=seed,
        version=__version__, approximator=approximator)


def bounds_met(free: Sequence[FreeParameter], theta: np.ndarray, at_bound: np.ndarray
               ) -> list[str]:
    """A sentence about each of the parameters (n,) that are at a bound."""
    return [errors.at_bound(f.label, with_unit(f"{value:.3g}", parse(f.unit)),
                            lower=value - f.bounds[0] <= f.bounds[1] - value)
            for f, value, stuck in zip(free, theta.tolist(), at_bound, strict=True) if stuck]


def evaluate(problem: Problem, shooting: Shooting, theta: np.ndarray,
             cov: np.ndarray | None = None) -> tuple[tuple[Fit, ...], tuple[Trajectory, ...]]:
    """Simulated outputs beside the measured ones, with what the covariance of θ does to them, and
    the states.
    """
    fits, trajectories = [], []
    responses = shooting.responses(theta)
    for r, (e, response) in enumerate(zip(problem.experiments, responses, strict=True)):
        trajectories.append(Trajectory(response.t, response.states))
        own = problem.columns(r)[1]
        spread = None if cov is None else propagated(response.sensitivity, cov[own[:, None], own])
        row = 0
        for s in e.samples:
            output = problem.model.outputs[s.output]
            fits.append(Fit(e.name, output.name, output.unit, s.t, s.y,
                            response.y[row:row + len(s.t)].copy(), s.sigma,
                            None if spread is None else spread[row:row + len(s.t)]))
            row += len(s.t)
    return tuple(fits), tuple(trajectories)
