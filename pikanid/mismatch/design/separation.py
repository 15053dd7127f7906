"""How far apart two models are in an experiment, after one was refitted to the other.

Everything is in units of the noise σ.  To first order in what the refit may change,

    D² = min_δ |r - J δ|²,   r = (y_true - y_rival)/σ,   low <= δ <= high;

`refitted` goes the whole way, where the first order is no longer true.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.optimize import least_squares, lsq_linear

from pikanid import errors
from pikanid.mismatch.design.response import Sigma, Watched, WhitenedResponse, joined
from pikanid.model import Model
from pikanid.recording import Recording
from pikanid.recording.channel import Array

FAR = 1e6  # numerical: [σ] of every sample where a rival cannot be simulated


def distance(true: Sequence[WhitenedResponse], rival: Sequence[WhitenedResponse]) -> float:
    """D [σ] of a rival from the truth over the same excitations; 0 without any."""
    if not rival:
        return 0.0
    r = np.concatenate([a.y for a in true]) - np.concatenate([b.y for b in rival])
    other = joined(rival)
    return float(np.linalg.norm(unexplained(r, other.jacobian, other.low, other.high)))


def refitted(true: Sequence[WhitenedResponse], model: Model, excitations: Sequence[Recording],
             sigma: Sigma = None, evaluations: int = 12) -> float:
    """D [σ] of a rival from the truth over excitations, after refitting its simulation.

    Parameters that belong to one recording keep their values.

    Raises:
        SimulationFailed: If the rival cannot be simulated at its own values.
    """
    return refitted_within(true, [Watched(model, e, sigma) for e in excitations], evaluations)


def refitted_within(true: Sequence[WhitenedResponse], watched: Sequence[Watched],
                    evaluations: int = 12) -> float:
    """As `refitted`, with the rival in every experiment; these may be used again."""
    target = np.concatenate([a.y for a in true])
    start = watched[0].problem.guess
    shared = ~watched[0].at(start).own
    kept: dict[bytes, tuple[Array, Array]] = {}

    def evaluated(v: Array) -> tuple[Array, Array]:
        if v.tobytes() not in kept:
            theta = start.copy()
            theta[shared] = v
            kept.clear()
            try:
                responses = [w.at(theta) for w in watched]
                kept[v.tobytes()] = (np.concatenate([s.y for s in responses]) - target,
                                     np.vstack([s.jacobian[:, shared] for s in responses]))
            except errors.SimulationFailed:
                kept[v.tobytes()] = (np.full(len(target), FAR), np.zeros((len(target), len(v))))
        return kept[v.tobytes()]

    low, high = watched[0].problem.lower[shared], watched[0].problem.upper[shared]
    # Strictly inside: the trust region cannot start on a bound.
    margin = 1e-9 * np.where(np.isfinite(high - low), high - low, 1.0)
    v = np.clip(start[shared], low + margin, high - margin)
    if not len(v):
        return float(np.linalg.norm(evaluated(v)[0]))
    found = least_squares(_first(evaluated), v, _second(evaluated), bounds=(low, high),
                          x_scale="jac", max_nfev=evaluations)
    return float(np.sqrt(2 * found.cost))


Evaluate = Callable[[Array], tuple[Array, Array]]


def _first(evaluate: Evaluate) -> Callable[[Array], Array]:
    return lambda v: evaluate(v)[0]


def _second(evaluate: Evaluate) -> Callable[[Array], Array]:
    return lambda v: evaluate(v)[1]


def unexplained(r: Array, jacobian: Array, low: Array, high: Array) -> Array:
    """The part of r (N,) that changes δ (p,) of parameters, low <= δ <= high, cannot explain.

    >>> line, free = np.linspace(0.0, 1.0, 3)[:, None], np.array([np.inf])
    >>> unexplained(2 * line[:, 0], line, -free, free).round(12).tolist()
    [0.0, 0.0, 0.0]
    >>> unexplained(2 * line[:, 0], line, -free, np.ones(1)).round(12).tolist()
    [0.0, 0.5, 1.0]
    """
    size = np.linalg.norm(jacobian, axis=0)
    used = (size > 0) & (high > low)
    if not used.any():
        return r
    unit = jacobian[:, used] / size[used]
    low, high = low[used] * size[used], high[used] * size[used]
    free = np.linalg.lstsq(unit, r, rcond=1e-12)[0]
    if np.all((free >= low) & (free <= high)):
        return r - unit @ free
    # Within bounds the triangular factor has all that matters, in p rows instead of N.
    q, upper = np.linalg.qr(unit)
    return r - unit @ lsq_linear(upper, q.T @ r, (low, high), method="bvls").x


def mean_precision(jacobian: Array) -> float:
    """det(JᵀJ)^(1/2p): the geometric mean of inverse standard errors along the principal axes."""
    singular = np.linalg.svd(jacobian, compute_uv=False)
    if len(singular) < jacobian.shape[1] or singular[-1] <= 1e-12 * singular[0]:
        return 0.0
    return float(np.exp(np.mean(np.log(singular))))
