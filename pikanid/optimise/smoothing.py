"""The data-only fit: splines smoothed by generalised cross-validation, the first step of PDA.

min ‖(y - h(x̂))/σ‖² + ρ ∫ |x̂⁽ᵠ⁾|² dt with ρ minimising N·RSS/(N - edf)² (Craven and Wahba, Numer.
Math. 31, 1979); edf = tr((A_d + ρ A_q)⁻¹ A_d), estimated from a few fixed random probes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, cho_solve_banded, cholesky_banded

from pikanid.approximators import Array
from pikanid.optimise.gauss_newton import BandedSystem, Linearisation, Point, gauss_newton

# (GCV score, residual sum of squares, effective parameters)
Score = tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Smoothed:
    """Smoothed coefficients, the residual's standard deviation in weighted units, edf and ρ."""

    point: Point
    sigma: float
    effective: float
    rho: float


def smooth(system: BandedSystem, point: Point, rho: float | None = None) -> Smoothed | None:
    """Smooth the data of all recordings with one ρ; None where they do not determine the splines.

    Without a given ρ, cross-validation chooses it.

    `system` is built on `functional.smoothing()`; θ stays.
    """
    count = system.functional.n_data
    data, both = system.linearise(point, 0.0), system.linearise(point, 1.0)
    mass = sum(float(b.band[0].sum()) for b in data.blocks)
    rough = sum(float(b.band[0].sum()) for b in both.blocks) - mass
    if mass <= 0.0 or rough <= 0.0:
        return None
    probes = _probes([b.slope.size for b in data.blocks])
    ridge = mass / rough
    if rho is None:
        scores = {q: _criterion(data, both, q, probes, count)
                  for q in ridge * 10.0 ** np.arange(-14.0, 5.0)}
        best = _best(scores)
        if best is None:
            return None
        scores |= {q: _criterion(data, both, q, probes, count)
                   for q in (best / 10**0.5, best * 10**0.5)}
        rho = _best(scores)
        assert rho is not None
        score = scores[rho]
    else:
        # Least squares proper (ρ = 0) keeps a trace of roughness, for knots without data.
        rho = max(rho, 1e-14 * ridge)
        score = _criterion(data, both, rho, probes, count, most=1.0)
    if score is None:
        return None
    residual, effective = score[1:]
    try:
        found = gauss_newton(system, point, rho, point.theta, point.theta, iterations=10)
    except LinAlgError:
        return None
    sigma = float(np.sqrt(max(residual, 0.0) / max(count - effective, 1.0)))
    return Smoothed(found.at.point, sigma, effective, rho)


def _probes(sizes: list[int]) -> list[Array]:
    generator = np.random.default_rng(0)
    number = int(np.clip(4000 // max(1, sum(sizes)), 1, 16))
    return [generator.choice([-1.0, 1.0], size=(size, number)) for size in sizes]


def _best(scores: dict[float, Score | None]) -> float | None:
    found = {rho: score[0] for rho, score in scores.items() if score is not None}
    return min(found, key=lambda rho: found[rho]) if found else None


def _criterion(data: Linearisation, both: Linearisation, rho: float, probes: list[Array],
               count: int, most: float = 0.8) -> Score | None:
    """The score at ρ; None where the system is singular or more than `most` of the data is used."""
    effective, residual = 0.0, data.data_cost
    for only, all_, probe in zip(data.blocks, both.blocks, probes, strict=True):
        band = only.band + rho * (all_.band - only.band)
        slope = only.slope + rho * (all_.slope - only.slope)
        try:
            factor = cholesky_banded(band, lower=True, check_finite=False)
        except LinAlgError:
            return None
        moved = multiply(only.band, probe)
        solved = cho_solve_banded((factor, True), np.column_stack([moved, -slope]),
                                  check_finite=False)
        effective += float(np.mean(np.sum(probe * solved[:, :-1], axis=0)))
        step = solved[:, -1]
        residual += 2.0 * float(only.slope @ step)
        residual += float(step @ multiply(only.band, step[:, None])[:, 0])
    if effective >= most * count and most < 1.0:
        return None
    left = max(count - effective, 1e-3)
    return count * residual / left**2, residual, effective


def multiply(band: Array, columns: Array) -> Array:
    """Product of a symmetric matrix in lower band form (kd + 1, n) with columns (n, q).

    >>> multiply(np.array([[2.0, 2.0], [1.0, 0.0]]), np.eye(2))
    array([[2., 1.],
           [1., 2.]])
    """
    out = band[0][:, None] * columns
    for d in range(1, min(band.shape[0], columns.shape[0])):
        off = band[d, :-d][:, None]
        out[d:] += off * columns[:-d]
        out[:-d] += off * columns[d:]
    return out
