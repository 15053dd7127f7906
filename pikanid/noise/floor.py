"""The least noise that a signal has: what rounding to its sensor's step leaves.

An encoder at rest shows no noise at all, and one that hardly moves next to none.  What is known of
its motion is known to a step, whatever an estimate from its samples says: the error of rounding is
spread evenly over one step, with a standard deviation of step/√12 (B. Widrow and I. Kollár,
Quantization Noise, 2008, ch. 5).  Every estimate of a σ in this package is at least that.

While a rounded signal does not change, neither does the error of rounding: such samples repeat one
observation.
"""

from __future__ import annotations

import numpy as np

from pikanid.noise.settings import ROUNDING, RoundingSettings

EQUAL = 1e-12  # numerical: of the largest value: smaller changes are those of floating point
WHOLE = 0.01  # numerical: of a step, by which whole numbers of it may be off


def rounding_step(values: np.ndarray, settings: RoundingSettings = ROUNDING) -> float:
    """The step of a rounded signal (N,): some samples repeat, and all changes are whole multiples
    of the smallest one; 0 for any other.

    >>> rounding_step(np.array([0.0, 0.0, 0.0, 0.5, 0.5, 1.5, 1.5]))
    0.5
    >>> rounding_step(np.array([0.0, 0.0, 0.1, 0.35, 0.6])), rounding_step(np.arange(9.0))
    (0.0, 0.0)
    """
    finite = values[np.isfinite(values)]
    changes = np.abs(np.diff(finite))
    real = changes[changes > EQUAL * float(np.max(np.abs(finite), initial=0.0))]
    if not settings.changes <= len(real) < len(changes):
        return 0.0
    counts = real / real.min()
    return float(real.min()) if np.max(np.abs(counts - np.round(counts))) < WHOLE else 0.0


def rounding_noise(values: np.ndarray, settings: RoundingSettings = ROUNDING) -> float:
    """Standard deviation of the error of rounding in a signal (N,), in its unit; 0 if it has none.

    >>> t = np.arange(1000) * 0.01
    >>> sigma = rounding_noise(np.round(np.sin(t), 2))
    >>> round(sigma * 12**0.5, 6)
    0.01
    """
    return rounding_step(values, settings) / float(np.sqrt(12.0))


def repeated(values: np.ndarray, settings: RoundingSettings = ROUNDING) -> np.ndarray:
    """Which samples (N,) of a rounded signal say again what their neighbours say: of more than
    `settings.dwell` equal ones in a row, all but the two in the middle, where the error of rounding
    is no larger than anywhere.

    >>> np.flatnonzero(~repeated(np.array([0.0] * 10 + [1.0, 1.0, 2.0]))).tolist()
    [4, 5, 10, 11, 12]
    """
    found = np.zeros(len(values), bool)
    if not rounding_step(values, settings):
        return found
    seen = np.flatnonzero(np.isfinite(values))
    edges = np.flatnonzero(np.diff(values[seen])) + 1
    for first, last in zip([0, *edges.tolist()], [*edges.tolist(), len(seen)], strict=True):
        if last - first > settings.dwell:
            found[seen[first:last]] = True
            found[seen[[(first + last) // 2 - 1, (first + last) // 2]]] = False
    return found
