"""A residual as white noise, with what its model's parameters did to it.

A right model leaves e = ε - J δ: noise, and the error δ of its parameters times the sensitivities.
Divided by σ and freed of AR(1) correlation the noise is white.  What was fitted to the recording
itself is projected out, whichever method fitted it; what was fitted elsewhere has the covariance C
of its estimate.  So the whitened residual r has the covariance

    s² Σ,  Σ = I - Q Qᵀ + B Bᵀ = I + W D Wᵀ,  Q = orth(J_here),  B = (I - Q Qᵀ) J_elsewhere C^½/s.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pikanid.comparison.linear import even_grid
from pikanid.noise.level import NoiseModel
from pikanid.noise.projection import orthonormal, project

STEEPEST = 0.995  # numerical: correlation of neighbours, at most


@dataclass(frozen=True, eq=False)
class White:
    """A whitened residual of one output.

    Attributes:
        t: (N,) times [s].
        places: (N,) numbers of the samples on an even grid; 0, 1, 2, ... where there is none.
        interval: Between neighbours of that grid [s].
        r: (N,) whitened residual, free of what was fitted here.
        scale: s, its standard deviation as estimated.
        W, D: (N, w) and (w,) ±1: the covariance of r is s²(I + W D Wᵀ).
        rho: Correlation of neighbours in the noise; 0 for white.
        estimated: Whether ρ was estimated of this residual.
    """

    t: np.ndarray
    places: np.ndarray
    interval: float
    r: np.ndarray
    scale: float
    W: np.ndarray
    D: np.ndarray
    rho: float
    estimated: bool

    @property
    def freedom(self) -> float:
        """tr Σ: degrees of freedom of the residual's power."""
        return len(self.r) + float(np.sum(self.D * np.sum(self.W**2, axis=0)))

    def covariance(self, columns: np.ndarray) -> np.ndarray:
        """Xᵀ Σ X (k, k) for columns X (N, k)."""
        seen = self.W.T @ columns
        return np.asarray(columns.T @ columns + seen.T @ (self.D[:, None] * seen))


def whitened(t: np.ndarray, residual: np.ndarray, sigma: np.ndarray, here: np.ndarray,
             elsewhere: np.ndarray, covariance: np.ndarray, rho: float | None) -> White:
    """Whiten a residual.

    Args:
        t: (N,) times [s].
        residual: (N,) measured - simulated.
        sigma: (N,) noise; its level does not matter, its course does.
        here: (N, a) sensitivities by what was fitted to this recording.
        elsewhere: (N, f) by what was fitted to others, with its covariance (f, f).
        covariance: See there.
        rho: Correlation of neighbours in the noise; None to find out whether there is one.

    >>> e = np.random.default_rng(0).standard_normal(400)
    >>> none = np.empty((400, 0))
    >>> white = whitened(np.arange(400.0), e, np.ones(400), none, none, np.empty((0, 0)), None)
    >>> white.rho, round(white.scale, 1)
    (0.0, 1.0)
    """
    grid = even_grid(t)
    places, interval = grid if grid is not None else (
        np.arange(len(t)), float(np.mean(np.diff(t))))
    rows = residual / sigma
    J = here / sigma[:, None]
    K = elsewhere / sigma[:, None]
    estimated = False
    if rho is None:
        rho = neighbours(places, project(J, rows))
        estimated = rho != 0.0
    noise = NoiseModel(1.0, rho, 0.0, interval, "given")
    at = np.array(places * interval, dtype=np.float64)
    rows, J, K = noise.whiten(rows, at), noise.whiten(J, at), noise.whiten(K, at)
    Q: np.ndarray = orthonormal(J) if J.shape[1] else J
    r = rows - Q @ (Q.T @ rows)
    scale = float(np.sqrt(r @ r / max(len(r) - Q.shape[1], 1)))
    values, vectors = np.linalg.eigh(covariance)
    B = K @ (vectors * np.sqrt(np.maximum(values, 0.0))) / max(scale, 1e-300)
    B = B - Q @ (Q.T @ B)
    W = np.concatenate([Q, B], axis=1)
    D = np.concatenate([-np.ones(Q.shape[1]), np.ones(B.shape[1])])
    return White(t, places, interval, r, scale, W, D, rho, estimated)


def neighbours(places: np.ndarray, rows: np.ndarray) -> float:
    """Correlation of neighbouring rows (N,), or 0 where BIC takes them for white.

    >>> e = np.random.default_rng(1).standard_normal(2000)
    >>> for k in range(1, 2000): e[k] += 0.6 * e[k - 1]
    >>> round(neighbours(np.arange(2000), e), 1)
    0.6
    """
    beside = np.flatnonzero(np.diff(places) == 1)
    if len(beside) < 3:
        return 0.0
    a, b = rows[beside], rows[beside + 1]
    power = float(a @ a + b @ b) / 2
    rho = float(np.clip(a @ b / power, -STEEPEST, STEEPEST)) if power > 0 else 0.0
    n = len(beside)
    return rho if n * np.log(1 - rho**2) + np.log(n) < 0 else 0.0
