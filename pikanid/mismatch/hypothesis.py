"""One complete explanation of a recording: the nominal model with some effects added, refitted."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from operator import lt

import numpy as np

from pikanid.mismatch.candidate import SYMBOLIC, Candidate, Sign
from pikanid.mismatch.closest import Closest
from pikanid.mismatch.growing import grown, hits, lost
from pikanid.mismatch.least_squares import Minimum, minimise
from pikanid.mismatch.whitened import CERTAIN, GROSS, Records, Whitened
from pikanid.model import Model

LIMIT = 30  # iterations of a fit
HURRIED = 12  # and of one among gross misfits
FAR = 2.0  # times the closest χ², and that of the noise: fits above both together are given up
WILD = 1000.0  # times both, for a start
GLANCE = 1e4  # χ² per row that is good enough to see that
HILLS = 4  # times that a minimum is left over a hill, if that leads lower
COARSE = 5  # iterations that each of several starts gets before the best one goes on


@dataclass(frozen=True)
class Hypothesis:
    """Effects, the model that holds them, and its fit.

    `penalty` is what the effects must gain in χ²: the number of parameters times ln N, and twice
    the logarithm of how many effects there are to choose from, for each (extended Bayesian
    information criterion: J. Chen and Z. Chen, Biometrika 95, 2008).
    """

    effects: tuple[Candidate, ...]
    model: Model
    whitened: Whitened
    minimum: Minimum
    penalty: float

    @property
    def key(self) -> frozenset[str]:
        """The effects' keys."""
        return frozenset(e.key for e in self.effects)

    @property
    def fit(self) -> tuple[frozenset[str], float]:
        """Identifies this fit of the effects: another one may find a lower χ²."""
        return self.key, self.minimum.chi2

    @property
    def known(self) -> bool:
        """Whether all effects are entries of the catalogue."""
        return all(e.known for e in self.effects)

    @property
    def symbolic(self) -> bool:
        """Whether an effect is a formula that was read, not an entry of the catalogue."""
        return any(e.ids[0].startswith(SYMBOLIC) for e in self.effects)

    @property
    def far(self) -> bool:
        """Whether so much is left that no test is needed to see it."""
        return self.minimum.chi2 > CERTAIN * max(self.whitened.rows, 1)

    @property
    def pinned(self) -> bool:
        """Whether an estimate lies at a bound."""
        problem, theta = self.whitened.problem, self.minimum.theta
        near = 1e-6 * np.maximum(np.abs(theta), 1e-12)
        return bool(np.any((theta - problem.lower < near) | (problem.upper - theta < near)))

    @property
    def noise(self) -> float:
        """Standard deviation of what is left, in units of the noise that was assumed."""
        return (self.minimum.chi2 / max(self.whitened.rows - len(self.minimum.theta), 1)) ** 0.5

    @property
    def values(self) -> dict[str, float]:
        """Estimates by name; the first recording's where each has its own."""
        both = list(zip(self.whitened.problem.free, self.minimum.theta, strict=True))
        return {f.name: float(v) for f, v in reversed(both)}

    @property
    def point(self) -> dict[str, float]:
        """Where another fit may begin: estimates by name, and by label for every recording."""
        both = zip(self.whitened.problem.free, self.minimum.theta, strict=True)
        return {**self.values, **{f.label: float(v) for f, v in both}}

    @property
    def covariance(self) -> np.ndarray:
        """(n, n) of the estimates; infinite variances become very large ones."""
        J = self.minimum.J
        norms = np.maximum(np.linalg.norm(J, axis=0), 1e-100)
        _, s, vt = np.linalg.svd(J / norms, full_matrices=False)
        inverse = vt.T / np.maximum(s, 1e-9 * s[0] if len(s) else 1.0) ** 2 @ vt
        return np.asarray(inverse / np.outer(norms, norms))

    @property
    def std(self) -> dict[str, float]:
        """Standard errors by name."""
        free = self.whitened.problem.free
        return {f.name: float(v) for f, v in zip(free, np.sqrt(np.diag(self.covariance)),
                                                 strict=True)}

    def score(self, scale: float = 1.0) -> float:
        """The criterion: smaller is better; `scale` divides χ² where noise is underestimated."""
        return self.minimum.chi2 / scale + self.penalty


def extended(nominal: Model, effects: Sequence[Candidate]) -> Model:
    """The nominal model with all effects."""
    model = nominal
    for effect in effects:
        model = effect.applied(model)
    return model


@dataclass(frozen=True)
class Start:
    """Where a fit begins: parameter values by name, and those it may fall back towards, where the
    new effects do nothing and χ² is that of the hypothesis which they extend.
    """

    values: Mapping[str, float]
    origin: Mapping[str, float]


