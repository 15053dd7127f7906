"""Does a residual depend on a state or an input: its mean over bins of their values."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pikanid.comparison.whitened import White

BINS = 12  # numerical: of a state or an input, each with as many samples


@dataclass(frozen=True, eq=False)
class Dependence:
    """Mean of the residual over bins of a state or an input.

    Attributes:
        name, unit: Of the state or input.
        values: (N,) at the samples.
        centres, means, std: (K,) of the bins, in units of the residual's standard deviation.
    """

    name: str
    unit: str
    values: np.ndarray
    centres: np.ndarray
    means: np.ndarray
    std: np.ndarray


def binned(white: White, name: str, unit: str, x: np.ndarray
            ) -> tuple[Dependence | None, np.ndarray]:
    """Means over bins with as many samples each, and the bins' columns (N, K)."""
    edges = np.unique(np.quantile(x, np.linspace(0, 1, BINS + 1)))
    if len(edges) < 3:
        return None, np.empty((len(x), 0))
    place = np.clip(np.searchsorted(edges, x, "right") - 1, 0, len(edges) - 2)
    columns = (place[:, None] == np.arange(len(edges) - 1)).astype(float)
    columns = columns[:, columns.sum(axis=0) > 0]
    counts = columns.sum(axis=0)
    variance = np.diag(white.covariance(columns)) / counts**2
    return Dependence(name, unit, x, columns.T @ x / counts,
                      columns.T @ white.r / counts / white.scale, np.sqrt(variance)), columns
