"""Is anything left in a residual?  Tests with a known rate of false alarms.

The whitened residual of a right model, freed of what its estimated parameters can take up, is white
Gaussian noise projected.  Against that stand the signs of the catalogue (largest one counts), the
power in bands of frequency, and the correlation with the input at small lags.  All of them are
functions of a few hundred linear projections of the residual, so that their joint distribution is
drawn exactly from a Gaussian of that size; the noise level's own error is drawn with it.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.special import chdtrc, roots_hermitenorm

from pikanid.mismatch.settings.detection import DetectionSettings
from pikanid.mismatch.settings.settings import Settings
from pikanid.noise.projection import project
from pikanid.problem.held import HeldInput
from pikanid.problem.inputs_past import rests

BATCH = 500  # numerical: draws at once, between which it is asked whether more would matter
CLEAR = (1e-6, 0.1)  # numerical: p-values beyond which more draws would decide nothing
COUNTED = 10  # numerical: draws above a value from which on their share is its p-value
TAIL = 0.01  # numerical: share of the draws beyond which a tail is continued, not counted
SPANNED = 1e-4  # numerical: of a sign's length, that rounding leaves of what parameters take up
REPEATED = 1e-3  # numerical: of the largest singular value: what is below repeats other columns
ROOT = 1e-7  # numerical: single precision, in which draws are made
BELOW_NYQUIST = 0.9  # numerical: share of half the sampling rate up to which a sine is resolved
AT_ONCE = 4  # numerical: samples within which a fast rig has answered
NODES, WEIGHTS = roots_hermitenorm(21)  # numerical: means over a normal error of ln power
WEIGHTS = WEIGHTS / WEIGHTS.sum()


@dataclass(frozen=True)
class Detection:
    """p-values: of everything, of each kind of test; `z` (m,) the signs' standard scores."""

    p_value: float
    catalogue: float
    bands: float
    inputs: float
    z: np.ndarray
    power: float


