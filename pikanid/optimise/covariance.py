"""How far a relaxed estimate can be trusted: sandwich covariance and effective parameters.

The physics residual is not data: it has no noise.  With M = JᵀJ of Eq. (2) and J_d its data rows of
covariance Σ, Cov = Zᵀ J_dᵀ Σ J_d Z, Z the θ columns of M⁻¹ (White, Econometrica 50, 1982).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError

from pikanid.approximators import Array
from pikanid.objective.functional import Rows, Sites
from pikanid.optimise.banded import slopes
from pikanid.optimise.cholesky import eigen
from pikanid.optimise.gauss_newton import BandedSystem, Linearisation, Step


def theta_covariance(system: BandedSystem, at: Linearisation, step: Step,
                     noise: Sequence[Array | float],
                     response: Response | None = None) -> tuple[Array, Array]:
    """Sandwich and naive covariance of θ, (b, b) each.

    `noise` is the standard deviation of the rows of each data family, recording after recording.
    Parameters at a bound count as known: their rows and columns are zero.  One without influence
    has an infinite variance.  The naive covariance, the θ block of M⁻¹ times the mean noise
    variance, counts physics as data.  A `response` at the point is not worked out again.
    """
    inside = inside_bounds(system, at)
    bread = invert(step.schur, inside)
    meat = np.zeros_like(bread)
    variance, count = 0.0, 0
    jacobians = data_response(system, at, step) if response is None else response.data
    for jacobian, deviation in zip(jacobians, noise, strict=True):
        rows = jacobian.shape[0]
        if isinstance(deviation, float):
            meat += deviation**2 * (jacobian.T @ jacobian)
            variance += rows * deviation**2
        else:
            scaled = jacobian * deviation[:, None]
            meat += scaled.T @ scaled
            variance += float(deviation @ deviation)
        count += rows
    sandwich, naive = bread @ meat @ bread, bread * (variance / count)
    unseen, = (inside & (step.schur.diagonal() <= 0.0)).nonzero()
    sandwich[unseen, unseen] = naive[unseen, unseen] = np.inf
    return sandwich, naive


def error_bound(system: BandedSystem, at: Linearisation, step: Step,
                noise: Sequence[Array | float]) -> Array:
    """No less than the sandwich's standard errors of θ (b,), without a look at the data rows.

    M holds J_dᵀJ_d and more, so that Zᵀ J_dᵀ Σ J_d Z is at most the largest variance in Σ times the
    θ block of M⁻¹.
    """
    from pikanid.optimise.small_matrices import inverse_diagonal

    bread = np.empty(at.point.theta.size)
    inverse_diagonal(step.schur, inside_bounds(system, at), bread)
    return max(own if isinstance(own, float) else float(own.max(initial=0.0))
               for own in noise) * np.sqrt(bread)


def inside_bounds(system: BandedSystem, at: Linearisation) -> NDArray[np.bool_]:
    """Which parameters (b,) are not at a bound."""
    from pikanid.optimise.small_matrices import strictly_inside

    inside = np.empty(at.point.theta.size, dtype=bool)
    strictly_inside(at.point.theta, system.lower, system.upper, inside)
    return inside


def invert(matrix: Array, inside: NDArray[np.bool_]) -> Array:
    """Inverse over the parameters `inside` that have any influence, zero elsewhere.

    Directions without any are left out.
    """
    from pikanid.optimise.small_matrices import regular_inverse

    out = np.zeros_like(matrix)
    if regular_inverse(matrix, inside, out):
        return out
    diagonal = matrix.diagonal()
    which, = (inside & (diagonal > 0.0)).nonzero()
    if which.size == 0:
        return out
    square, scale = (which[:, None], which), np.sqrt(diagonal[which])
    values, vectors = eigen(matrix[square] / (scale[:, None] * scale))
    seen = np.abs(values) > 1e-13 * np.abs(values).max(initial=0.0)
    vectors = vectors[:, seen] / scale[:, None]
    out[square] = (vectors / values[seen]) @ vectors.T
    return out


def data_response(system: BandedSystem, at: Linearisation, step: Step) -> list[Array]:
    """Derivative (N, b) of every weighted data family by θ, the coefficients following θ."""
    responses = []
    for r, part in enumerate(system.functional.parts):
        follow = following(system, at, step, r)
        responses += [
            _spread(family_response(sites, row, follow)[0], system.columns[r], at.point.theta.size)
            for sites, row in zip(part.data, at.rows[r], strict=False)]
    return responses


class Response(NamedTuple):
    """How the rows of Eq. (2) change with θ at a point, the coefficients following θ."""

    reduced: Array  # RᵀR (b, b), R the derivative of all rows
    data: list[Array]  # derivative (N, b) of every weighted data family


def respond(system: BandedSystem, at: Linearisation, step: Step) -> Response:
    """All rows and their derivatives by θ, each worked out once.

    `reduced` is what `step.schur` is, which is left over from large numbers where λ is large: at
    1e8 that may cost the standard errors their fourth digit.  Here the rows cancel before they are
    squared, and an error in how the coefficients follow counts only by its square (it is a
    minimum).
    """
    functional = system.functional
    found = Response(np.zeros_like(step.schur), [])
    for r, (part, columns) in enumerate(zip(functional.parts, system.columns, strict=True)):
        follow, square = following(system, at, step, r), (columns[:, None], columns)
        for k, (sites, row) in enumerate(zip(system.families[r], at.rows[r], strict=True)):
            responses = family_response(sites, row, follow)
            for response in responses:
                found.reduced[square] += response.T @ response
            if k < len(part.data):
                found.data.append(_spread(responses[0], columns, at.point.theta.size))
    return found


def _spread(response: Array, columns: NDArray[np.int64], size: int) -> Array:
    """A recording's derivatives (N, b_r) in the columns of θ that it knows, the others zero."""
    if columns.size == size:  # in order, all of them
        return response
    full = np.zeros((response.shape[0], size))
    full[:, columns] = response
    return full


