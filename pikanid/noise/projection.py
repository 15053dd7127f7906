"""What estimated parameters take up of a residual: projections on and off a Jacobian's columns."""

from __future__ import annotations

import numpy as np

SPANNED = 1e-9  # numerical: of the largest singular value: below it a column repeats others


def orthonormal(J: np.ndarray) -> np.ndarray:
    """Orthonormal columns (N, k) that span what the columns of J (N, n) do.

    >>> orthonormal(np.array([[3.0, 6.0], [4.0, 8.0]])).shape
    (2, 1)
    """
    norms = np.linalg.norm(J, axis=0)
    u, s, _ = np.linalg.svd(J[:, norms > 0] / norms[norms > 0], full_matrices=False)
    return np.asarray(u[:, s > SPANNED * s[0]] if len(s) else u)


def project(J: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Rows (N,) or (N, k) without what the columns of J (N, n) span.

    >>> project(np.array([[1.0], [1.0]]), np.array([2.0, 0.0])).round(12).tolist()
    [1.0, -1.0]
    """
    if J.shape[1] == 0:
        return rows
    q = orthonormal(J)
    spanned = q @ (q.T @ rows)
    return np.asarray(np.subtract(rows, spanned, out=spanned))
