"""Fits over longer and longer beginnings of records.

What hits a wall again and again depends on every earlier impact: over a whole record χ² is rough
wherever the parameters are not those that are sought.  The first impact alone is smooth in them,
and what it tells leads to the next one.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.data.whitened import Whitened
from pikanid.mismatch.fitting.lowest import Known, lowest, nothing
from pikanid.mismatch.settings.settings import Settings
from pikanid.optimise.levenberg_marquardt import Minimum

# of all motion, that beginnings hold: each half as much again as the one before
SHARES = (0.08, 0.12, 0.17, 0.24, 0.34, 0.48, 0.7)  # numerical: where a path of fits leads along

def rough(chi2: float, rows: int, effects: Sequence[Candidate], settings: Settings) -> bool:
    """Whether a fit that leaves χ² of so many rows may have missed impacts."""
    return hits(effects) and chi2 > rows + settings.fits.rough * float(np.sqrt(2 * rows))


def hits(effects: Sequence[Candidate]) -> bool:
    """Whether a motion may hit something: such laws begin at levels, no first step leads there."""
    return any(e.levels for e in effects)


def lost(chi2: float, rows: int, settings: Settings) -> bool:
    """Whether a fit that leaves χ² of so many rows explains nothing."""
    return chi2 > settings.fits.lost * rows


def progressive_horizon(whitened: Whitened, effects: Sequence[Candidate], theta: np.ndarray,
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
    problem, settings = whitened.problem, whitened.settings
    found, level = None, 1.0
    enough = settings.fits.rows_a_parameter * len(theta) / max(whitened.rows, 1)
    for share in (*(share for share in _beginnings(whitened) if share > enough), 1.0):
        part = Whitened(problem.model, whitened.records.beginning(int(share * whitened.rows))
                        ) if share < 1 else whitened
        found = _fitted(part, effects, theta, known, level if share < 1 else 1.0)
        if found is None or lost(found.chi2, part.rows, settings):
            return None
        # noise that was taken for too little is no reason to look again
        theta, level = found.theta, max(1.0, found.chi2 / part.rows)
    return found


def _fitted(part: Whitened, effects: Sequence[Candidate], theta: np.ndarray, known: Known,
            level: float) -> Minimum | None:
    """The fit of a beginning: from where the last one ended or, if that leaves more than noise of a
    `level`, from where the effects leave the least, and over the hills about that.
    """
    settings, found = part.settings, None

    def explained(start: np.ndarray, limit: int = settings.budget.iterations) -> bool:
        nonlocal found
        other = lowest(part, start, limit, besides=known)
        found = min((m for m in (found, other) if m), key=lambda m: m.chi2, default=None)
        return found is not None and not rough(
            found.chi2 / level, part.rows, effects, settings)

    if _runs(part, theta) and explained(theta):
        return found
    theta = _level(part, effects, theta)
    if not _runs(part, theta) or explained(theta) or (
            found is not None and found.chi2 > settings.fits.hopeless * part.rows):
        return found
    for effect in effects:
        for factor in effect.other_minima:
            beside = theta.copy()
            beside[_place(part, effect.parameters[0].name)] *= factor
            if explained(beside, settings.budget.hop_iterations):
                return found
    return found


def _runs(part: Whitened, theta: np.ndarray) -> bool:
    # far off, every step of an impact that comes too early would have to be followed
    return part.choose_steps(theta) or part.choose_steps(
        theta, misfit=part.settings.fits.glance)


def _beginnings(whitened: Whitened) -> list[float]:
    """How much of the records to fit at a time: where nothing moves, nothing is hit or learnt."""
    samples = [s for e in whitened.problem.experiments for s in e.samples]
    place = np.concatenate([np.linspace(0, 1, len(s.t)) for s in samples])
    squares = [(s.y - np.median(s.y)) ** 2 for s in samples]
    # of each output as a share of all that it moves: outputs have units of their own
    whole = {o: sum(float(q.sum()) for s, q in zip(samples, squares, strict=True) if s.output == o)
             for o in {s.output for s in samples}}
    moved = np.concatenate([q / max(whole[s.output], 1e-300)
                            for s, q in zip(samples, squares, strict=True)])
    order = np.argsort(place, kind="stable")
    so_far = np.cumsum(moved[order])
    return [float(place[order][np.searchsorted(so_far, share * so_far[-1])]) for share in SHARES]


def _level(part: Whitened, effects: Sequence[Candidate], theta: np.ndarray) -> np.ndarray:
    """The levels of the effects that leave the least, one effect after the other."""
    for effect in effects:
        at = [theta]
        for values in effect.levels:
            at.append(theta.copy())
            at[-1][[_place(part, name) for name in values]] = list(values.values())
        if part.choose_steps(at[len(at) // 2], misfit=part.settings.fits.glance):
            theta = min(at, key=part.chi2)
    return theta


def _place(whitened: Whitened, name: str) -> int:
    return [f.name for f in whitened.problem.free].index(name)
