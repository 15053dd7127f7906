"""Descents to a minimum of χ²: where they begin, how finely they simulate, what lies beyond hills.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from operator import lt

import numpy as np

from pikanid.mismatch.catalogue.candidate import Candidate, TangentDirection
from pikanid.mismatch.data.whitened import Whitened, allowance
from pikanid.mismatch.fitting.closest import Closest
from pikanid.mismatch.fitting.lowest import lowest
from pikanid.mismatch.settings.settings import Settings
from pikanid.optimise.levenberg_marquardt import Minimum

TOLERATED = 2.0  # numerical: times the error that steps are chosen for, before they are chosen anew
BACK = (1.0, 0.25, 0.06, 0.01)  # numerical: shares of a first step, tried until χ² falls


@dataclass(frozen=True)
class Start:
    """Where a fit begins: parameter values by name, and those it may fall back towards, where the
    new effects do nothing and χ² is that of the hypothesis which they extend.
    """

    values: Mapping[str, float]
    origin: Mapping[str, float]


def start_from(candidate: Candidate, sign: TangentDirection, amplitude: float,
               values: Mapping[str, float]) -> Start:
    """Where a fit with one more effect begins; `values` are those of the other parameters."""
    start = {**values, **sign.start}
    origin = dict(start)
    if sign.scales and candidate.parameters:
        size = next(iter(sign.start), candidate.parameters[0].name)
        null = next((p.value for p in candidate.parameters if p.name == size), 0.0)
        null = null if sign.null is None else sign.null
        start[size] = null + amplitude * sign.start.get(size, 1.0)
        origin[size] = null
    return Start(start, origin)


def per_row(chi2: float, rows: int) -> float:
    """χ² per row; that of the noise where nothing has been fitted yet."""
    return chi2 / rows if np.isfinite(chi2) else 1.0


def descended(whitened: Whitened, starts: Sequence[Start | Mapping[str, float]],
              closest: Closest, limit: int, beyond: Callable[[float], bool]) -> Minimum | None:
    """The lowest of the minima that the starts lead to."""
    rows = max(whitened.rows, 1)
    fits, budget = whitened.settings.fits, whitened.settings.budget
    gross, closer = fits.gross, fits.closer
    give_up = impatient(beyond, whitened.settings)
    misfit = partial(per_row, rows=rows)
    best: Minimum | None = None
    for start in starts:
        guess = _begun(whitened, start, misfit, closest)
        if guess is None:
            continue
        found = lowest(whitened, guess, budget.several_starts if len(starts) > 1 else limit,
                       give_up)
        if found is not None and (best is None or found.chi2 < best.chi2):
            best = found
    if best is None:
        return None
    coarse = best.chi2
    finer = closest.ask(lambda chi2: misfit(chi2) > gross and coarse < closer * chi2)
    if finer or (not best.converged and not beyond(coarse)):
        if not _finer(whitened, best, closest, lambda chi2: min(coarse / rows, misfit(chi2))):
            return None
        best = lowest(whitened, best.theta, limit, give_up)
    return renewed(whitened, best, closest, limit, beyond)


def renewed(whitened: Whitened, best: Minimum | None, closest: Closest, limit: int,
            beyond: Callable[[float], bool]) -> Minimum | None:
    """A fit that goes on with finer steps where those of its start are too long: a stiff wall met
    in one step takes energy out that a real one gives back.
    """
    misfit = partial(per_row, rows=max(whitened.rows, 1))
    for _ in range(whitened.settings.budget.finer):
        if best is None or beyond(best.chi2):
            break
        worst, coarse = max(whitened.step_errors(best.theta)), best.chi2 / max(whitened.rows, 1)

        def left(chi2: float, coarse: float = coarse) -> float:
            return min(coarse, misfit(chi2))

        if closest.ask(partial(_fine, worst, left)):
            break
        before, simulators = whitened.steps, list(whitened.simulators)
        if not _finer(whitened, best, closest, left):
            return None
        if all(new is old for new, old in zip(whitened.simulators, simulators, strict=True)) and \
                all(new.longest >= old.longest for new, old in zip(
                    whitened.steps, before, strict=True)):
            break
        best = lowest(whitened, best.theta, limit, impatient(beyond, whitened.settings))
    return best


def _finer(whitened: Whitened, best: Minimum, closest: Closest, left: Callable[[float], float]
           ) -> bool:
    """Whether steps are found for a misfit of χ² per row, or else for what the fit leaves itself:
    that one is not closer than it seems.
    """
    own = best.chi2 / max(whitened.rows, 1)
    return any(closest.choose_steps(whitened, best.theta, misfit)
               for misfit in (left, lambda _: own))


def impatient(beyond: Callable[[float], bool], settings: Settings
              ) -> Callable[[int, float, float], bool]:
    """When to give a fit up: what is `beyond` reach after some iterations, and falls slowly."""
    def give_up(count: int, last: float, chi2: float) -> bool:
        return (count >= settings.budget.patience and chi2 > settings.fits.slow * last
                and beyond(chi2))

    return give_up


def _fine(error: float, misfit: Callable[[float], float], chi2: float) -> bool:
    return error <= TOLERATED * allowance(misfit(chi2))


def basin_hopping(whitened: Whitened, best: Minimum, effect: Candidate, limit: int) -> Minimum:
    """The lowest of the minima that steps in one parameter lead to, from the lowest so far; what
    acts once rings alike half a period earlier or later, the other way round.
    """
    problem = whitened.problem
    first, *more = ([k for k, f in enumerate(problem.free) if f.name == p.name]
                    for p in effect.parameters)
    steps = [(share, 0.0) for share in effect.other_minima]
    if effect.absent and effect.site.rate:
        steps += [(-1.0, side * np.pi / effect.site.rate) for side in (-1, 1)]
    settings = whitened.settings
    for _ in range(settings.budget.hops):
        found = []
        for share, later in steps:
            theta = best.theta.copy()
            theta[first] *= share
            if later:
                theta[more[0]] += later
            found.append(lowest(whitened, theta, settings.budget.several_starts,
                                impatient(partial(lt, best.chi2), settings)))
        lower = min((m for m in found if m is not None), key=lambda m: m.chi2, default=best)
        if lower.chi2 > best.chi2 - settings.fits.lower_hill:
            break
        left, best = best.chi2 - whitened.rows, lower
        if not best.converged:
            best = lowest(whitened, best.theta, limit) or best
        if best.chi2 > whitened.rows + (1 - settings.fits.hop_again) * left > whitened.rows:
            break  # it crawls along a valley far above an explanation
    return best


def _begun(whitened: Whitened, start: Start | Mapping[str, float],
           misfit: Callable[[float], float], closest: Closest) -> np.ndarray | None:
    """θ (n,) to begin at: the start, or nearer to its origin if χ² is smaller there.

    A linear step out of a large misfit goes too far: the phase of an oscillation bends.  A start
    that has no origin and a χ² far beyond the closest, seen at a glance, is not worth finer steps.
    """
    goal, fits = place(whitened, start), whitened.settings.fits
    home = place(whitened, start.origin) if isinstance(start, Start) else goal
    if not np.any(goal != home):
        if isinstance(start, Start):
            if not closest.choose_steps(
                    whitened, goal, lambda chi2: max(misfit(chi2), fits.glance)):
                return None
            seen = whitened.chi2(goal)
            if not closest.ask(lambda chi2: seen <= fits.wild * (chi2 + max(whitened.rows, 1))):
                return None
        return goal if closest.choose_steps(whitened, goal, misfit) else None
    best, least = None, np.inf
    for share in BACK:
        theta = home + share * (goal - home)
        if not closest.choose_steps(whitened, theta, misfit):
            continue
        size = whitened.chi2(theta)
        if share < 1 and size > least:
            break
        if size < least:
            best, least = theta, size
        if least < whitened.chi2(home) and closest.ask(lambda chi2: misfit(chi2) < fits.gross):
            break
    return best


def place(whitened: Whitened, start: Start | Mapping[str, float]) -> np.ndarray:
    """θ (n,) of a start, within the bounds."""
    named, problem = start.values if isinstance(start, Start) else start, whitened.problem
    return np.clip([named.get(f.label, named.get(f.name, f.guess)) for f in problem.free],
                   problem.lower, problem.upper)
