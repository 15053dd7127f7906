"""Noise of a measurement: white or coloured, with outliers or without."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
TAILS = 12.0  # numerical: standard deviations of the widest part that an integral covers
POINTS = 20_001  # numerical: of that integral


@dataclass(frozen=True)
class Noise:
    """How an output is spoilt.

    Attributes:
        sigma: Standard deviation of the Gaussian part, in the unit of the output.
        correlation: Between neighbouring samples of the excitation's clock: AR(1).
        outliers: Share of samples with a gross error besides.
        size: Standard deviation of a gross error, in sigmas.

    >>> Noise(0.1).drawn(np.random.default_rng(0), 3).shape
    (3,)
    """

    sigma: float = 0.0
    correlation: float = 0.0
    outliers: float = 0.0
    size: float = 10.0

    def drawn(self, rng: np.random.Generator, n: int) -> Array:
        """(n,) errors; white ones are those of `pikanid.simulate` from the same generator."""
        if self.sigma == 0.0:
            return np.zeros(n)
        error = rng.normal(0.0, self.sigma, n)
        if self.correlation:
            from scipy.signal import lfilter

            error[1:] *= np.sqrt(1.0 - self.correlation**2)
            error = lfilter([1.0], [1.0, -self.correlation], error)
        if self.outliers:
            hit = rng.random(n) < self.outliers
            error = error + hit * rng.normal(0.0, self.size * self.sigma, n)
        return np.asarray(error)

    def whitened(self, jacobian: Array, stride: int) -> Array:
        """J (n, p) in units of the noise, so that JᵀJ is the Fisher information.

        Args:
            jacobian: Derivatives of the samples that are kept, every `stride`-th.
            stride: Of these.
        """
        scaled = jacobian / self.sigma * np.sqrt(self.information)
        rho = self.correlation**stride
        if rho == 0.0:
            return scaled
        return np.concatenate([scaled[:1], (scaled[1:] - rho * scaled[:-1]) / np.sqrt(1 - rho**2)])

    @property
    def information(self) -> float:
        """Fisher information about the place of one sample, 1 without outliers.

        ∫ p'²/p of the mixture (Lehmann and Casella, Theory of Point Estimation, 2.5).
        """
        if not self.outliers:
            return 1.0
        wide = float(np.hypot(1.0, self.size))
        x = np.linspace(-TAILS * wide, TAILS * wide, POINTS)
        parts = [(share, s, np.exp(-0.5 * (x / s) ** 2) / (s * np.sqrt(2 * pi)))
                 for share, s in ((1 - self.outliers, 1.0), (self.outliers, wide))]
        density = sum(share * p for share, _, p in parts)
        slope = sum(-share * x / s**2 * p for share, s, p in parts)
        return float(np.trapezoid(slope**2 / np.maximum(density, 1e-300), x))
