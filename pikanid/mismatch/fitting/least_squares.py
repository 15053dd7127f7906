"""Levenberg-Marquardt within bounds, that stops where statistics do: at a hundredth of χ²."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

PATIENCE = 6  # iterations that a fit gets to come near the best one
SLOW = 0.7  # share of |r|² left by one iteration from which on a fit far away is given up
Evaluate = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray] | None]


@dataclass(frozen=True)
class Minimum:
    """θ (n,), residual r (rows,) and Jacobian (rows, n) there; |r|² is χ²."""

    theta: np.ndarray
    r: np.ndarray
    J: np.ndarray
    converged: bool

    @property
    def chi2(self) -> float:
        """Sum of squares."""
        return float(self.r @ self.r)


def minimise(evaluate: Evaluate, start: np.ndarray, lower: np.ndarray, upper: np.ndarray,
             limit: int = 30, tolerance: float = 0.02,
             beyond: Callable[[float], bool] = lambda chi2: False) -> Minimum | None:
    """Minimise |r(θ)|² within bounds; None where the start cannot be evaluated.

    A parameter at a bound that the gradient pushes outwards stays there for the step.  What is
    still `beyond` reach after `PATIENCE` iterations and falls slowly is given up.

    >>> line = lambda q: (np.array([q[0] - 3.0]), np.ones((1, 1)))
    >>> found = minimise(line, np.array([1.0]), np.array([0.0]), np.array([2.0]))
    >>> float(found.theta[0])
    2.0
    """
    theta = np.clip(start, lower, upper)
    at = evaluate(theta)
    if at is None:
        return None
    r, J = at
    best, damping = float(r @ r), 1e-3
    for count in range(limit):
        if len(theta) == 0:
            break
        last = best
        g = J.T @ r
        moving = ~held(theta, g, lower, upper)
        A = J[:, moving]
        norms = np.sqrt(np.maximum(np.einsum("ij,ij->j", A, A), 1e-300))
        B, b = (A / norms).T @ (A / norms), -g[moving] / norms
        accepted = False
        for _ in range(8):
            low, high = (lower - theta)[moving] * norms, (upper - theta)[moving] * norms
            step = _boxed_step(B + damping * np.eye(len(b)), b, low, high)
            new = theta.copy()
            # at a wall exactly, not up to rounding
            new[moving] = np.where(step <= low, lower[moving], np.where(
                step >= high, upper[moving], theta[moving] + step / norms))
            expected = float(best - np.sum((r + J @ (new - theta)) ** 2))
            # far from an explanation nobody needs the last digits
            if expected < max(tolerance, 2e-5 * best, 0.1 * best / len(r)):
                return Minimum(theta, r, J, True)
            at = evaluate(new)
            if at is not None and float(at[0] @ at[0]) < best:
                gain = best - float(at[0] @ at[0])
                theta, (r, J), best, accepted = new, at, best - gain, True
                damping = max(damping * (0.1 if gain > 0.5 * expected else 1.0), 1e-9)
                break
            damping = max(damping * 8, 1e-4)
        hopeless = count + 1 >= PATIENCE and best > SLOW * last
        if not accepted or (hopeless and beyond(best)):
            return Minimum(theta, r, J, False)
    return Minimum(theta, r, J, len(theta) == 0)


def held(theta: np.ndarray, slope: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """(n,) whether a bound holds a parameter that χ² with this slope would push further."""
    return np.asarray(((theta <= lower) & (slope > 0)) | ((theta >= upper) & (slope < 0)))


def _boxed_step(A: np.ndarray, b: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """The step x (n,) that solves A x = b, what would leave its box held at the wall meanwhile."""
    x = np.zeros(len(b))
    free = np.ones(len(b), bool)
    for _ in range(len(b) + 1):
        if not free.any():
            break
        rest = b[free] - A[np.ix_(free, ~free)] @ x[~free]
        x[free] = np.linalg.lstsq(A[np.ix_(free, free)], rest, rcond=None)[0]
        out = free & ((x < low) | (x > high))
        if not out.any():
            break
        x[out] = np.clip(x[out], low[out], high[out])
        free &= ~out
    return x


def repeated(r: np.ndarray) -> float:
    """How many neighbouring rows of a residual (N,) say the same: Σ ρ_k², at least one."""
    n = len(r)
    spectrum = np.abs(np.fft.rfft(r, 2 * n)) ** 2
    rho = np.fft.irfft(spectrum)[1:max(n // 4, 2)] / max(float(r @ r), 1e-300)
    # noise alone has ρ² = 1/N
    return max(1.0, 1 + 2 * float(np.sum(rho**2 - 1 / n)))
