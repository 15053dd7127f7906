"""Trajectory approximators x̂_α(t) of Eq. (2): what may stand in for the state over time.

Two promises are asked of an approximator, and nothing else: its time derivatives as a function of
its coefficients, and how these change with the coefficients.  A *linear* approximator (B-spline,
shallow KAN with w_b = 0; Eq. (4)) is its basis alone, and its basis is local: every row of
``basis(t)`` has the same number of consecutive nonzeros, which makes Gauss-Newton banded.
"""

from __future__ import annotations

from typing import Any, Protocol, TypeGuard, runtime_checkable

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

Array = NDArray[np.float64]


@runtime_checkable
class Approximator(Protocol):
    """A scalar function of time with adjustable coefficients (n,)."""

    @property
    def n_coefficients(self) -> int:
        """Number of adjustable coefficients."""

    def values(self, t: Array, coefficients: Array, derivative: int = 0) -> Array:
        """The ``derivative``-th time derivative at ``t`` (M,), shape (M,)."""

    def jacobian(self, t: Array, coefficients: Array,
                 derivative: int = 0) -> Array | sparse.csr_array:
        """Derivative of ``values`` with respect to the coefficients, shape (M, n)."""


@runtime_checkable
class LinearApproximator(Protocol):
    """x̂(t) = Σ c_k B_k(t) (Eq. 4) with a local basis."""

    @property
    def n_basis(self) -> int:
        """Number of basis functions."""

    @property
    def n_coefficients(self) -> int:
        """Number of adjustable coefficients: as many."""

    def basis(self, t: Array, derivative: int = 0) -> sparse.csr_array:
        """Basis (M, n_basis): equally many consecutive nonzeros a row, one-sided from the right."""

    def local(self, t: Array, derivative: int = 0) -> tuple[NDArray[np.int64], Array]:
        """The same as first column of each row (M,) and values (M, width)."""


def is_linear(approximator: Any) -> TypeGuard[LinearApproximator]:
    """Whether an approximator is its basis; as `isinstance` says, which takes 20 µs to say it."""
    return hasattr(approximator, "basis")


def local_matrix(first: NDArray[np.int64], values: Array, n: int) -> sparse.csr_array:
    """A local basis matrix (M, n) from the first column of each row (M,) and values (M, width).

    >>> local_matrix(np.array([0, 1]), np.array([[1.0, 2.0], [3.0, 4.0]]), 3).toarray()
    array([[1., 2., 0.],
           [0., 3., 4.]])
    """
    rows, width = values.shape
    columns = (first[:, None] + np.arange(width)).ravel()
    pointers = width * np.arange(rows + 1)
    if max(rows * width, n) < 2**31:
        columns, pointers = columns.astype(np.int32), pointers.astype(np.int32)
    return sparse.csr_array((values.ravel(), columns, pointers), shape=(rows, n))