def unit_columns(D: np.ndarray, J: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """D without what J explains, in unit columns, and the lengths left (m,); 0 where nothing is."""
    with np.errstate(over="ignore", invalid="ignore"):  # a sign without bounds tells nothing
        before = _lengths(D)
        rest = project(J, D)
        length = _lengths(rest)
    good = np.isfinite(length) & (length > SPANNED * before) & (before > 0)
    rest = rest.copy() if rest is D else rest
    rest /= np.where(good, length, 1.0)  # in place: of a long recording there is no room for two
    rest[:, ~good] = 0.0
    return rest, np.where(good, length, 0.0)


def _lengths(columns: np.ndarray) -> np.ndarray:
    """(m,) of columns (N, m), without room for their squares."""
    return np.sqrt(np.einsum("ij,ij->j", columns, columns))


def detect(r: np.ndarray, J: np.ndarray, units: np.ndarray, one_sided: np.ndarray,
           bands: list[np.ndarray], inputs: np.ndarray, spread: float, settings: Settings,
           seed: int = 0) -> Detection:
    """Test a whitened residual r (N,) of a fit with Jacobian J (N, n).

    Draws go on until their number no longer matters (as in J. Besag and P. Clifford, Biometrika 78,
    1991), or to the budget's.

    Args:
        units: (N, m) signs from `unit_columns`.
        one_sided: (m,) whether only positive scores count.
        bands: Columns (N, k) of each band of frequency, of about unit length.
        inputs: (N, k) columns of the inputs' past, orthonormal.
        spread: Relative standard error of the noise's power.
        settings: Shares of α, and the number of draws.
        seed: Of the draws.
    """
    lines = project(J, np.concatenate([*bands, inputs], axis=1))
    L = np.concatenate([units, lines], axis=1)
    m = units.shape[1]
    ends = m + np.cumsum([0, *(b.shape[1] for b in (*bands, inputs))])
    freedom = np.maximum(np.diff(ends), 1)

    def statistics(scores: np.ndarray) -> np.ndarray:
        """(k, 3) of scores (k, m + ...): the strongest sign, the loudest band, the inputs."""
        signs = scores[:, :m]
        size = np.where(one_sided, np.maximum(signs, 0.0), np.abs(signs))
        powers = np.stack([np.einsum("ki,ki->k", part, part) for part in (
            scores[:, a:b] for a, b in pairwise(ends))], axis=1)
        # bands of many and of few lines compare by their standard scores (Wilson and Hilferty)
        normal = _standard(powers, freedom)
        return np.stack([np.max(size, axis=1, initial=0.0) ** 2, np.max(normal[:, :-1], axis=1),
                         normal[:, -1]], axis=1)

    root = _root(L.T @ L).astype(np.float32)  # of a p-value nobody needs more digits
    rng = np.random.default_rng(seed)
    z = L.T @ r
    observed = statistics(z[None])[0]
    powers = np.array([z[a:b] @ z[a:b] for a, b in pairwise(ends)])
    loudest = int(np.argmax(_standard(powers, freedom)[:-1])) if len(bands) else 0
    drawn: list[np.ndarray] = []
    for _ in range(max(settings.budget.draws // BATCH, 1)):
        noise = rng.standard_normal((BATCH, len(root)), np.float32) @ root
        noise *= np.exp(0.5 * spread * rng.standard_normal((BATCH, 1), np.float32))
        drawn.append(statistics(noise))
        p = [_tail(value, column, functools.partial(_chance, freedom=k, spread=spread))
             for value, column, k in zip(observed, np.concatenate(drawn).T,
                                         (0, freedom[loudest], freedom[-1]), strict=True)]
        total = min(1.0, min(q / share for q, share in zip(p, settings.kinds, strict=True)))
        if not CLEAR[0] < total < CLEAR[1]:
            break
    return Detection(total, p[0], p[1], p[2], z[:m], float(r @ r))


def _root(C: np.ndarray) -> np.ndarray:
    """R (k, n) with RᵀR = C (n, n), up to `ROOT` of its largest element.

    Signs and bands overlap: half of the rows are enough.

    >>> _root(np.array([[4.0, 2.0], [2.0, 1.0]]))
    array([[2., 1.]])
    """
    from scipy.linalg.lapack import dpstrf

    largest = float(np.diag(C).max(initial=0.0))
    factor, order, rank, _ = dpstrf(C, tol=ROOT * max(largest, 1e-12))
    rows = np.triu(factor)[:rank]
    return np.asarray(rows[:, np.argsort(order - 1)])


def _tail(observed: float, drawn: np.ndarray, chance: Callable[[float], float]) -> float:
    """p-value of a value against those drawn; beyond them it falls as the chance of one sign, or
    of one band, to be so loud: of several all but one are quiet there.
    """
    drawn = np.sort(drawn)
    above = len(drawn) - int(np.searchsorted(drawn, observed))
    if above >= COUNTED:
        return (above + 1) / (len(drawn) + 1)
    edge = drawn[int((1 - TAIL) * len(drawn))]
    return float(max(TAIL * min(chance(observed) / max(chance(edge), 1e-300), 1.0), 1e-300))


def _chance(value: float, freedom: int, spread: float) -> float:
    """That χ², times a power with a log-normal error, exceeds a value.

    Args:
        value: χ² of one degree of freedom where `freedom` is 0, else a standard score.
        freedom: Degrees of freedom; 0 for one that is not given as a score.
        spread: Standard deviation of ln power.
    """
    k = max(freedom, 1)
    power = value if not freedom else k * max(
        1 - 2 / (9 * k) + value * np.sqrt(2 / (9 * k)), 0.0) ** 3
    return float(WEIGHTS @ chdtrc(k, power * np.exp(-spread * NODES)))


def _standard(power: np.ndarray, freedom: np.ndarray | int) -> np.ndarray:
    """The standard score of a χ² (E. B. Wilson and M. M. Hilferty, Proc. N. A. S. 17, 1931)."""
    spread = 2 / (9 * freedom)
    return np.asarray(((power / freedom) ** (1 / 3) - (1 - spread)) / np.sqrt(spread))


def frequency_bands(t: np.ndarray, rate: float, settings: DetectionSettings) -> list[np.ndarray]:
    """Sines and cosines (N, k) of about unit length at times t, in bands of frequency.

    Args:
        t: (N,) [s].
        rate: Natural frequency [rad/s]; 0 where nothing oscillates.
        settings: Number and reach of the bands.
    """
    span = float(t[-1] - t[0])
    step = float(np.median(np.diff(t)))
    top = min(settings.reach * rate if rate else np.inf, BELOW_NYQUIST * np.pi / step,
              2 * np.pi * settings.lines / span)
    lines = np.arange(1, max(int(top * span / (2 * np.pi)), 3) + 1)
    edges = np.unique(np.round(np.geomspace(1, len(lines) + 1, settings.bands + 1)).astype(int))
    # powers of the first harmonic: a sine of its own for each line takes seven times as long
    first = np.exp(2j * np.pi / span * (t - t[0]))[:, None]
    waves = np.cumprod(np.broadcast_to(first, (len(t), len(lines))), axis=1) * np.sqrt(2 / len(t))
    return [np.concatenate([waves.real[:, a - 1:b - 1], waves.imag[:, a - 1:b - 1]], axis=1)
            for a, b in pairwise(edges)]


def past_inputs(t: np.ndarray, inputs: Sequence[HeldInput], rate: float,
                settings: DetectionSettings) -> np.ndarray:
    """Orthonormal columns (N, k): each input at lags up to a natural period, and a few samples ago:
    a rig that is as fast as its sampling answers there and nowhere else.  Of one that does not
    rest, what begins at the sample itself may know that one's noise, and is no past.

    Args:
        t: (N,) [s].
        inputs: That move.
        rate: Natural frequency [rad/s]; 0 where nothing oscillates.
        settings: Number and reach of the lags.
    """
    period = 2 * np.pi / rate if rate else (t[-1] - t[0]) / settings.spans
    lags = np.concatenate([np.linspace(0, period, settings.lags),
                           float(np.median(np.diff(t))) * np.arange(1, AT_ONCE + 1)])
    columns = [np.interp(t - lag, u.time, u.values, left=u.values[0])
               for u in inputs for lag in lags[not rests(u):]]
    if not columns:
        return np.empty((len(t), 0))
    stacked = np.stack(columns, axis=1)
    u, s, _ = np.linalg.svd(stacked - stacked.mean(axis=0), full_matrices=False)
    return np.asarray(u[:, s > REPEATED * max(float(s[0]), 1e-300)])
