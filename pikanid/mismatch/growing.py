"""Fits over longer and longer beginnings of records.

What hits a wall again and again depends on every earlier impact: over a whole record χ² is rough
wherever the parameters are not those that are sought.  The first impact alone is smooth in them,
and what it tells leads to the next one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from pikanid.mismatch.candidate import Candidate
from pikanid.mismatch.descent import GLANCE
from pikanid.mismatch.least_squares import Evaluate, Minimum, minimise
from pikanid.mismatch.whitened import Whitened

SHARES = (0.08, 0.12, 0.17, 0.24, 0.34, 0.48, 0.7)  # of all motion, that beginnings hold
FEWEST = 10  # rows a parameter that are worth a fit
LOST = 3.0  # χ² per row from which on a beginning counts as unexplained
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
    found, level = None, 1.0
    enough = FEWEST * len(theta) / max(whitened.rows, 1)
    for share in (*(share for share in _beginnings(whitened) if share > enough), 1.0):
        part = Whitened(problem.model, whitened.records.beginning(int(share * whitened.rows))
                        ) if share < 1 else whitened
        found = None
        for begun in (theta, None):
            if begun is None:  # what is first hit now may lie elsewhere altogether
                begun = _level(part, effects, theta)
            for start in _about(part, effects, begun):
                other = minimise(besides(part, known), start, problem.lower, problem.upper)
                found = min((m for m in (found, other) if m), key=lambda m: m.chi2, default=None)
                if found and not rough(found.chi2 / (level if share < 1 else 1.0), part.rows,
                                       effects):
                    break
            if found and not lost(found.chi2, part.rows):
                break
        if found is None or lost(found.chi2, part.rows):
            return None
        # noise that was taken for too little is no reason to look again
        theta, level = found.theta, max(1.0, found.chi2 / part.rows)
    return found


def _beginnings(whitened: Whitened) -> list[float]:
    """How much of the records to fit at a time: where nothing moves, nothing is hit or learnt."""
    samples = [s for e in whitened.problem.experiments for s in e.samples]
    place = np.concatenate([np.linspace(0, 1, len(s.t)) for s in samples])
    moved = np.concatenate([(s.y - np.median(s.y)) ** 2 for s in samples])
    order = np.argsort(place, kind="stable")
    so_far = np.cumsum(moved[order])
    return [float(place[order][np.searchsorted(so_far, share * so_far[-1])]) for share in SHARES]


def _about(part: Whitened, effects: Sequence[Candidate], theta: np.ndarray
           ) -> Iterator[np.ndarray]:
    """Where a fit may begin: here and over the hills; nowhere if that cannot be simulated."""
    # far off, every step of an impact that comes too early would have to be followed
    if not (part.choose_steps(theta) or part.choose_steps(theta, misfit=GLANCE)):
        return
    yield theta
    for effect in effects:
        for factor in effect.hills:
            beside = theta.copy()
            beside[_place(part, effect.parameters[0].name)] *= factor
            yield beside


def _level(part: Whitened, effects: Sequence[Candidate], theta: np.ndarray) -> np.ndarray:
    """The levels of the effects that leave the least, one effect after the other."""
    for effect in effects:
        at = [theta]
        for values in effect.levels:
            at.append(theta.copy())
            at[-1][[_place(part, name) for name in values]] = list(values.values())
        if part.choose_steps(at[len(at) // 2], misfit=GLANCE):
            theta = min(at, key=part.chi2)
    return theta


def _place(whitened: Whitened, name: str) -> int:
    return [f.name for f in whitened.problem.free].index(name)
