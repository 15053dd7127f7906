"""Autoregressive models of a stationary series: fitted, with the uncertainty of the fit."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pikanid.noise.settings import USUAL
from pikanid.recording.channel import Array


@dataclass(frozen=True)
class AR:
    """x_t = Σ a_k x_{t-k} + e_t.

    Attributes:
        coefficients: (p,) a_k.
        innovation: Standard deviation of e.
        sigma: Standard deviation of x.
        sigma_std: Standard error of `sigma`.
    """

    coefficients: Array
    innovation: float
    sigma: float
    sigma_std: float

    @property
    def memory(self) -> float:
        """Samples after which a deviation has decayed by 1/e, 0 for white noise.

        >>> round(AR(np.array([0.5]), 1.0, 1.0, 0.1).memory, 2)
        1.44
        """
        if len(self.coefficients) == 0:
            return 0.0
        radius = float(np.max(np.abs(np.roots(np.concatenate([[1.0], -self.coefficients])))))
        if radius == 0:
            return 0.0
        return float(-1 / np.log(radius)) if radius < 1 else float("inf")


def fit(series: Array, highest: int = USUAL.order) -> AR:
    """The AR model with the smallest BIC among orders 0 to `highest`.

    BIC = n·ln(innovation²) + p·ln n (G. Schwarz, Ann. Stat. 6, 1978).

    Args:
        series: (n,) with zero mean.
        highest: Order tried at most.

    >>> rng = np.random.default_rng(0)
    >>> len(fit(rng.standard_normal(500)).coefficients)
    0
    """
    n = len(series)
    tried = [burg(series, p) for p in range(min(highest, n // 10) + 1)]
    scores = [
        n * np.log(max(model.innovation, 1e-300) ** 2) + p * np.log(n)
        for p, model in enumerate(tried)
    ]
    best = tried[int(np.argmin(scores))]
    # A short series may hide its correlation from the criterion, but not from the error bar.
    return replace(best, sigma_std=max(model.sigma_std for model in (best, *tried[1:2])))


def burg(series: Array, order: int) -> AR:
    """An AR model of given order by Burg's method; it is always stable.

    Each reflection coefficient minimises the forward and backward prediction errors together
    (J. P. Burg, 1975).  σ has the relative standard error √(Σρ_k²/2n) (P. J. Brockwell and
    R. A. Davis, Time Series, §7.2).

    Args:
        series: (n,) with zero mean.
        order: p < n.

    >>> x = np.zeros(2000); e = np.random.default_rng(3).standard_normal(2000)
    >>> for k in range(1, 2000): x[k] = 0.5 * x[k - 1] + e[k]
    >>> model = burg(x, 1)
    >>> round(float(model.coefficients[0]), 1)
    0.5
    """
    n = len(series)
    forward, backward = series[1:].copy(), series[:-1].copy()
    a = np.empty(0)
    power = float(np.mean(series**2))
    for _ in range(order):
        energy = float(forward @ forward + backward @ backward)
        k = 2 * float(forward @ backward) / energy if energy > 0 else 0.0
        k = float(np.clip(k, -1 + 1e-12, 1 - 1e-12))
        a = np.concatenate([a - k * a[::-1], [k]])
        power *= 1 - k * k
        forward, backward = (forward - k * backward)[1:], (backward - k * forward)[:-1]
    # The mean and p coefficients were fitted.
    innovation = float(np.sqrt(power * n / max(n - order - 1, 1)))
    rho = autocorrelation(a, max(order, 1) if order == 0 else min(max(50, order), n))
    sigma = innovation / float(np.sqrt(max(1 - float(a @ rho[1 : order + 1]), 1e-12)))
    effective = 1 + 2 * float(np.sum(rho[1:] ** 2))
    return AR(a, innovation, sigma, sigma * float(np.sqrt(effective / (2 * n))))


def innovations(series: Array, model: AR) -> Array:
    """(n - p,) what a model does not predict of a series: e_t = x_t - Σ a_k x_{t-k}.

    >>> innovations(np.array([1.0, 0.5, 1.25]), AR(np.array([0.5]), 1.0, 1.0, 0.1))
    array([0., 1.])
    """
    p = len(model.coefficients)
    return np.asarray(np.convolve(series, np.concatenate([[1.0], -model.coefficients]), "valid"))[
        : len(series) - p
    ]


def autocorrelation(coefficients: Array, n: int) -> Array:
    """(n,) autocorrelations at lags 0 to n-1 of an AR process, from the Yule-Walker equations.

    >>> autocorrelation(np.array([0.5]), 4).tolist()
    [1.0, 0.5, 0.25, 0.125]
    """
    p = len(coefficients)
    rho = np.zeros(max(n, p + 1))
    rho[0] = 1.0
    if p:
        # ρ_j = Σ_k a_k ρ_{|j-k|} for j = 1..p.
        system = np.eye(p)
        right = np.zeros(p)
        for j in range(1, p + 1):
            for k in range(1, p + 1):
                lag = abs(j - k)
                if lag == 0:
                    right[j - 1] += coefficients[k - 1]
                else:
                    system[j - 1, lag - 1] -= coefficients[k - 1]
        rho[1 : p + 1] = np.linalg.solve(system, right)
        for j in range(p + 1, len(rho)):
            rho[j] = coefficients @ rho[j - p : j][::-1]
    return rho[:n]
