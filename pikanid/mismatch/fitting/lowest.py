"""The minimum of χ² that a start leads to."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pikanid.mismatch.data.whitened import Whitened
from pikanid.optimise.levenberg_marquardt import GiveUp, Minimum, minimise

Known = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


def nothing(theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """No rows besides those of the records."""
    return np.empty(0), np.empty((0, len(theta)))


def never(count: int, last: float, chi2: float) -> bool:
    """A fit that is carried through."""
    return False


def lowest(whitened: Whitened, start: np.ndarray, limit: int, give_up: GiveUp = never,
           lower: np.ndarray | None = None, upper: np.ndarray | None = None,
           besides: Known = nothing) -> Minimum | None:
    """Minimise χ² of records; None where the start cannot be run.

    Args:
        whitened: Model and records.
        start: (n,) where to begin.
        limit: Iterations.
        give_up: Asked after each one.
        lower, upper: (n,) bounds in place of the model's.
        besides: Rows (k,) with their Jacobian (k, n) that count besides, whatever the records.
    """
    problem = whitened.problem

    def evaluate(theta: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        at, rows = whitened.residual(theta), besides(theta)
        return at and (np.concatenate([at[0], rows[0]]), np.vstack([at[1], rows[1]]))

    def glance(theta: np.ndarray) -> np.ndarray | None:
        at = whitened.rows_alone(theta)
        return at if at is None else np.concatenate([at, besides(theta)[0]])

    alone = besides is nothing
    return minimise(whitened.residual if alone else evaluate, start,
                    problem.lower if lower is None else lower,
                    problem.upper if upper is None else upper, limit, give_up=give_up,
                    sizes=whitened.sizes, glance=whitened.rows_alone if alone else glance)
