"""The same edges fitted by the relaxation of Eq. (2): iPDA of the extended model.

The smoothness prior enters as data: outputs that show the second differences of the coefficients,
seen to be zero with standard deviation λ^-½.  Any strategy can fit a model that is extended so.
The posterior of a relaxed fit gives the information A = V⁻¹ - Λ, from which the smoothness is
chosen as in shooting; fit and choice take turns.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import sympy as sp

from pikanid.discrepancy.edges import EdgePlan, extend
from pikanid.discrepancy.fit import PenalisedFit
from pikanid.discrepancy.gauge import visit
from pikanid.discrepancy.level import Level, smoothness_of
from pikanid.discrepancy.settings import USUAL, DiscrepancySettings
from pikanid.discrepancy.smoothness import STIFF
from pikanid.estimate import Estimate
from pikanid.formula.expressions import symbol
from pikanid.model import Model, Output
from pikanid.noise.level import difference_noise
from pikanid.objective.shooting import Shooting
from pikanid.problem.problem import Problem
from pikanid.recording import Channel, Recording
from pikanid.strategies.ipda import IPDA, fit_relaxed


def relaxed_level(nominal: Estimate, problem: Problem, equation: str, plans: Sequence[EdgePlan],
                  intervals: int, settings: DiscrepancySettings = USUAL) -> Level:
    """Edges and parameters by iPDA, smoothness by evidence."""
    seen = visit(problem, equation, plans, nominal.theta, nominal.trajectories)
    placed = tuple(p.over(a, intervals) for p, a in zip(plans, seen.arguments.T, strict=True))
    model = extend(nominal.fitted_model, equation, placed)
    recordings = [_with_sigma(r, model) for r in problem.recordings]
    bound = Problem(model, recordings)
    smoothness = smoothness_of(bound, placed, seen.size, [1] * len(placed), settings)
    rho = np.full(len(placed), STIFF)
    theta = bound.guess
    history: list[dict[str, float]] = []
    for _ in range(settings.turns):
        pseudo = _with_prior(model.with_values(_shared(bound, theta)), recordings[0],
                             smoothness.precision(rho), bound)
        relaxed = fit_relaxed(Problem(pseudo[0], [pseudo[1], *recordings[1:]]), IPDA())
        order = [[f.label for f in relaxed.problem.free].index(f.label) for f in bound.free]
        theta = relaxed.theta[order]
        H = np.linalg.pinv(relaxed.naive_covariance[np.ix_(order, order)], hermitian=True)
        A = H - smoothness.precision(rho)
        before, rho = rho, smoothness.choose(A, H @ theta, rho)
        history.append({"lam": relaxed.lam, "change": float(np.max(np.abs(rho - before)))})
        if history[-1]["change"] < settings.settled_turns:
            break
    shooting = Shooting(bound)
    shooting.choose_steps(theta, "fine")
    fit = PenalisedFit(theta, rho, A, H @ theta, np.ones(len(theta), bool), 1.0, smoothness,
                       smoothness.evidence(A, H @ theta, rho), relaxed.converged, tuple(history))
    return Level(bound, shooting, placed, fit, seen).visiting(problem, equation)


def _with_sigma(recording: Recording, model: Model) -> Recording:
    """σ for every output: without it the prior could not be weighed against the data."""
    for o in model.outputs:
        channel = recording[o.name]
        if channel.sigma is None and o.sigma is None:
            seen = np.isfinite(channel.values)
            recording = recording.with_sigma(**{o.name: difference_noise(
                channel.values[seen], channel.time[seen])})
    return recording


def _shared(problem: Problem, theta: np.ndarray) -> dict[str, float]:
    return {f.name: float(v) for f, v in zip(problem.free, theta, strict=True)
            if f.recording in (None, 0)}


def _with_prior(model: Model, recording: Recording, precision: np.ndarray, problem: Problem
                ) -> tuple[Model, Recording]:
    """Outputs and channels that say: the root of the prior's precision times θ is zero."""
    values, vectors = np.linalg.eigh(precision)
    rows = (vectors * np.sqrt(np.maximum(values, 0.0))).T[values > 1e-12 * values[-1]]
    names = [symbol(f.name) for f in problem.free]
    ends = np.array([recording.start, recording.stop])
    outputs, channels = [], []
    for k, row in enumerate(rows):
        expression = sp.Add(*(float(v) * n for v, n in zip(row, names, strict=True) if v != 0.0))
        outputs.append(Output(f"prior_{k}", expression))
        # a channel that says the same twice counts as dead: zero is the mean of ±1, each half sure
        channels.append(Channel(f"prior_{k}", ends, np.array([1.0, -1.0]), "", float(np.sqrt(2.0))))
    return (model.replace(outputs=(*model.outputs, *outputs)),
            recording.with_channels(*channels))
