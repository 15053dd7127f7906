"""Residuals and their derivatives in units of the noise, compiled: one pass for both.

Compiled once and kept on disk, which is why this module is imported only where it is used.
"""

from __future__ import annotations

import numpy as np

from pikanid.storage.jit import cached_jit


@cached_jit(error_model="numpy", _nrt=False, nogil=True)
def standardise(y: np.ndarray, sensitivity: np.ndarray, first: int, own: np.ndarray,
                data: np.ndarray, weights: np.ndarray, residual: np.ndarray,
                columns: np.ndarray) -> None:
    """Fill residual (rows,) and Jᵀ (n, rows) from the row `first` on with what a simulation gave.

    Args:
        y, sensitivity: (N,) and (N, A) of one recording.
        own: (A,) the places of its parameters in θ.
        data, weights: (rows,) measurements and 1/σ of all recordings.
    """
    for i in range(y.size):
        residual[first + i] = (y[i] - data[first + i]) * weights[first + i]
    for a in range(own.size):
        column = columns[own[a]]
        for i in range(y.size):
            column[first + i] = sensitivity[i, a] * weights[first + i]
