"""Linear algebra of the information matrix F = JᵀJ: covariance, what is not identified, shares."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError
from scipy.linalg.lapack import dgeqrf, dgesdd

from pikanid import errors
from pikanid.problem.problem import FreeParameter
from pikanid.uncertainty.settings import USUAL, UncertaintySettings


@dataclass(frozen=True)
class Directions:
    """What a Jacobian of standardised residuals shows of n parameters, k of them estimated.

    Attributes:
        n: Columns of the Jacobian.
        inside: (k,) which of them are estimated, and not held at a bound.
        norms: (k,) norms of these columns.
        seen: (k,) which of these are not zero.
        sizes, axes: (s,) and (s, seen) singular values, falling, and right singular vectors of the
            columns that are seen, scaled to norm 1.
    """

    n: int
    inside: np.ndarray
    norms: np.ndarray
    seen: np.ndarray
    sizes: np.ndarray
    axes: np.ndarray

    @staticmethod
    def of(jacobian: np.ndarray, estimated: np.ndarray) -> Directions:
        """Those of a Jacobian (rows, n) and the parameters that are `estimated` (n,)."""
        from pikanid.optimise.small_matrices import scale_triangle

        n, inside = jacobian.shape[1], np.flatnonzero(estimated)
        # R of J = QR has the same, in as few rows as there are columns; LAPACK directly, as NumPy's
        # wrappers take longer than the rest of this
        J = jacobian if len(inside) == n else jacobian.T[inside].T
        norms, s, vt = np.zeros(len(inside)), np.empty(0), np.empty((0, 0))
        if J.size:
            J = dgeqrf(J)[0][:len(inside)]
            scale_triangle(J, norms)
        seen = norms > 0
        if seen.any():
            _, s, vt, info = dgesdd(J if seen.all() else J[:, seen], full_matrices=False)
            if info:
                raise LinAlgError(f"the singular values did not converge ({info})")
        return Directions(n, inside, norms, seen, s, vt)

    @property
    def covariance(self) -> np.ndarray:
        """(JᵀJ)⁻¹ (n, n), see `covariance`."""
        from pikanid.optimise.small_matrices import inverse_square

        norms = self.norms[self.seen]
        inner = np.empty((norms.size, norms.size))
        inverse_square(self.sizes, self.axes, norms, inner)
        if norms.size == self.n:
            return inner
        result = np.full((self.n, self.n), np.nan)
        result[self.inside[:, None], self.inside] = 0.0
        shown = self.inside[self.seen]
        result[shown[:, None], shown] = inner
        hidden = self.inside[~self.seen]
        result[hidden, hidden] = np.inf
        return result

    def warnings(self, free: Sequence[FreeParameter], settings: UncertaintySettings) -> list[str]:
        """Sentences about what the data do not determine, see `identifiability_warnings`."""
        names = [free[k].label for k in self.inside]
        pairs = list(zip(names, self.seen, strict=True))
        notes = [errors.no_influence(n) for n, seen in pairs if not seen]
        s, last = self.sizes, self.axes[-1:].ravel()
        if len(s) > 1 and s[-1] < s[0] / settings.condition:
            visible = [n for n, seen in pairs if seen]
            weights = last / np.max(np.abs(last))
            parts = [f"{w:+.2g}·{n}"
                     for w, n in zip(weights, visible, strict=True) if abs(w) > 0.1]
            notes.append(errors.unidentifiable(" ".join(parts), s[0] / max(s[-1], 1e-300)))
        return notes


def covariance(jacobian: np.ndarray, estimated: np.ndarray) -> np.ndarray:
    """(JᵀJ)⁻¹ (n, n) of standardised residuals, by singular values of the scaled Jacobian.

    Directions that the data do not see get an infinite variance; parameters that are not
    `estimated` (n,) (held at a bound) get NaN.
    """
    return Directions.of(jacobian, estimated).covariance


def identifiability_warnings(jacobian: np.ndarray, free: Sequence[FreeParameter],
                             estimated: np.ndarray, settings: UncertaintySettings = USUAL
                             ) -> list[str]:
    """Sentences about parameters, or combinations of them, that the data do not determine."""
    return Directions.of(jacobian, estimated).warnings(free, settings)


def undetermined_warnings(free: Sequence[FreeParameter], theta: np.ndarray,
                          covariance: np.ndarray, settings: UncertaintySettings = USUAL
                          ) -> list[str]:
    """Sentences about parameters whose standard errors say that they could be anything.

    Beside a value, and a guess, that are not zero ten times are far; beside an estimate near zero
    alone (an offset, an initial state), which has no size of its own, only hundreds are.
    """
    found = []
    for f, value, variance in zip(free, theta.tolist(), covariance.diagonal().tolist(),
                                  strict=True):
        limit = (settings.far * max(abs(value), abs(f.guess)) if f.guess
                 else settings.far_from_zero * abs(value))
        if 0.0 < variance < math.inf and math.sqrt(variance) > limit > 0:
            found.append(errors.undetermined(f.label, value, math.sqrt(variance)))
    return found


@dataclass(frozen=True)
class Partition:
    """Information about p with the trajectory's coefficients known and with them estimated as well.

    `alone` (n, n) = F_pp, `effective` (n, n) = F_pp - F_pc F_cc⁻¹ F_cp (Schur complement); `shares`
    (n,) how much of each parameter's own information is left.
    """

    alone: np.ndarray
    effective: np.ndarray

    @property
    def shares(self) -> np.ndarray:
        """effective/alone for each parameter with the others known."""
        return np.diag(self.effective) / np.diag(self.alone)


def information_partition(coefficients: np.ndarray, parameters: np.ndarray) -> Partition:
    """Effective Fisher information on p when coefficients c are estimated jointly.

    Args:
        coefficients: ∂r/∂c (rows, K) of the standardised residual [data; √λ physics].
        parameters: ∂r/∂p (rows, n).

    >>> part = information_partition(np.array([[1.0], [0.0]]), np.array([[1.0], [1.0]]))
    >>> part.shares
    array([0.5])
    """
    from scipy.linalg import qr

    alone = parameters.T @ parameters
    q, r, _ = qr(coefficients, mode="economic", pivoting=True)
    sizes = np.abs(np.diag(r))
    # a coefficient that repeats others, or that no residual sees, takes no information of its own
    independent = sizes > max(coefficients.shape) * np.finfo(float).eps * sizes.max(initial=0.0)
    q = q[:, :len(sizes)][:, independent]
    rest = parameters - q @ (q.T @ parameters)
    return Partition(alone, rest.T @ rest)
