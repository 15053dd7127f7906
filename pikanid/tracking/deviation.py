"""Standard errors of all pictures of a clip, from how far points of each and neighbours disagree.

Each picture says how large its own error is, but from few degrees of freedom.  The others help:
variances are drawn towards their common one as far as they agree (G. K. Smyth, Stat. Appl. Genet.
Mol. Biol. 3, 2004).  Blur and compression make neighbouring points err alike: a spectrum that falls
is extended to the straight line, the slowest function of all.  Errors that tilt a whole surface are
seen in no picture, but from one to the next: where the angle jumps about more than it should, all
errors are larger.
"""

from __future__ import annotations

from math import comb

import numpy as np
from numpy.typing import NDArray
from scipy.special import digamma, polygamma

from pikanid.tracking.settings import TrackingSettings

Array = NDArray[np.float64]
BAND = 0.975  # definition: of the two-sided 95 % band
ORDER = 8  # numerical: of differences: at 50 Hz they leave little of a motion at 3 Hz
FEWEST = 40  # numerical: differences below which their mean square says too little


def deviations(theta: Array, variance: Array, finer: Array, gain: Array,
               settings: TrackingSettings) -> Array:
    """Standard error (n,) of every angle; NaN where there is none.

    Args:
        theta: (n,) angles [rad], NaN where a picture failed.
        variance: (n,) of the points of each.
        finer: (n,) the same of functions that vary faster.
        gain: (n,) standard error of the angle [rad] for variance 1.
        settings: Which degrees the variances are of.

    >>> from pikanid.tracking.settings import USUAL
    >>> rng = np.random.default_rng(0)
    >>> v = rng.chisquare(8, 500) / 8
    >>> s = deviations(0.01 * rng.standard_normal(500), v, v, np.full(500, 0.01), USUAL)
    >>> bool(abs(np.median(s) / 0.01 - 1) < 0.05)
    True
    """
    from scipy.stats import norm, t

    there = np.isfinite(theta) & (variance > 0)
    out = np.full(len(theta), np.nan)
    if not there.any():
        return out
    freedom = settings.independent
    drawn, more = squeezed(variance[there], freedom)
    out[there] = np.sqrt(drawn * reddened(variance[there], finer[there], settings)) * gain[there]
    # so wide that 1.96 of them hold 95 % of what has few degrees of freedom
    out *= t.ppf(BAND, freedom + more) / norm.ppf(BAND)
    return np.asarray(out * restlessness(theta, out))


def reddened(variance: Array, finer: Array, settings: TrackingSettings) -> float:
    """How many times more variance the straight line has than the degrees that tell it, at least 1:
    the logarithm of the spectrum, known in two bands, is a straight line over the degree.

    >>> from pikanid.tracking.settings import USUAL
    >>> reddened(np.ones(3), np.ones(3) / 2, USUAL)
    2.277...
    """
    middle = settings.degree + (settings.independent + 1) / 2
    falls = np.log(np.median(variance) / np.median(finer)) / settings.independent
    return float(np.exp(max(falls, 0.0) * (middle - 1)))


def squeezed(variance: Array, freedom: int) -> tuple[Array, float]:
    """Variances (n,) drawn towards a common one, and how many degrees of freedom that is worth.

    >>> v, more = squeezed(np.random.default_rng(1).chisquare(8, 400) / 8, 8)
    >>> bool(np.ptp(v) < 0.5), more > 40
    (True, True)
    """
    half = freedom / 2
    level = np.log(variance) - digamma(half) + np.log(half)
    excess = float(np.var(level, ddof=1)) - float(polygamma(1, half)) if len(level) > 1 else 0.0
    if len(level) < 3:
        return variance, 0.0
    if excess <= 1e-6:
        return np.full(len(variance), float(np.exp(np.mean(level)))), 1e6
    prior = 2 * _trigamma_inverse(excess)
    common = float(np.exp(np.mean(level) + digamma(prior / 2) - np.log(prior / 2)))
    return (prior * common + freedom * variance) / (prior + freedom), prior


def restlessness(theta: Array, sigma: Array) -> float:
    """How many times larger than `sigma` errors must be for neighbours to differ as they do, at
    least 1.

    Differences of high order take away whatever moves smoothly.
    """
    weights = np.array([(-1) ** k * comb(ORDER, k) for k in range(ORDER + 1)], float)
    if len(theta) <= ORDER:
        return 1.0
    differences = np.convolve(theta, weights, "valid")
    spread = np.sqrt(np.convolve(sigma**2, weights**2, "valid"))
    z = differences / spread
    z = np.abs(z[np.isfinite(z)])
    if len(z) < FEWEST:
        return 1.0
    # robust: a splash that was missed must not make all others uncertain
    return max(1.0, float(np.sqrt(np.mean(np.minimum(z, 3 * np.median(z)) ** 2))))


def _trigamma_inverse(y: float) -> float:
    """x with trigamma(x) = y, by Newton's method as in Smyth's appendix."""
    x = 0.5 + 1 / y
    for _ in range(50):
        tri = float(polygamma(1, x))
        step = tri * (1 - tri / y) / float(polygamma(2, x))
        x += step
        if abs(step) < 1e-8 * x:
            break
    return x
