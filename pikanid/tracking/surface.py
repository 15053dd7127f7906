"""The surface through points: its angle, level and shape, and how far the points agree."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from pikanid.tracking.settings import MODES, TrackingSettings

Array = NDArray[np.float64]
MAD = 1.4826  # definition: median absolute deviation to standard deviation, normal noise
ROUNDS = 8  # numerical: of reweighting, after which points change no more
SAME = 1e-3  # numerical: change of a weight, share of its greatest, that changes nothing
BLOCKS = 16  # numerical: of neighbouring points, whose medians find where to start
TRIPLES = np.array(list(combinations(range(BLOCKS), 3)))  # definition: all parabolas through three


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
    design = _design(u.tobytes(), degree + 2 * more)
    low = design[:, :degree + 1]
    weight = (np.abs(y - _start(u, y)) <= settings.rough * (right - left)).astype(float)
    residual, scale = y, 0.0
    for _ in range(ROUNDS):
        try:
            line = np.linalg.solve((low * weight[:, None]).T @ low, low.T @ (weight * y))
        except np.linalg.LinAlgError:
            return failed("too few points agree")
        residual = y - low @ line
        scale = max(MAD * _median(np.abs(residual[weight > 0])), 1e-6)
        size = np.abs(residual) / scale
        # Tukey's biweight: what is no part of the surface must have no weight at all
        before, weight = weight, np.maximum(1 - (size / settings.outlier) ** 2, 0) ** 2
        if np.max(np.abs(weight - before)) < SAME:
            break
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
    if float(gains[1]) > settings.unsure * np.sqrt(3 / columns):
        return failed("covered: what is left of the surface does not tell its angle")
    turn = 2 * float(gains[1]) / (right - left) / (1 + slope**2)
    modes = slice(2, 2 + MODES)
    return Surface(float(np.arctan(slope)), float(shape[0]), tuple(shape[modes].tolist()),
                   variance, finer, (turn, float(gains[0]), *gains[modes].tolist()), used)


def _start(u: Array, y: Array) -> Array:
    """The parabola (n,) from which half of the surface is least far: least median of squares (P. J.
    Rousseeuw, J. Am. Stat. Assoc. 79, 1984), over medians of neighbouring points.

    Whatever else has an edge, as a hand, may have nearly as many points as the surface.
    """
    size = len(y) // BLOCKS
    if size == 0:
        return y
    x = u[size // 2:BLOCKS * size:size]
    z = np.partition(y[:BLOCKS * size].reshape(BLOCKS, size), size // 2, axis=1)[:, size // 2]
    found = (_parabolas(x.tobytes()) @ z[TRIPLES][..., None])[..., 0]
    far = np.partition(np.abs(found - z), BLOCKS // 2, axis=1)[:, BLOCKS // 2]
    best = TRIPLES[np.argmin(far)]
    c = np.linalg.solve(x[best, None] ** [0, 1, 2], z[best])
    return np.asarray(c[0] + u * (c[1] + u * c[2]), float)


@lru_cache(maxsize=4)
def _parabolas(at: bytes) -> Array:
    """(triples, blocks, 3): Lagrange's polynomials through three of the points, at all of them."""
    x = np.frombuffer(at)
    nodes = x[TRIPLES]
    factors = [np.prod([(x - nodes[:, j, None]) / (nodes[:, k] - nodes[:, j])[:, None]
                        for j in range(3) if j != k], axis=0) for k in range(3)]
    return np.stack(factors, axis=-1)


@lru_cache(maxsize=4)
def _design(at: bytes, degree: int) -> Array:
    """Legendre polynomials (n, degree + 1) at the points; mostly those of the picture before."""
    return np.asarray(legendre.legvander(np.frombuffer(at), degree), float)


def _median(values: Array) -> float:
    middle = len(values) // 2
    return float(np.partition(values, middle)[middle])
