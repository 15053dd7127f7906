"""Fits over longer and longer beginnings of records.

What hits a wall again and again depends on every earlier impact: over a whole record χ² is rough
wherever the parameters are not those that are sought.  The first impact alone is smooth in them,
and what it tells leads to the next one.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from pikanid.mismatch.candidate import Candidate
from pikanid.mismatch.least_squares import Evaluate, Minimum, minimise
from pikanid.mismatch.whitened import Whitened

SHARES = (0.08, 0.12, 0.17, 0.24, 0.34, 0.48, 0.7)  # of the records
FEWEST = 10  # rows a parameter that are worth a fit
LOST = 3.0  # χ² per row from which on a beginning counts as unexplained
COARSELY = 1e4  # χ² per row that steps may be chosen for where the noise would need too fine ones
PLENTY = 3.0  # standard deviations of χ² beyond its mean that make a misfit

Known = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


def rough(chi2: float, rows: int, effects: Sequence[Candidate]) -> bool:
    """Whether a fit that leaves χ² of so many rows may have missed impacts."""
    return hits(effects) and chi2 > rows + PLENTY * float(np.sqrt(2 * rows))


def hits(effects: Sequence[Candidate]) -> bool:
    """Whether a motion may hit something: such laws begin at levels, no first step leads there."""
    return any(e.levels for e in effects)


def lost(chi2: float, rows: int) -> bool:
    """Whether a fit that leaves χ² of so many rows explains nothing."""
    return chi2 > LOST * rows


def nothing(theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """No rows besides those of the records."""
    return np.empty(0), np.empty((0, len(theta)))


def besides(whitened: Whitened, known: Known) -> Evaluate:
    """The residual of records with what is known besides below it."""
    def evaluate(theta: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        at, rows = whitened.residual(theta), known(theta)
        return at and (np.concatenate([at[0], rows[0]]), np.vstack([at[1], rows[1]]))

    return evaluate


def grown(whitened: Whitened, effects: Sequence[Candidate], theta: np.ndarray,
          known: Known = nothing) -> Minimum | None:
    """Minimise χ² of longer and longer beginnings, and of the whole in the end.

    Args:
        whitened: Of the whole records.
        effects: That it holds.
        theta: (n,) where the first fit begins.
        known: Rows (k,) with their Jacobian (k, n) that count besides, whatever the records.

    Returns:
        The fit of the whole; None where a beginning cannot be simulated, or not be explained.
    """
    problem = whitened.problem
    names = [f.name for f in problem.free]
    hills = [(names.index(e.parameters[0].name), share) for e in effects for share in e.hills]

    def fit(of: Whitened, start: np.ndarray) -> Minimum | None:
        return minimise(besides(of, known), start, problem.lower, problem.upper)

    found, level = None, 1.0
    enough = FEWEST * len(theta) / max(whitened.rows, 1)
    for share in (*(share for share in SHARES if share > enough), 1.0):
        part = Whitened(problem.model, whitened.records.beginning(int(share * whitened.rows))
                        ) if share < 1 else whitened
        # far off, every step of an impact that comes too early would have to be followed
        exact = part.choose_steps(theta) or part.choose_steps(theta, misfit=COARSELY)
        found = fit(part, theta) if exact else None
        if found is None:
            return None
        for at, factor in hills:
            if not rough(found.chi2 / (level if share < 1 else 1.0), part.rows, effects):
                break
            beside = theta.copy()
            beside[at] *= factor
            found = min(found, fit(part, beside) or found, key=lambda m: m.chi2)
        if lost(found.chi2, part.rows):
            return None
        # noise that was taken for too little is no reason to look again
        theta, level = found.theta, max(1.0, found.chi2 / part.rows)
    return found
