"""The spectrum of a residual beside that of its noise, and its coherence with inputs.

Averages over segments that do not overlap, each under a Hann window (P. D. Welch, IEEE Trans. Audio
Electroacoust. 15, 1967).  Of m of them a power varies like χ² of 2m degrees of freedom, and the
coherence γ² with an independent input exceeds 1 - α^(1/(m-1)) with probability α (J. S. Bendat and
A. G. Piersol, Random Data, 4th ed. 2010, sec. 9.2.3).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

SEGMENTS = 16  # numerical: averaged, where each still has some samples
SHORTEST = 16  # numerical: samples of a segment, at least
MOVED = 1e-9  # numerical: of an input's largest power, below which its coherence means nothing


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Of one residual.

    Attributes:
        frequency: (F,) [Hz].
        power: (F,) power density of the residual, unit²/Hz.
        noise: (F,) what the noise model expects.
        low, high: Factors of `noise` between which the power of noise lies, at the level asked for.
        coherence: Input -> (F,) γ², NaN where the input has no power.
        limit: Of γ² for an independent input, at the level asked for.
    """

    frequency: np.ndarray
    power: np.ndarray
    noise: np.ndarray
    low: float
    high: float
    coherence: Mapping[str, np.ndarray]
    limit: float


def spectrum(residual: np.ndarray, interval: float, rho: float, inputs: Mapping[str, np.ndarray],
             alpha: float) -> Spectrum | None:
    """Spectrum of a residual (N,) on an even grid; None where it is too short.

    Args:
        residual: (N,), zero where a sample is missing.
        interval: Between samples [s].
        rho: Correlation of neighbours in the noise.
        inputs: Name -> (N,) on the same grid.
        alpha: Probability outside of the bands.
    """
    from scipy.stats import chi2

    n = len(residual)
    length = max(n // SEGMENTS, SHORTEST)
    m = n // length
    if m < 4:
        return None
    window = np.hanning(length + 1)[:-1]
    scale = 2 * interval / (m * float(np.sum(window**2)))

    def lines(x: np.ndarray) -> np.ndarray:
        parts = x[:m * length].reshape(m, length)
        return np.fft.rfft((parts - parts.mean(axis=1, keepdims=True)) * window)

    def averaged(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return np.asarray(scale * np.sum(lines(a).conj() * lines(b), axis=0))

    frequency = np.fft.rfftfreq(length, interval)
    power = averaged(residual, residual).real
    # the mean is taken out of every segment: what is left at zero says nothing
    inner = slice(1, None)
    omega = 2 * np.pi * frequency * interval
    shape = (1 - rho**2) / (1 - 2 * rho * np.cos(omega) + rho**2)
    level = float(np.mean(residual[:m * length] ** 2))
    noise = 2 * level * interval * shape
    found = {}
    for name, u in inputs.items():
        drive = averaged(u, u).real
        there = drive > MOVED * np.max(drive, initial=0.0)
        gamma = np.full(len(drive), np.nan)
        gamma[there] = np.abs(averaged(u, residual)[there]) ** 2 / np.maximum(
            drive * power, 1e-300)[there]
        found[name] = gamma[inner]
    low, high = (float(chi2.ppf(q, 2 * m)) / (2 * m) for q in (alpha / 2, 1 - alpha / 2))
    return Spectrum(frequency[inner], power[inner], noise[inner], low, high, found,
                    1 - alpha ** (1 / (m - 1)))