def fitted(nominal: Model, effects: Sequence[Candidate], records: Records,
           starts: Sequence[Start | Mapping[str, float]], choices: int,
           closest: Closest | None = None, settled: frozenset[str] = frozenset()
           ) -> Hypothesis | None:
    """Refit the nominal model with effects added.

    Args:
        nominal: Without effects.
        effects: To add.
        records: To fit.
        starts: From where; parameters not named begin at the model's values.
        choices: Number of effects to choose from.
        closest: χ² of the closest fit so far: one that stays far above is not carried through, and
            simulations need not be much more accurate than it is.
        settled: Keys of effects that need not be looked for beyond the hills about the start.

    Returns:
        The best local fit, or None where none of the starts can be simulated.
    """
    model = extended(nominal, effects)
    whitened = Whitened(model, records)
    rows = max(whitened.rows, 1)
    closest = closest or Closest()
    limit = closest.ask(lambda chi2: LIMIT if _misfit(chi2, rows) < GROSS else HURRIED)

    def beyond(size: float) -> bool:
        return closest.ask(lambda chi2: size > FAR * (chi2 + rows))

    best = _descended(whitened, starts, closest, limit, beyond)
    hilly = [e for e in effects if e.hills and e.key not in settled]
    astray = hits(hilly) and bool(starts) and (
        best is None or (lost(best.chi2, rows) and not beyond(best.chi2)))
    whole = grown(whitened, hilly, _place(whitened, starts[0])) if astray else None
    if whole is not None and (best is None or whole.chi2 < best.chi2):
        best = whole
    elif best is not None and not beyond(best.chi2):
        for effect in hilly:
            best = _over_hills(whitened, best, effect, limit)
    if best is None:
        return None
    penalty = _penalty(effects, whitened.rows, choices)
    return Hypothesis(tuple(effects), model, whitened, best, penalty)


def _misfit(chi2: float, rows: int) -> float:
    return chi2 / rows if np.isfinite(chi2) else 1.0


def _descended(whitened: Whitened, starts: Sequence[Start | Mapping[str, float]],
               closest: Closest, limit: int, beyond: Callable[[float], bool]) -> Minimum | None:
    """The lowest of the minima that the starts lead to."""
    problem, rows = whitened.problem, max(whitened.rows, 1)
    misfit = partial(_misfit, rows=rows)
    best: Minimum | None = None
    for start in starts:
        guess = _begun(whitened, start, misfit, closest)
        if guess is None:
            continue
        found = minimise(whitened.residual, guess, problem.lower, problem.upper,
                         COARSE if len(starts) > 1 else limit, beyond=beyond)
        if found is not None and (best is None or found.chi2 < best.chi2):
            best = found
    if best is None:
        return None
    coarse = best.chi2
    finer = closest.ask(lambda chi2: misfit(chi2) > GROSS and coarse < 0.25 * chi2)
    if finer or (not best.converged and not beyond(coarse)):
        if not closest.choose_steps(whitened, best.theta,
                                    lambda chi2: min(coarse / rows, misfit(chi2))):
            return None
        best = minimise(whitened.residual, best.theta, problem.lower, problem.upper, limit,
                        beyond=beyond)
    return best


def _over_hills(whitened: Whitened, best: Minimum, effect: Candidate, limit: int) -> Minimum:
    """The lowest of the minima that steps in one parameter lead to, from the lowest so far."""
    problem = whitened.problem
    at = [k for k, f in enumerate(problem.free) if f.name == effect.parameters[0].name]
    for _ in range(HILLS):
        found = []
        for share in effect.hills:
            theta = best.theta.copy()
            theta[at] *= share
            found.append(minimise(whitened.residual, theta, problem.lower, problem.upper, COARSE,
                                  beyond=partial(lt, best.chi2)))
        lower = min((m for m in found if m is not None), key=lambda m: m.chi2, default=best)
        if lower.chi2 > best.chi2 - 1.0:
            break
        best = lower
        if not best.converged:
            best = minimise(whitened.residual, best.theta, problem.lower, problem.upper,
                            limit) or best
    return best


def _begun(whitened: Whitened, start: Start | Mapping[str, float],
           misfit: Callable[[float], float], closest: Closest) -> np.ndarray | None:
    """θ (n,) to begin at: the start, or nearer to its origin if χ² is smaller there.

    A linear step out of a large misfit goes too far: the phase of an oscillation bends.  A start
    that has no origin and a χ² far beyond the closest, seen at a glance, is not worth finer steps.
    """
    goal = _place(whitened, start)
    home = _place(whitened, start.origin) if isinstance(start, Start) else goal
    if not np.any(goal != home):
        if isinstance(start, Start):
            if not closest.choose_steps(whitened, goal, lambda chi2: max(misfit(chi2), GLANCE)):
                return None
            seen = whitened.chi2(goal)
            if not closest.ask(lambda chi2: seen <= WILD * (chi2 + max(whitened.rows, 1))):
                return None
        return goal if closest.choose_steps(whitened, goal, misfit) else None
    best, least = None, np.inf
    for share in (1.0, 0.25, 0.06, 0.01):
        theta = home + share * (goal - home)
        if not closest.choose_steps(whitened, theta, misfit):
            continue
        size = whitened.chi2(theta)
        if closest.ask(lambda chi2: misfit(chi2) < GROSS) or (share < 1 and size > least):
            return theta if best is None or size < least else best
        if size < least:
            best, least = theta, size
    return best


def _place(whitened: Whitened, start: Start | Mapping[str, float]) -> np.ndarray:
    """θ (n,) of a start, within the bounds."""
    named, problem = start.values if isinstance(start, Start) else start, whitened.problem
    return np.clip([named.get(f.label, named.get(f.name, f.guess)) for f in problem.free],
                   problem.lower, problem.upper)


def _penalty(effects: Sequence[Candidate], rows: int, choices: int) -> float:
    free = sum(max(len(e.parameters), 1) for e in effects)
    return free * float(np.log(rows)) + 2 * len(effects) * float(np.log(max(choices, 1)))


def start_from(candidate: Candidate, sign: Sign, amplitude: float,
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
