"""Gauss-Newton for a PINN: the damped steps of `optimise.dense`, λ climbing as the network allows.

λ is raised whenever the physics residual costs less than a tenth of what the noise does (while the
data are not yet met, of the geometric mean of both), and while the curve still follows the noise
(less than the noise is left in the data: Morozov's discrepancy principle).  So λ ends where this
network can just meet the physics, and no higher: beyond that it would trade the data for it and
lock (1/l -> 0 minimises the physics alone).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from pikanid.approximators import Array
from pikanid.optimise.covariance import invert
from pikanid.optimise.dense import levenberg_marquardt
from pikanid.optimise.gradient_functional import TorchFunctional
from pikanid.optimise.schedules import moved
from pikanid.strategies.settings import CLIMB, ClimbSettings

Mask = NDArray[np.bool_]
Progress = Callable[[dict[str, float]], None]
CHUNK = 10  # numerical: iterations at one λ
WARMUP = 20  # numerical: in which only the curve moves
FASTEST = 10.0  # numerical: factor of λ between chunks
MOST = 1e12  # limit: of λ: beyond it rounding has the physics' digits
RELATIVE = 1e-5  # numerical: move that counts as none, where no noise says what is near
RIDGE = 1e-11  # numerical: of the largest eigenvalue: what nothing determines


@dataclass(frozen=True, eq=False)
class Climb:
    """Where the climb ended, at which λ, and what θ moved by last, in standard errors."""

    z: Array
    lam: float
    iterations: int
    converged: bool
    move: float
    history: tuple[dict[str, float], ...]


def climb(loss: TorchFunctional, start: Array, *, noise: float, known: bool, lam: float | None,
          iterations: int, progress: Progress | None, settings: ClimbSettings = CLIMB) -> Climb:
    """Minimise Eq. (2) at rising λ, or at the given one, from `start` (n,).

    `noise` is the standard deviation of the data rows; where it is not `known`, it is what samples
    that lie far apart make of the signal, and a closer fit corrects it downwards.
    """
    lower, upper = loss.bounds()
    size = loss.functional.problem.guess.size
    held_lower, held_upper = lower.copy(), upper.copy()
    z = np.clip(start, lower, upper)
    held_lower[len(z) - size:] = held_upper[len(z) - size:] = z[len(z) - size:]
    weight, data_rows = (1.0 if lam is None else lam), loss.data_rows()
    expected = noise**2 * loss.functional.n_data
    used, calm, damping, move, history = 0, 0, 1e-3, np.inf, []
    std = np.full(size, np.inf)
    while used < iterations:
        first = used == 0
        found = levenberg_marquardt(
            partial(loss.residual, lam=weight), partial(loss.linearised, lam=weight), z,
            lower=held_lower if first else lower, upper=held_upper if first else upper,
            iterations=min(WARMUP if first else CHUNK, iterations - used), damping=damping)
        used += found.iterations
        damping = float(np.clip(10.0 * found.damping, 1e-12, 1e-2))
        square = found.residual**2
        data, physics = float(square[data_rows].sum()), float(square[~data_rows].sum())
        before, z = z, found.z
        entry = {"step": float(used), "lam": weight, "data": data, "physics": physics}
        history.append(entry)
        if progress is not None:
            progress(entry)
        cov, _ = covariance(loss, found.jacobian, data_rows, _flat_noise(data_rows, data, expected))
        here, there = loss.unpack(before).theta, loss.unpack(z).theta
        std, old = np.sqrt(np.abs(np.nan_to_num(np.diag(cov)))), std
        move = moved(here, there, std, RELATIVE)
        if not known and not first:
            expected = min(expected, data)
        allowed = settings.share * np.sqrt(max(data, expected) * expected)
        growth = 1.0 if lam is not None else float(np.clip(
            allowed / max(physics, 1e-300), 1.0, FASTEST))
        if lam is None and known and data < settings.overfit * expected:
            growth = max(growth, 3.0)
        # While standard errors still fall, a larger λ has more to tell.
        steady = move <= settings.settled and bool(np.all(std > settings.falling * old))
        calm = calm + 1 if steady and not first else 0
        if calm == 2 or (found.converged and growth == 1.0 and not first):
            return Climb(z, weight, used, True, move, tuple(history))
        if used < iterations:
            weight = min(weight * growth, MOST)
    return Climb(z, weight, used, move <= settings.nearly, move, tuple(history))


def _flat_noise(data_rows: Mask, data: float, expected: float) -> Array:
    """The same deviation for all data rows, from the cost."""
    count = int(np.count_nonzero(data_rows))
    return np.full(count, np.sqrt(max(min(data, 4.0 * expected), 1e-300) / count))


def covariance(loss: TorchFunctional, jacobian: Array, data_rows: Mask, noise: Array
               ) -> tuple[Array, float]:
    """Sandwich covariance (b, b) of θ and the number of parameters that the curve uses up.

    With J = [J_c J_θ], H the hat matrix of J_c and B = (1 - H) J_θ, noise ε of the data rows moves
    θ by -(J_θᵀB)⁻¹ Bᵀε: only data rows have noise (White, Econometrica 50, 1982).  `noise` is their
    standard deviation.
    """
    size = loss.functional.problem.guess.size
    by_c, by_theta = jacobian[:, :-size], jacobian[:, -size:]
    if by_c.shape[0] <= by_c.shape[1]:
        values, vectors = eigh(by_c @ by_c.T)
        values = np.maximum(values, 0.0)
        share = values / (values + RIDGE * values[-1])
        rest = by_theta - vectors @ (share[:, None] * (vectors.T @ by_theta))
        effective = float(np.sum(vectors[data_rows] ** 2 * share))
    else:
        values, vectors = eigh(by_c.T @ by_c)
        values = np.maximum(values, 0.0)
        image = by_c @ vectors
        share = 1.0 / (values + RIDGE * values[-1])
        rest = by_theta - image @ (share[:, None] * (image.T @ by_theta))
        effective = float(np.sum(image[data_rows] ** 2 * share))
    bread = invert(by_theta.T @ rest, np.ones(size, bool))
    pull = rest[data_rows] * noise[:, None]
    found = bread @ (pull.T @ pull) @ bread
    return found * np.outer(loss.unit, loss.unit), effective
