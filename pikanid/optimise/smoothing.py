"""The data-only fit: splines smoothed by generalised cross-validation, the first step of PDA.

min ‖(y - h(x̂))/σ‖² + ρ ∫ |x̂⁽ᵠ⁾|² dt with ρ minimising N·RSS/(N - edf)² (Craven and Wahba, Numer.
Math. 31, 1979); edf = tr((A_d + ρ A_q)⁻¹ A_d), estimated from a few fixed random probes.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import LinAlgError

from pikanid.approximators import Array
from pikanid.optimise.gauss_newton import BandedSystem, Linearisation, Point, gauss_newton

# The splines use all that they can of the data once a decade adds less than this share to it.
FLAT = 1e-4  # numerical: of the effective parameters, whose trace is estimated
STRIDE = 2.0  # numerical: decades between scores that say where the least one is
LINEAR = 1e-6  # numerical: of the data's cost that was foretold of one step, a rise that is none


class Score(NamedTuple):
    """What cross-validation says of a ρ."""

    rho: float
    value: float
    residual: float  # sum of squares
    effective: float  # parameters


@dataclass(frozen=True, eq=False)
class Smoothed:
    """Smoothed coefficients, the residual's standard deviation in weighted units, edf and ρ."""

    point: Point
    sigma: float
    effective: float
    rho: float


def smooth(system: BandedSystem, point: Point, rho: float | None = None, probes: int = 16
           ) -> Smoothed | None:
    """Smooth the data of all recordings with one ρ; None where they do not determine the splines.

    Without a given ρ, cross-validation chooses it, edf estimated from no more than `probes` probes.

    `system` is built on `functional.smoothing()`; θ stays.
    """
    both = system.linearise(point, 1.0)
    data = system.linearise(both, 0.0)
    mass = sum(float(b.band[0].sum()) for b in data.blocks)
    rough = sum(float(b.band[0].sum()) for b in both.blocks) - mass
    if mass <= 0.0 or rough <= 0.0:
        return None
    count = system.functional.n_data
    pencil, ridge = Pencil(data, both, count, probes), mass / rough
    # Least squares proper (ρ = 0) keeps a trace of roughness, for knots without data.
    chosen = pencil.search(ridge) if rho is None else pencil.at(max(rho, 1e-14 * ridge), most=1.0)
    if chosen is None:
        return None
    rho, _, residual, effective = chosen
    try:
        step = system.step(system.linearise(both, rho), point.theta, point.theta)
        found = system.moved(point, step)
        if not _data_cost(system, found) <= (1.0 + LINEAR) * residual:  # outputs are not linear
            found = gauss_newton(system, found, rho, point.theta, point.theta,
                                 iterations=10).at.point
    except LinAlgError:
        return None
    sigma = float(np.sqrt(max(residual, 0.0) / max(count - effective, 1.0)))
    return Smoothed(found, sigma, effective, rho)


def _data_cost(system: BandedSystem, point: Point) -> float:
    return sum(float(np.sum(rows.residual**2)) for r, c in enumerate(point.coefficients)
               for rows in system.functional.data_rows(r, c, point.theta))


class Pencil:
    """The normal equations of `count` data, and how they change with ρ, at one point."""

    def __init__(self, data: Linearisation, both: Linearisation, count: int, probes: int):
        self.cost, self.count = data.data_cost, count
        self.blocks = []
        sizes = [block.slope.size for block in data.blocks]
        number = min(max(4000 // max(1, sum(sizes)), 1), probes)
        drawn = _probes(tuple(sizes), number)
        for only, all_, probe in zip(data.blocks, both.blocks, drawn, strict=True):
            right = np.empty((len(probe), number + 1))
            right[:, :-1], right[:, -1] = multiply(only.band, probe), -only.slope
            self.blocks.append((np.ascontiguousarray(only.band.T),
                                np.ascontiguousarray((all_.band - only.band).T), right,
                                all_.slope - only.slope, probe / number))

    def search(self, ridge: float) -> Score | None:
        """The least score, by every other decade, and then a decade and half a one beside it.

        From 1e4 of `ridge` down to where less roughness changes nothing: the splines use all of the
        data that they can, or more than they may.  1e-14 is the end in any case.
        """
        found: list[Score] = []
        for rho in ridge * 10.0 ** np.arange(4.0, -15.0, -STRIDE):
            score = self.at(rho)
            if score is not None:
                found.append(score)
            elif found:
                break
            used = [score.effective for score in found]
            if len(used) > 1 and used[-1] > 2.0 * used[0] and used[-1] < (
                    1 + STRIDE * FLAT) * used[-2]:
                break
        if not found:
            return None
        best = min(found, key=lambda score: score.value)
        for decades in (1.0, 0.5):
            beside = [self.at(best.rho * 10.0**by) for by in (-decades, decades)]
            best = min([best, *filter(None, beside)], key=lambda score: score.value)
        return best

    def at(self, rho: float, most: float = 0.8) -> Score | None:
        """None where the system is singular or more than `most` of the data is used."""
        from pikanid.optimise.banded_solves import penalised

        effective, residual = 0.0, self.cost
        for data, rough, right, bent, probe in self.blocks:
            used, change = penalised(data, rough, float(rho), right, bent, probe)
            effective += used
            residual += change
        if math.isnan(effective):
            return None
        if effective >= most * self.count and most < 1.0:
            return None
        left = max(self.count - effective, 1e-3)
        return Score(rho, self.count * residual / left**2, residual, effective)


@functools.lru_cache(maxsize=2)
def _probes(sizes: tuple[int, ...], number: int) -> list[Array]:
    """Random signs (size, number) for every recording; callers only read them."""
    generator = np.random.default_rng(0)
    return [generator.choice([-1.0, 1.0], size=(size, number)) for size in sizes]


def multiply(band: Array, columns: Array) -> Array:
    """Product of a symmetric matrix in lower band form (kd + 1, n) with columns (n, q).

    >>> multiply(np.array([[2.0, 2.0], [1.0, 0.0]]), np.eye(2))
    array([[2., 1.],
           [1., 2.]])
    """
    from pikanid.optimise.banded_products import add_product

    out = np.zeros(columns.shape)
    add_product(np.ascontiguousarray(band.T), np.ascontiguousarray(columns), out)
    return out
