"""From the covariance of parameters to a band around what is simulated with them."""

from __future__ import annotations

import numpy as np


def propagated(sensitivity: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Standard deviation √diag(J C Jᵀ) (N,) of outputs, to first order, from that of parameters.

    Args:
        sensitivity: J (N, n).
        covariance: C (n, n).

    >>> propagated(np.array([[1.0, 0.0], [3.0, 4.0]]), np.eye(2)).tolist()
    [1.0, 5.0]
    """
    from pikanid.optimise.small_matrices import deviations

    spread = np.empty(len(sensitivity))
    deviations(np.ascontiguousarray(sensitivity, float), finite(covariance), spread)
    return spread


def finite(covariance: np.ndarray) -> np.ndarray:
    """C (n, n), in which what has no standard error (NaN: it ended at a bound; infinite: nothing
    shows it) counts as known.

    >>> finite(np.array([[np.inf, 0.5], [0.5, 2.0]])).tolist()
    [[0.0, 0.0], [0.0, 2.0]]
    """
    C = np.array(covariance)
    unknown = ~np.isfinite(C.diagonal())
    if unknown.any():
        C[unknown] = C[:, unknown] = 0.0
    return C
