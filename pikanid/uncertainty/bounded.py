"""What a parameter at its bound adds to the standard errors of the others.

Held there, it counts as known, and whatever it trades with seems far too well known.  With a flat
prior inside the bounds its distance d ≥ 0 from the bound has, to second order, the density
exp(-(λd + ½Sd²)): λ is the slope of ½χ² inwards, S its curvature with the others refitted.  That is
a normal distribution cut off at the bound (N. L. Johnson, S. Kotz and N. Balakrishnan, Continuous
Univariate Distributions, vol. 1, 1994, sec. 13.10.1), and the others follow d by -F_ff⁻¹F_fb.
"""

from __future__ import annotations

import numpy as np

FAR = 1e4  # numerical: σ beyond the bound, from which on ⟨d²⟩ = 2/λ² holds to rounding
EXCHANGED = 1e-14  # numerical: share of a column's square that rounding leaves beside the others


def with_bounds(covariance: np.ndarray, jacobian: np.ndarray, residual: np.ndarray,
                theta: np.ndarray, lower: np.ndarray, upper: np.ndarray, at_bound: np.ndarray
                ) -> np.ndarray:
    """A covariance (n, n) of the parameters that no bound holds, with what those at bounds add.

    Args:
        covariance: Of θ where those at bounds are known; their own rows and columns stay.
        jacobian: (rows, n) of standardised residuals.
        residual: (rows,) those.
        theta, lower, upper, at_bound: (n,) estimates, bounds, and which of them are met.

    >>> J = np.array([[1.0, 1.0], [0.0, 1.0]])
    >>> held = np.diag([1.0, np.nan])
    >>> at, low, high = np.array([1.0, 0.0]), np.zeros(2), np.full(2, np.inf)
    >>> found = with_bounds(held, J, np.zeros(2), at, low, high, np.array([False, True]))
    >>> float(found[0, 0])  # of two parameters that are both free: 2
    2.0
    """
    found = covariance.copy()
    free = ~at_bound & (np.linalg.norm(jacobian, axis=0) > 0)
    if not free.any():
        return found
    seen = jacobian[:, free]
    scale = np.linalg.norm(seen, axis=0)
    for b in np.flatnonzero(at_bound & (upper > lower) & jacobian.any(axis=0)):
        column = jacobian[:, b]
        follow = np.linalg.lstsq(seen / scale, column, rcond=None)[0]
        rest = column - seen / scale @ follow
        inward = column if theta[b] - lower[b] <= upper[b] - theta[b] else -column
        curvature = max(float(rest @ rest), EXCHANGED * float(column @ column))
        moment = second_moment(float(inward @ residual), curvature)
        moment = min(moment, float(upper[b] - lower[b]) ** 2 / 3)
        way = follow / scale
        found[np.ix_(free, free)] += moment * np.outer(way, way)
    return found


def second_moment(slope: float, curvature: float) -> float:
    """⟨d²⟩ of the density exp(-(λd + ½Sd²)) over d ≥ 0, from the slope λ and the curvature S > 0.

    >>> second_moment(0.0, 4.0), round(second_moment(50.0, 1.0) * 50.0**2, 3)
    (0.25, 1.996)
    """
    from scipy.special import erfcx

    z = slope / curvature**0.5
    if z > FAR:
        return 2.0 / slope**2
    hazard = (2.0 / np.pi) ** 0.5 / float(erfcx(z / 2.0**0.5))
    return (1.0 + z * z - z * hazard) / curvature
