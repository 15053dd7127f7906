"""Distances between models in units of the noise, after refitting.

With the noise whitened, two models are as far apart as D = min_v |y_truth - y(v)|, v being all
that the other model may adjust.  D² is the non-centrality of the likelihood-ratio test between
them: D = 5 is a 5σ effect.  Everything here is free of noise; sensitivities are finite differences
of the reference simulator, whose error is far below the steps.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pikanid import errors
from pikanid.validation.concealed.arrays import Array

Response = Callable[[Array], Array]
MOST_STEPS = 12  # limit: of Gauss-Newton, in one refit


@dataclass(frozen=True, eq=False)
class Refit:
    """A model adjusted to a target.

    Attributes:
        values: (p,) adjusted.
        residual: (N,) whitened target less model.
        jacobian: (N, p) derivative of the whitened response, where the last step began.
    """

    values: Array
    residual: Array
    jacobian: Array

    @property
    def distance(self) -> float:
        """D [σ]."""
        return float(np.sqrt(np.sum(self.residual**2)))


def refit(response: Response, target: Array, start: Array, low: Array, high: Array,
          scale: Array, steps: int = MOST_STEPS) -> Refit:
    """Levenberg and Marquardt's iteration within bounds; infinitely far where it begins with what
    cannot be simulated.

    Args:
        response: Values (p,) -> whitened response (N,).
        target: (N,) whitened.
        start: (p,) within the bounds.
        low: (p,).
        high: (p,).
        scale: (p,) sizes of meaningful changes; differences use a thousandth of them.
        steps: At most so many.

    >>> line = np.linspace(0.0, 1.0, 5)
    >>> free, one = np.array([-9.0]), np.ones(1)
    >>> round(float(refit(lambda v: v * line, 2 * line, one, free, -free, one).values[0]), 3)
    2.0
    """
    v = np.clip(start, low, high)
    r = _residual(response, target, v)
    cost, damping = float(np.sum(r**2)), 1e-6
    jacobian = np.zeros((len(r), len(v)))
    for _ in range(steps if np.isfinite(cost) else 0):
        jacobian = sensitivities(response, v, target - r, high, scale)
        # einsum sums in a fixed order; a BLAS might not, and then bits depend on its threads.
        normal = np.einsum("ni,nj->ij", jacobian, jacobian)
        gradient = np.einsum("ni,n->i", jacobian, r)
        diagonal = np.maximum(np.diag(normal), 1e-30)
        for _ in range(6):
            move = _bounded_move(normal + damping * np.diag(diagonal), gradient, v, low, high)
            trial = np.clip(v + move, low, high)
            r_trial = _residual(response, target, trial)
            cost_trial = float(np.sum(r_trial**2))
            if cost_trial < cost:
                break
            damping = max(damping * 20.0, 1e-4)
        else:
            break
        gain = cost - cost_trial
        v, r, cost, damping = trial, r_trial, cost_trial, max(damping / 30.0, 1e-9)
        if gain < 3e-4 * cost or cost < 1e-4:
            break
    return Refit(v, r, jacobian)


def at(response: Response, target: Array, v: Array, high: Array, scale: Array) -> Refit:
    """A model as it is at v (p,), not adjusted; arguments as those of `refit`."""
    now = response(v)
    return Refit(v, target - now, sensitivities(response, v, now, high, scale))


def sensitivities(response: Response, v: Array, at_v: Array, high: Array, scale: Array) -> Array:
    """(N, p) one-sided differences of the response, inwards where v is at its upper bound.

    A rig that diverges a thousandth of a step away counts as insensitive there.
    """
    columns = []
    for i in range(len(v)):
        step = 1e-3 * scale[i]
        if v[i] + step > high[i]:
            step = -step
        moved = v.copy()
        moved[i] += step
        try:
            columns.append((response(moved) - at_v) / step)
        except errors.SimulationFailed:
            columns.append(np.zeros(len(at_v)))
    return np.stack(columns, axis=1)


def unexplained(jacobian: Array, r: Array) -> Array:
    """The part of r (N,) that no change of the parameters can explain, to first order."""
    size = np.sqrt(np.sum(jacobian**2, axis=0))
    unit = jacobian / np.where(size > 0, size, 1.0)
    normal = np.einsum("ni,nj->ij", unit, unit) + 1e-10 * np.eye(unit.shape[1])
    weights = np.linalg.solve(normal, np.einsum("ni,n->i", unit, r))
    return r - np.einsum("ni,i->n", unit, weights)


def _bounded_move(normal: Array, gradient: Array, v: Array, low: Array, high: Array) -> Array:
    """The Newton step of the parameters that are not held by a bound."""
    held = ((v <= low) & (gradient < 0)) | ((v >= high) & (gradient > 0))
    move = np.zeros(len(v))
    free = ~held
    if free.any():
        move[free] = np.linalg.solve(normal[np.ix_(free, free)], gradient[free])
    return move


def _residual(response: Response, target: Array, v: Array) -> Array:
    try:
        return target - response(v)
    except errors.SimulationFailed:
        return np.full(len(target), np.inf)