def following(system: BandedSystem, at: Linearisation, step: Step, r: int) -> Array:
    """Derivative (n, b) of recording r's coefficients by its parameters, held ones included."""
    part, block = system.functional.parts[r], at.blocks[r]
    held = np.zeros((part.held.size, system.columns[r].size))
    if block.held_by_theta is not None:
        held = block.held_by_theta
    follow = np.empty((part.n_coefficients, held.shape[1]))
    follow[system.assemblers[r].order] = np.concatenate([held, -step.inner[r]])
    return follow


def family_response(sites: Sites, rows: Rows, follow: Array) -> Array:
    """Derivatives (E, M, b) of a family's residuals by θ, its coefficients following."""
    from pikanid.optimise.banded_products import carry

    bases, (count, width) = sites.bases, rows.value.shape
    assert bases is not None
    out = np.empty((width, count, follow.shape[1]))
    carry(rows.weight, rows.factor, slopes(rows.state_slopes), slopes(rows.theta_slopes),
          rows.topped, bases.first, bases.local, bases.offset, bases.width, follow, out)
    return out


def effective_parameters(system: BandedSystem, at: Linearisation, step: Step,
                         data: Sequence[Array]) -> float:
    """tr(J_d M⁻¹ J_dᵀ): how many parameters' worth of the data the fit has used up.

    With A the band of the coefficients, A_d the data's share of it, S the reduced matrix of θ and
    R_d the `data` families' derivatives by θ, (N, b) each, the coefficients following θ:
    tr(A⁻¹ A_d) + tr(S⁻¹ R_dᵀ R_d).
    """
    total = 0.0
    for r, part in enumerate(system.functional.parts):
        share = system.assemblers[r].data_band(at.products[r])[:, part.held.size:]
        total += _trace_of_quotient(share, at.blocks[r].band)
    square = np.zeros_like(step.schur)
    for jacobian in data:
        square += jacobian.T @ jacobian
    return total + float(np.sum(invert(step.schur, inside_bounds(system, at)) * square))


def _trace_of_quotient(share: Array, band: Array) -> float:
    """tr(A⁻¹ A_d), A a band that rounding may have left just short of positive definite."""
    from pikanid.optimise.banded_solves import trace_of_quotient

    lift = 0.0
    while math.isnan(trace := trace_of_quotient(share, band, lift)):
        lift = max(1e-14, 10.0 * lift)
        if lift > 1e-2:
            raise LinAlgError("a recording's band is not positive definite")
    return trace
