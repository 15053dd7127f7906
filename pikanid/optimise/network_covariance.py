"""Sandwich covariance and effective parameters of a deep network's fit; see `covariance`.

JᵀJ of a redundant network is singular, but the directions that it leaves open change neither the
curve nor θ: a trace of damping closes them, far below what any residual says.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError

from pikanid.approximators import Array
from pikanid.optimise.bordered import Bordered, BorderedSystem, Evaluation, Solved
from pikanid.optimise.box import met
from pikanid.optimise.covariance import invert
from pikanid.optimise.local_rows import Family, Layout

PROBES = 32  # numerical: for the trace of the effective parameters
TRACE = 1e-3  # numerical: of damping: χ² charged for a move by one unit
Noise = Callable[[float], Sequence[Array | float]]


def network_covariance(system: BorderedSystem, at: Evaluation, noise: Noise
                       ) -> tuple[Array, Array, float]:
    """Sandwich and naive covariance of θ, (b, b) each, and tr(J_d M⁻¹ J_dᵀ).

    `noise` gives the standard deviation of the rows of each data family, recording after
    recording, for a number of effective parameters.  Parameters at a bound count as known: their
    rows and columns are zero.  The trace is estimated from 32 fixed random probes.

    Raises:
        LinAlgError: If Eq. (2) is not finite at the point.
    """
    problem, theta = system.functional.problem, at.point.theta
    stuck = met(theta, problem.lower, problem.upper)
    schur = np.zeros((theta.size, theta.size))
    responses: list[Array] = []
    effective = 0.0
    for r, (normal, columns) in enumerate(zip(system.normal(at), system.columns, strict=True)):
        solved, damping = _solved(normal)
        schur[np.ix_(columns, columns)] += solved.schur
        data = system.jacobian(r, at)[:len(at.data_costs[r])]
        effective += _trace(normal, data, damping)
        for family in data:
            response = np.zeros((family.residual.shape[0], theta.size))
            response[:, columns] = _response(normal.layout, family, solved)
            responses.append(response)
    bread = invert(0.5 * (schur + schur.T), ~stuck)
    effective += sum(float(np.sum((response @ bread) * response)) for response in responses)
    meat = np.zeros_like(bread)
    variance, count = 0.0, 0
    for response, deviation in zip(responses, noise(effective), strict=True):
        scaled = response * np.reshape(deviation, (-1, 1))
        meat += scaled.T @ scaled
        variance += float(np.sum(np.broadcast_to(deviation, response.shape[:1]) ** 2))
        count += response.shape[0]
    sandwich, naive = bread @ meat @ bread, bread * (variance / count)
    unseen = np.flatnonzero(~stuck & (np.diag(schur) <= 0.0))
    sandwich[unseen, unseen] = naive[unseen, unseen] = np.inf
    return sandwich, naive, effective


def _solved(normal: Bordered) -> tuple[Solved, float]:
    """Eliminated with the least damping that works."""
    damping = TRACE
    while True:
        try:
            return normal.solve(damping), damping
        except LinAlgError:
            damping *= 10.0
            if not damping < 1e15:
                raise


def _places(layout: Layout, family: Family) -> NDArray[np.int64]:
    """Which near coefficients, spline by spline, a row touches (M, w)."""
    return (family.first * layout.stride)[:, None] + np.arange(family.near.shape[2])


def _response(layout: Layout, family: Family, solved: Solved) -> Array:
    """Derivative (N, b) of weighted data by θ, the coefficients following θ."""
    q = layout.far_at.size
    near = solved.inner[layout.near_at][_places(layout, family)]
    follow = np.einsum("mw,mwb->mb", family.near[:, 0], near)
    return family.far[:, 0, q:] - follow - family.far[:, 0, :q] @ solved.inner[layout.far_at]


def _trace(normal: Bordered, data: Sequence[Family], damping: float) -> float:
    """Part of the trace that the coefficients have at fixed θ."""
    layout, units = normal.layout, normal.units
    generator = np.random.default_rng(0)
    pulled = np.zeros((units.size, PROBES))
    for family in data:
        probe = generator.choice([-1.0, 1.0], size=(family.residual.shape[0], PROBES))
        np.add.at(pulled, layout.near_at[_places(layout, family)],
                  family.near[:, 0, :, None] * probe[:, None])
        pulled[layout.far_at] += family.far[:, 0, :layout.far_at.size].T @ probe
    scaled = pulled * units[:, None]
    solved = normal.inverse(damping, scaled[layout.near_at], scaled[layout.far_at])
    return float(np.sum(solved * pulled)) / PROBES
