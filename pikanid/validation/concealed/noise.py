"""Measurement noise of five classes; none of them is physics that a model leaves out."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass

import numpy as np

from pikanid.validation.concealed.arrays import Array

CLASSES = ("white", "ar", "outliers", "dropouts", "quantised")


@dataclass(frozen=True)
class Noise:
    """How the angle is spoilt.

    Attributes:
        kind: One of CLASSES.
        sigma: Standard deviation of the Gaussian part [rad].
        rho: Correlation between neighbouring samples, AR(1).
        outlier_share: Share of samples with a gross error of ten times sigma.
        dropout_share: Share of samples missing, in gaps.
        step: Of quantisation [rad].

    >>> y = Noise("white", 1e-3).spoilt(np.zeros(4), np.random.default_rng(0))
    >>> y.shape
    (4,)
    """

    kind: str
    sigma: float
    rho: float = 0.0
    outlier_share: float = 0.0
    dropout_share: float = 0.0
    step: float = 0.0

    @property
    def effective_sigma(self) -> float:
        """With the error of quantisation, step/√12 [rad]."""
        return math.hypot(self.sigma, self.step / math.sqrt(12))

    def spoilt(self, y: Array, rng: np.random.Generator) -> Array:
        """y (N,) as it would be recorded, NaN where a sample is missing."""
        n = len(y)
        white = rng.standard_normal(n)
        noise = white
        if self.rho:
            noise = np.empty(n)
            noise[0] = white[0]
            for k in range(1, n):
                noise[k] = self.rho * noise[k - 1] + math.sqrt(1 - self.rho**2) * white[k]
        out = y + self.sigma * noise
        hit = rng.random(n) < self.outlier_share
        out[hit] += 10 * self.sigma * rng.standard_normal(int(hit.sum()))
        if self.step:
            out = np.round(out / self.step) * self.step
        out[self._missing(n, rng)] = np.nan
        return out

    def _missing(self, n: int, rng: np.random.Generator) -> Array:
        gone = np.zeros(n, dtype=bool)
        while gone.mean() < self.dropout_share:
            start, length = int(rng.integers(1, n)), int(rng.geometric(0.2))
            gone[start : start + length] = True
        return gone

    def whitened(self, r: Array) -> Array:
        """r (N,) or (N, p) in units of the noise, decorrelated: the sum of squares is χ²."""
        z = r / self.effective_sigma
        if self.rho:
            z = np.concatenate([z[:1], (z[1:] - self.rho * z[:-1]) / math.sqrt(1 - self.rho**2)])
        # Lost samples tell nothing; which ones are lost matters less than how many.
        return z * math.sqrt((1 - self.outlier_share) * (1 - self.dropout_share))

    def to_dict(self) -> dict[str, float | str]:
        """For the truth file."""
        return {key: value for key, value in asdict(self).items()}


def drawn(rng: np.random.Generator, sigma: float) -> Noise:
    """A noise model of a random class.

    >>> drawn(np.random.default_rng(1), 1e-3).kind in CLASSES
    True
    """
    kind = str(rng.choice(CLASSES))
    rho = round(float(rng.uniform(0.3, 0.7)), 3) if kind == "ar" else 0.0
    outliers = round(float(rng.uniform(0.005, 0.03)), 4) if kind == "outliers" else 0.0
    dropouts = round(float(rng.uniform(0.02, 0.10)), 4) if kind == "dropouts" else 0.0
    step = float(f"{sigma * rng.uniform(0.5, 2.0):.4g}") if kind == "quantised" else 0.0
    return Noise(kind, sigma, rho, outliers, dropouts, step)
