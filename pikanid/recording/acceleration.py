"""Acceleration of a position whose standard errors are known: no smoothness is set by hand.

A smoothing spline of degree 5, min Σ((y - x)/σ)² + λ ∫ (d³x/dt³)² dt, is the mean of a motion whose
jerk is white noise, given the samples (G. Wahba, J. R. Stat. Soc. B 40, 1978).  That makes λ a
parameter of a likelihood, restricted to what no parabola explains, and gives standard errors (G.
Wahba, J. R. Stat. Soc. B 45, 1983).  Its acceleration is continuous and free at both ends; all
matrices have bands, so the cost grows as the number of samples does.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from pikanid import errors
from pikanid.formula import units
from pikanid.recording.channel import Array, Channel, check_times, check_values

DEGREE = 5  # definition: of the spline whose third derivative is penalised
ORDER = 3  # definition: of that derivative
# log10 of λ in units of noise and interval; outside, nothing or all is smoothed
RANGE = (-5.0, 11.0)  # numerical: there the matrices are not singular to rounding
TRIED = 33  # numerical: values of λ, between the best of which the optimum is looked for
FEWEST = 12  # numerical: samples that a spline is made of


@dataclass(frozen=True, eq=False)
class Accelerated:
    """An acceleration, how fast a motion it follows, and others that the positions allow.

    Attributes:
        channel: At all times from the first to the last known position, with its standard errors
            for every sample; between missing positions they grow.
        band: Frequency [Hz] at which half of an oscillation is left.
    """

    channel: Channel
    band: float
    _spline: _Spline = field(repr=False)
    _power: float = field(repr=False)
    _scale: float = field(repr=False)

    def draw(self, rng: np.random.Generator) -> Channel:
        """An acceleration drawn from those that are as likely as their standard errors say;
        neighbouring errors are as alike as those of `channel` are.
        """
        away = self._spline.drawn(self._power, self._times, rng) * self._scale
        return replace(self.channel, values=self.channel.values + away, sigma=None)

    @property
    def _times(self) -> Array:
        t = self.channel.time
        return np.asarray((t - t[0]) / (t[-1] - t[0]) * self._spline.stop)


def acceleration(position: Channel, name: str) -> Accelerated:
    """The second time derivative of a position.

    Args:
        position: With a sigma; samples may be missing.
        name: Of the acceleration.

    Raises:
        BadRecording: If times or values are unusable, or too few.
        BadSetting: If there is no sigma.

    >>> t = np.linspace(0, 2, 201)
    >>> noise = 1e-4 * np.random.default_rng(0).standard_normal(201)
    >>> found = acceleration(Channel("x", t, np.sin(3 * t) + noise, "m", sigma=1e-4), "u_x").channel
    >>> off = (found.values + 9 * np.sin(3 * t)) / found.sigma
    >>> found.unit, bool(np.sqrt(np.mean(off**2)) < 1.5)
    ('m/s^2', True)
    """
    from scipy.optimize import minimize_scalar

    check_times(position, position.name)
    check_values(position, position.name, missing_allowed=True)
    if position.sigma is None:
        raise errors.BadSetting(errors.no_sigma_to_smooth(position.name))
    known = np.flatnonzero(np.isfinite(position.values))
    if len(known) < FEWEST:
        raise errors.BadRecording(errors.derivative_short(position.name, len(known), FEWEST))
    sigma = np.broadcast_to(position.sigma, len(position))[known]
    step, scale = position.interval, float(np.median(sigma))
    begin = position.time[known[0]]
    inside = slice(known[0], known[-1] + 1)
    time = position.time[inside]
    # a knot where a sample is missing, too: between its neighbours the motion may be any
    spline = _Spline((time - begin) / step, (position.time[known] - begin) / step,
                     (position.values[known] - position.values[known[0]]) / scale, sigma / scale)
    tried = np.linspace(*RANGE, TRIED)
    costs = np.array([spline.cost(p) for p in tried])
    best = int(np.clip(np.argmin(costs), 1, TRIED - 2))
    power = float(minimize_scalar(spline.cost, bounds=(tried[best - 1], tried[best + 1]),
                                  method="bounded", options={"xatol": 1e-3}).x)
    values, spread = spline.second(power, np.clip((time - begin) / step, 0, spline.stop))
    unit = position.unit and units.product((position.unit, 1), ("s", -2))
    made = Channel(name, time, values * scale / step**2, unit, spread * scale / step**2, "cubic")
    # a sample an interval: half of an oscillation with λ ω^6 = 1 is left
    return Accelerated(made, float(10 ** (-power / (2 * ORDER)) / (2 * np.pi * step)), spline,
                       power, scale / step**2)


class _Spline:
    """The normal equations of samples (n,) at times (n,), over knots (m,)."""

    def __init__(self, knots: Array, time: Array, values: Array, sigma: Array):
        from pikanid.approximators.bspline import BSpline, knots_from_breakpoints

        self.stop = float(knots[-1])
        self.basis = BSpline(DEGREE, knots_from_breakpoints(knots, DEGREE))
        self.values, self.weight = values, 1 / sigma**2
        node = np.sqrt(3 / 5)
        middle, half = (knots[1:] + knots[:-1]) / 2, np.diff(knots) / 2
        at = (middle[:, None] + half[:, None] * [-node, 0, node]).ravel()
        share = (half[:, None] * [5 / 9, 8 / 9, 5 / 9]).ravel()
        self.local, self.jerk = self.basis.local(time), self.basis.local(at, ORDER)
        self.share = share
        self.data = self._banded(self.weight, *self.local)
        self.rough = self._banded(share, *self.jerk)
        first, local = self.local
        self.right = np.zeros(self.basis.n_basis)
        np.add.at(self.right, first[:, None] + np.arange(DEGREE + 1),
                  local * (self.weight * values)[:, None])

    def cost(self, power: float) -> float:
        """-2 log of the restricted likelihood of λ = 10^power, but for a constant."""
        from scipy.linalg import cho_solve_banded

        factor = self._factor(power)
        c = cho_solve_banded((factor, True), self.right)
        # not as yᵀWy - rᵀc, a difference of large numbers
        left = float(self.weight @ (self.values - self._at(*self.local, c)) ** 2)
        left += 10**power * float(np.sum(self.share * self._at(*self.jerk, c) ** 2))
        rank = self.basis.n_basis - ORDER
        return left + 2 * float(np.sum(np.log(factor[0]))) - rank * np.log(10.0) * power

    def second(self, power: float, at: Array) -> tuple[Array, Array]:
        """Second derivative and its standard error at times (m,)."""
        from scipy.linalg import cho_solve_banded

        factor = self._factor(power)
        c = cho_solve_banded((factor, True), self.right)
        first, local = self.basis.local(at, 2)
        window = first[:, None] + np.arange(DEGREE + 1)
        covariance = _near_diagonal(factor)
        variance = np.zeros(len(at))
        for away in range(DEGREE + 1):
            pairs = local[:, :DEGREE + 1 - away] * local[:, away:]
            times = 1 if away == 0 else 2
            variance += times * np.einsum("ma,ma->m", pairs,
                                          covariance[away][window[:, :DEGREE + 1 - away]])
        return self._at(first, local, c), np.sqrt(np.maximum(variance, np.finfo(float).tiny))

    def drawn(self, power: float, at: Array, rng: np.random.Generator) -> Array:
        """Second derivative at times (m,) of an error with the covariance of the coefficients."""
        from scipy.linalg import solve_banded

        factor = self._factor(power)
        upper = np.zeros_like(factor)
        for away, row in enumerate(factor):
            upper[DEGREE - away, away:] = row[:len(row) - away]
        # (L Lᵀ)⁻¹ is the covariance of L⁻ᵀ z
        z = solve_banded((0, DEGREE), upper, rng.standard_normal(self.basis.n_basis))
        return self._at(*self.basis.local(at, 2), z)

    def _factor(self, power: float) -> Array:
        from scipy.linalg import cholesky_banded

        return np.asarray(cholesky_banded(self.data + 10**power * self.rough, lower=True))

    def _at(self, first: NDArray[np.int64], local: Array, c: Array) -> Array:
        return np.asarray(np.einsum("ma,ma->m", local, c[first[:, None] + np.arange(DEGREE + 1)]))

    def _banded(self, weight: Array, first: NDArray[np.int64], local: Array) -> Array:
        """BᵀWB of the basis or its derivative, lower band (DEGREE + 1, n_basis)."""
        band = np.zeros((DEGREE + 1, self.basis.n_basis))
        for away in range(DEGREE + 1):
            for a in range(DEGREE + 1 - away):
                np.add.at(band[away], first + a, weight * local[:, a] * local[:, a + away])
        return band


def _near_diagonal(factor: Array) -> Array:
    """Of (L Lᵀ)⁻¹ the band that L has (K, n): row d holds elements (i, i + d).

    From the last row upwards (K. Takahashi, J. Fagan and M.-S. Chin, Proc. 8th PICA, 1973).

    >>> factor = np.array([[2.0, 1.0, 1.0], [0.5, 0.3, 0.0]])
    >>> full = np.diag(factor[0]) + np.diag(factor[1, :-1], -1)
    >>> exact = np.linalg.inv(full @ full.T)
    >>> bool(np.allclose(_near_diagonal(factor)[1, :2], np.diag(exact, 1)))
    True
    """
    width, n = factor.shape[0] - 1, factor.shape[1]
    out = np.zeros_like(factor)
    below = np.zeros((width, width))  # elements (i + 1 .. i + width)²
    for i in range(n - 1, -1, -1):
        column = factor[1:, i] / factor[0, i]
        across = -below @ column
        own = 1 / factor[0, i] ** 2 - column @ across
        out[0, i], out[1:, i] = own, across
        below[1:, 1:] = below[:-1, :-1].copy()
        below[0, 0], below[0, 1:], below[1:, 0] = own, across[:-1], across[:-1]
    return out
