"""Smoothing splines against their hat matrix, dense."""

from __future__ import annotations

import numpy as np
import pytest
from relaxing import collocated, guessed, slosh

from pikanid.optimise.gauss_newton import BandedSystem, Point
from pikanid.optimise.smoothing import smooth

DEGREES = 0.5


def problem(seeds: int, intervals: int) -> tuple[BandedSystem, Point]:
    data = [slosh(DEGREES, seed, stride=5) for seed in range(seeds)]
    functional = collocated(guessed(), data, intervals=intervals).smoothing()
    theta = functional.problem.guess
    return BandedSystem(functional), Point(
        tuple(functional.resting(r, theta) for r in range(seeds)), theta)


def dense(system: BandedSystem, point: Point, rho: float) -> tuple[float, float]:
    """Σ w² and tr(H) = tr((A_d + ρ A_q)⁻¹ A_d), of all recordings together."""
    square, effective = 0.0, 0.0
    for r, part in enumerate(system.functional.parts):
        (data,), nodes = part.data, part.physics
        (spline,) = part.approximators
        free = np.setdiff1d(np.arange(spline.n_coefficients), part.held)
        known = spline.basis(data.t)[:, part.held] @ point.coefficients[r][part.held]
        D = spline.basis(data.t).toarray()[:, free] * data.weight
        R = spline.basis(nodes.t, 2).toarray()[:, free] * nodes.weight
        assert data.target is not None
        y = (data.target[0] - known) * data.weight[:, 0]
        # the curvature of the held coefficients is penalised with the others
        bend = spline.basis(nodes.t, 2)[:, part.held] @ point.coefficients[r][part.held]
        A = D.T @ D + rho * R.T @ R
        c = np.linalg.solve(A, D.T @ y - rho * R.T @ (bend * nodes.weight[:, 0]))
        square += float(np.sum((y - D @ c) ** 2))
        effective += float(np.trace(np.linalg.solve(A, D.T @ D)))
    return square, effective


@pytest.mark.parametrize("seeds", [1, 2])
@pytest.mark.parametrize("rho", [0.01, 0.2, 20.0])
def test_noise_left_by_a_given_smoothness(seeds: int, rho: float) -> None:
    """√(RSS/(N - edf)): where 60 of 101 degrees are used up √(RSS/N) is a third less."""
    system, point = problem(seeds, 40)
    found = smooth(system, point, rho)
    assert found is not None and found.rho == rho
    square, effective = dense(system, point, rho)
    n = 101 * seeds
    assert found.sigma == pytest.approx(np.sqrt(square / (n - found.effective)), rel=1e-8)
    # the trace is estimated from 16 probes of ±1
    assert found.effective == pytest.approx(effective, abs=0.05 * n)


def test_cross_validation_is_at_its_least() -> None:
    """By half decades, with at most four fifths of the data used up."""
    system, point = problem(1, 40)
    found = smooth(system, point)
    assert found is not None

    def score(rho: float) -> float:
        square, effective = dense(system, point, rho)
        return 101 * square / (101 - effective) ** 2 if effective < 0.75 * 101 else np.inf

    beside = [score(found.rho * 10.0**k) for k in (-2, -1, -0.5, 0.5, 1, 2)]
    # the trace of each is estimated
    assert score(found.rho) < 1.1 * min(beside) and max(beside[3:]) > 2 * score(found.rho)
