"""Does the fitted model explain the recording?  A bad optimum must never look like a success.

With known σ the sum of squared standardised residuals follows χ² with N - n_free degrees of
freedom when the model is right (Seber & Wild, Nonlinear Regression, 1989, sec. 2.1).  Without σ the
residual is compared with the recording's own high-frequency noise, which is as uncertain.

A few degrees of freedom decide nothing: where a residual of twice the noise would be missed more
often than not, a model that is not refuted is not confirmed either.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from pikanid.noise.level import difference_noise_and_freedom
from pikanid.objective.settings import USUAL, AdequacySettings

LEAST = 3.0  # limit: degrees of freedom of a noise, below which its ratio to another has no mean
Verdict = Literal["fits", "misfit", "unknown"]


@dataclass(frozen=True)
class Adequacy:
    """The χ² verdict.

    `value` is Σ (residual/σ)² over `dof` degrees of freedom; `p_value` the probability of a larger
    one if the model is right, by F where σ is read off the samples; `source` says where it came
    from ("given" or "differences").  The verdict is "unknown" where nothing was measured, or too
    little to judge by.
    """

    value: float
    dof: int
    p_value: float
    verdict: Verdict
    source: Literal["given", "differences", "none"]

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers for JSON."""
        return {"value": self.value, "dof": self.dof, "p_value": self.p_value,
                "verdict": self.verdict, "sigma_source": self.source}


def judge(residuals: Sequence[np.ndarray], sigmas: Sequence[np.ndarray | None],
          data: Sequence[np.ndarray], n_free: int, settings: AdequacySettings = USUAL,
          times: Sequence[np.ndarray] | None = None) -> Adequacy:
    """Judge the residuals of all outputs together.

    Args:
        residuals, sigmas, data: One array (N_o,) an output and recording; σ None where unknown.
        n_free: Number of estimated parameters.
        settings: Rate at which a right model is called a misfit, and what else the test needs.
        times: Of each array (N_o,) [s]; None where sampling is even.

    >>> r = np.random.default_rng(0).normal(0, 2.0, 500)
    >>> judge([r], [np.full(500, 2.0)], [r], 2).verdict
    'fits'
    >>> judge([r], [np.full(500, 1.0)], [r], 2).verdict
    'misfit'
    """
    from scipy.special import chdtrc

    count = sum(map(len, residuals))
    dof = max(count - n_free, 1)
    if count == 0:
        return Adequacy(np.nan, dof, np.nan, "unknown", "none")
    otherwise: Verdict = "fits" if decides(count - n_free, settings) else "unknown"
    if all(s is not None for s in sigmas):
        shares = (r / s for r, s in zip(residuals, sigmas, strict=True))
        value = float(sum(z @ z for z in shares))
        p = float(chdtrc(dof, value))
        refuted = p < settings.alpha and count > n_free
        return Adequacy(value, dof, p, "misfit" if refuted else otherwise, "given")
    value, threshold, told = 0.0, 0.0, []
    where: Sequence[np.ndarray | None] = [None] * len(data) if times is None else times
    for r, s, y, t in zip(residuals, sigmas, data, where, strict=True):
        noise, known = difference_noise_and_freedom(y, t) if s is None else (s, np.inf)
        floor = 1e-9 * max(float(np.ptp(y)), 1e-300)
        own = float(np.sum((r / np.maximum(noise, floor)) ** 2))
        value, threshold = value + own, threshold + len(r)
        told.append((own, max(known, LEAST)))
    p = _p_value(told, dof)
    if not any(s is not None or len(r) >= settings.samples
               for r, s in zip(residuals, sigmas, strict=True)):
        return Adequacy(value, dof, p, "unknown", "differences")
    # the noise is itself estimated, and coloured noise fools differences: ask for a large factor
    far = value > settings.far * threshold and count > n_free
    return Adequacy(value, dof, p, "misfit" if far else otherwise, "differences")


def _p_value(told: Sequence[tuple[float, float]], dof: int) -> float:
    """Of Σ (residual/σ)² by parts, each with the degrees of freedom of its σ² (inf: given), by an F
    distribution (F. E. Satterthwaite, Biometrics 2, 1946).
    """
    from scipy.special import chdtrc, fdtrc

    # 1/σ² that is read off is too large on average
    parts = [(own * (1 - 2 / known), known) for own, known in told]
    value = sum(own for own, _ in parts)
    unsure = sum((own / value) ** 2 / known for own, known in parts) if value > 0 else 0.0
    if unsure == 0 or not np.isfinite(value):
        return float(chdtrc(dof, value))
    freedom = max(1 / unsure, LEAST)
    return float(fdtrc(dof, freedom, value / dof * freedom / (freedom - 2)))


def decides(dof: int, settings: AdequacySettings = USUAL) -> bool:
    """Whether a χ² test with so many degrees of freedom sees a residual of twice the noise at least
    every other time.

    >>> [dof for dof in range(-2, 20) if decides(dof)][0]
    7
    """
    return _decides(dof, settings.alpha, settings.times, settings.power)


@functools.lru_cache(maxsize=256)
def _decides(dof: int, alpha: float, times: float, power: float) -> bool:
    from scipy.special import chdtrc, chdtri

    return dof > 0 and float(chdtrc(dof, chdtri(dof, alpha) / times**2)) >= power
