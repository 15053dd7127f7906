"""A hypothesis' fit as an `Estimate`, from the search's own run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from pikanid.estimate import Estimate
from pikanid.estimate.data import Fit, Trajectory
from pikanid.estimate.estimate import total_cost
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.objective.adequacy import judge
from pikanid.optimise.propagation import propagated
from pikanid.storage.version import __version__


def as_estimate(h: Hypothesis, like: Estimate) -> Estimate:
    """The estimate of the extended model, with the hypothesis' covariance: along what the recording
    does not tell, standard errors end where parameters leave the order of magnitude of the guess.
    Errors below what a number can hold are of derivatives that ran away in a stiff state, and are
    not known.
    """
    whitened, covariance = h.whitened, h.covariance.copy()
    absurd = np.diag(covariance) < np.square(np.finfo(float).eps * h.minimum.theta)
    covariance[absurd] = covariance[:, absurd] = np.nan
    problem = whitened.problem
    fits, trajectories = [], []
    for r, response in enumerate(whitened.responses(h.minimum.theta, states=True)):
        trajectories.append(Trajectory(response.t, response.states))
        experiment, row = problem.experiments[r], 0
        own = problem.columns(r)[1]
        spread = propagated(response.sensitivity, covariance[np.ix_(own, own)])
        for s in experiment.samples:
            output = problem.model.outputs[s.output]
            sigma = whitened.records.levels[r][output.name].spreads(s.sigma, len(s.t))
            fits.append(Fit(experiment.name, output.name, output.unit, s.t, s.y,
                            response.y[row:row + len(s.t)].copy(), sigma,
                            spread[row:row + len(s.t)]))
            row += len(s.t)
    adequacy = judge([f.residual for f in fits], [f.sigma for f in fits],
                     [f.measured for f in fits], len(h.minimum.theta),
                     whitened.settings.adequacy)
    return Estimate(
        model=problem.model, strategy="nls", free=problem.free, theta=h.minimum.theta,
        covariance=covariance, fits=tuple(fits), trajectories=tuple(trajectories),
        cost=total_cost(fits), adequacy=adequacy, converged=h.minimum.converged,
        settings={**like.settings, "effects": sorted(h.key)}, version=__version__)


def widened(estimate: Estimate, overdispersion: float,
            spread: Mapping[str, float] = MappingProxyType({})) -> Estimate:
    """The same with standard errors that count what is left beside noise: where χ² is divided by
    so much, covariances are multiplied by it (P. McCullagh and J. A. Nelder, Generalized Linear
    Models, 1989, sec. 4.5), and the square of each shared parameter's spread is added.
    """
    wider = overdispersion**0.5
    fits = tuple(f if f.spread is None else replace(f, spread=wider * f.spread)
                 for f in estimate.fits)
    apart = [spread.get(f.name, 0.0) if f.recording is None else 0.0 for f in estimate.free]
    return replace(estimate, covariance=overdispersion * estimate.covariance + np.diag(
        np.square(apart)), fits=fits)
