"""Factors of symmetric matrices, banded or small: Cholesky's where they are positive definite.

Straight from LAPACK or compiled here: SciPy's and NumPy's own functions check, convert and
dispatch, which takes longer than the algebra on a short recording.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import LinAlgError
from scipy.linalg.lapack import dpbtrf, dposv, dsyev

from pikanid.approximators import Array


def factor_band(band: Array) -> Array:
    """Lower Cholesky factor (kd + 1, n) of a matrix in lower band form (kd + 1, n).

    Raises:
        LinAlgError: If the matrix is not positive definite.
    """
    factor, info = dpbtrf(band, lower=1)
    if info:
        raise LinAlgError(f"the leading minor of order {info} is not positive definite")
    return factor


def solve_band(factor: Array, columns: Array) -> Array:
    """A⁻¹ of columns (n, q), A given by its factor.

    >>> solve_band(factor_band(np.array([[4.0, 5.0], [2.0, 0.0]])), np.array([[8.0], [12.0]]))
    array([[1.],
           [2.]])
    """
    from pikanid.optimise.banded_solves import substitute

    solved = np.array(columns, dtype=float, order="C")
    substitute(factor, solved)
    return solved


def solve_positive(matrix: Array, columns: Array) -> Array:
    """A⁻¹ of columns (n,) or (n, q), A a small dense matrix.

    Raises:
        LinAlgError: If the matrix is not positive definite.
    """
    _, solved, info = dposv(matrix, columns, lower=1)
    if info:
        raise LinAlgError(f"the leading minor of order {info} is not positive definite")
    return solved


def eigen(matrix: Array) -> tuple[Array, Array]:
    """Eigenvalues (n,), ascending, and eigenvectors (n, n), as columns, of a small matrix.

    Raises:
        LinAlgError: If the iteration does not converge.
    """
    values, vectors, info = dsyev(matrix, lower=1)
    if info:
        raise LinAlgError(f"the eigenvalues did not converge ({info})")
    return values, vectors
