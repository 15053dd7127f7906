"""The surface through points: its angle, level and shape, and how far the points agree."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from pikanid.tracking.settings import MODES, TrackingSettings

Array = NDArray[np.float64]
HUBER = 1.345  # definition: 95 % efficiency under normal noise (Huber, Robust Statistics, 1981)
MAD = 1.4826  # definition: median absolute deviation to standard deviation, normal noise
ROUNDS = 8  # numerical: of reweighting, after which points change no more


@dataclass(frozen=True)
class Surface:
    """What the points of one picture say.

    Attributes:
        theta: Angle [rad] of the line that is nearest to the surface from wall to wall, positive
            where it rises to the right; NaN if it failed.
        level: Height at the middle of that line, in the unit of the points.
        shape: Legendre coefficients of degrees 2, 3, 4 of the surface over the width, in the unit
            of the points.
        variance: Of a coefficient of an orthonormal function of the points: how far they disagree.
        finer: The same of functions that vary faster; where errors of neighbours are alike, less.
        gains: Standard errors of angle [rad], level and shape where `variance` is 1.
        points: Share of the columns that were used.
        reason: Why it failed; empty if it did not.
    """

    theta: float
    level: float = np.nan
    shape: tuple[float, ...] = ()
    variance: float = np.nan
    finer: float = np.nan
    gains: tuple[float, ...] = ()
    points: float = 0.0
    reason: str = ""


def failed(reason: str) -> Surface:
    """No surface, and why."""
    return Surface(np.nan, reason=reason)


def surface(x: Array, y: Array, left: float, right: float, columns: int,
            settings: TrackingSettings) -> Surface:
    """The surface through points (n,), y up, of the `columns` between walls at `left` and `right`.

    A polynomial, robustly fitted; the angle is that of its nearest line over the
    whole width.  Neighbouring points err alike where a picture is blurred or compressed.  What
    matters is how much of that reaches the lowest degrees; the next higher ones, which a surface
    does not reach, show it: coefficients of an orthonormal series have the variance of the noise's
    spectrum there, whatever its correlation (U. K. Müller, J. Econometrics 141, 2007; series
    variance estimator), and the mean square of K of them has K degrees of freedom.
    """
    degree, more = settings.degree, settings.independent
    u = (2 * x - left - right) / (right - left)
    design = legendre.legvander(u, degree + 2 * more)
    low = design[:, :degree + 1]
    weight, residual, scale = np.ones_like(y), y, 0.0
    for k in range(ROUNDS):
        try:
            line = np.linalg.solve((low * weight[:, None]).T @ low, low.T @ (weight * y))
        except np.linalg.LinAlgError:
            return failed("too few points agree")
        residual = y - low @ line
        scale = max(MAD * _median(np.abs(residual[weight > 0])), 1e-6)
        size = np.abs(residual) / scale
        # Huber's weights find the surface, Tukey's biweight then leaves out what is none of it
        weight = (np.minimum(1.0, HUBER / np.maximum(size, HUBER)) if 2 * k < ROUNDS else
                  np.maximum(1 - (size / settings.outlier) ** 2, 0) ** 2)
    kept = np.abs(residual) <= settings.outlier * scale
    used = float(np.count_nonzero(kept)) / columns
    if scale > settings.rough * (right - left):
        return failed("the points make no surface")
    if used < settings.columns:
        return failed("too few points agree")
    q, r = np.linalg.qr(design[kept])
    c = q.T @ y[kept]
    variance, finer = (float(np.mean(part**2)) for part in np.split(c[degree + 1:], 2))
    shape = np.linalg.solve(r[:degree + 1, :degree + 1], c[:degree + 1])
    # Legendre polynomials are orthogonal over the whole width: the nearest line is the first two.
    slope = 2 * float(shape[1]) / (right - left)
    gains = np.linalg.norm(np.linalg.inv(r[:degree + 1, :degree + 1]), axis=1)
    turn = 2 * float(gains[1]) / (right - left) / (1 + slope**2)
    modes = slice(2, 2 + MODES)
    return Surface(float(np.arctan(slope)), float(shape[0]), tuple(shape[modes].tolist()),
                   variance, finer, (turn, float(gains[0]), *gains[modes].tolist()), used)


def _median(values: Array) -> float:
    middle = len(values) // 2
    return float(np.partition(values, middle)[middle])
