"""What each candidate promises beside a hypothesis, to first order, and where its fit begins."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.data.whitened import Whitened
from pikanid.mismatch.detect.residual_tests import unit_columns
from pikanid.mismatch.detect.tangent import Directions, directions
from pikanid.mismatch.fitting.decisions import steady
from pikanid.mismatch.fitting.descent import Start, start_from
from pikanid.mismatch.fitting.hypothesis import Hypothesis

MOSTLY = 0.8  # numerical: of a parameter, in whose place a fit with an effect begins
ALIKE = 1e-4  # numerical: 1 - cos² of two signs below which they are one
UNSEEN = 1e-100  # numerical: norm of a parameter's column below which it moves nothing
SPANNED = 1e-8  # numerical: of the largest singular value, below which columns repeat each other
NOWHERE: Mapping[str, float] = {}


def as_strong(h: Hypothesis, effect: Candidate, other: Candidate, more: Sequence[float] = ()
              ) -> float:
    """Size of a law that takes as much energy out of the motion as another one does, or that one's
    own size where either does not only that.

    Args:
        h: Hypothesis with the effect.
        effect: Of it.
        other: To stand in its place.
        more: Values of its parameters but the size.
    """
    size, *own = (h.values[p.name] for p in effect.parameters)
    speed = np.abs(h.whitened.motion(h.minimum.theta)[effect.site.v])
    shape, wanted = _resistance(effect, own, speed), _resistance(other, more, speed)
    if shape is None or wanted is None:
        return size
    return float(size * np.mean(shape * speed) / max(float(np.mean(wanted * speed)), 1e-12))


def _resistance(law: Candidate, more: Sequence[float], speed: np.ndarray) -> np.ndarray | None:
    """What resists a motion of a speed (N,), at size 1; None where a parameter is not known yet."""
    if law.resistance is None or len(more) < len(law.parameters) - 1:
        return None
    return np.asarray(law.resistance(speed, *more))


def law(c: Candidate) -> bool:
    """A force of one parameter.  Where the model's own parameters took most of such a force up,
    they are far from the truth, and a first step from there does not see it.
    """
    return c.known and c.channel == "dynamics" and len(c.parameters) == 1


def drag(c: Candidate) -> bool:
    """A force of one parameter that only takes energy out: beside a model whose damping has taken
    it up, the first step to it may point the wrong way.
    """
    return law(c) and c.parameters[0].bounds[0] == 0


def entry(c: Candidate, channel: str = "") -> bool:
    """An entry of the catalogue (of a channel).  About a model that is far off, first steps say
    little.
    """
    return c.known and channel in ("", c.channel)


def fixed(c: Candidate) -> bool:
    """An effect without parameters.  What another one does to an input bends its sign."""
    return c.known and not c.parameters


def nothing(c: Candidate) -> bool:
    """No candidate at all."""
    return False


def best_level(h: Hypothesis, candidate: Candidate, point: Mapping[str, float]) -> Start:
    """The level of a candidate that leaves the least χ² beside a hypothesis' effects at `point`."""
    whitened = Whitened(candidate.applied(h.model), h.whitened.records)
    problem = whitened.problem

    def at(level: Mapping[str, float]) -> np.ndarray:
        named = {**point, **level}
        return np.array([named.get(f.label, named.get(f.name, f.guess)) for f in problem.free])

    # which one is best is told at a glance
    whitened.choose_steps(at(candidate.levels[len(candidate.levels) // 2]),
                          misfit=whitened.settings.fits.glance)
    best = min(candidate.levels, key=lambda level: whitened.chi2(at(level)))
    return Start({**point, **best}, {**point, **best})


def _taken(about: Hypothesis, D: np.ndarray) -> np.ndarray:
    """(n, d) by how much parameters move for signs D (rows, d): as far as they are seen and told
    apart, and the model's within their order of magnitude.
    """
    M = np.vstack([about.movable, about.orders])
    norms = np.linalg.norm(M, axis=0)
    norms[norms < UNSEEN] = np.inf
    wanted = np.vstack([D, np.zeros((len(M) - len(D), D.shape[1]))])
    with np.errstate(over="ignore"):
        found = np.linalg.lstsq(M / norms, wanted, SPANNED)[0] / norms[:, None]
    return np.where(np.isfinite(found), found, 0.0)  # beyond all numbers there is no way to go


class Screen:
    """What each candidate would take away from a residual, to first order.

    `guess` holds parameters that the model was given with: what effects of several levels may begin
    beside, as the fit without them may have led away.
    """

    def __init__(self, about: Hypothesis, candidates: Sequence[Candidate],
                 guess: Mapping[str, float] = NOWHERE):
        self.about, self.guess = about, guess
        self.settings = about.whitened.settings
        self.faint = self.settings.search.faint
        self.found: Directions = directions(about.whitened, about.minimum.theta, candidates)
        self.units, self.lengths = unit_columns(self.found.D, about.movable)
        # r = ŷ - y: a sign that is present in y shows as its negative
        self.z = -(self.units.T @ about.minimum.r)
        good = self.lengths > 0
        allowed = good & ((self.z > 0) | ~self.found.one_sided)
        self.gain = np.where(allowed, self.z**2, 0.0)
        self.names = [f.label for f in about.whitened.problem.free]
        self.taken = _taken(about, self.found.D)

    def best(self, candidate: int, count: int = 1) -> list[int]:
        """A candidate's most telling signs, no two neighbours."""
        own = np.flatnonzero(self.found.owner == candidate)
        chosen: list[int] = []
        for k in own[np.argsort(-steady(self.gain[own]), kind="stable")]:
            if self.gain[k] > 0 and all(abs(int(k) - c) > 1 for c in chosen):
                chosen.append(int(k))
            if len(chosen) == count:
                break
        return chosen

    def promised(self, candidate: Candidate) -> float:
        """By how much χ² falls with a candidate, to first order."""
        own = self.found.owner == self.found.candidates.index(candidate)
        return float(self.gain[own].max(initial=0.0))

    def singles(self, count: int, least: float = 0.0,
                always: Callable[[Candidate], bool] = nothing
                ) -> list[tuple[Candidate, list[Start | Mapping[str, float]]]]:
        """The most promising candidates, with the starts of their fits.

        Args:
            count: How many.
            least: That χ² has to fall by, to first order.
            always: Says which ones are listed besides, whatever they promise.
        """
        several = [self.best(c, 3) for c in range(len(self.found.candidates))]
        promised = steady(self.gain)
        order = sorted((k for k, s in enumerate(several) if s),
                       key=lambda k: -promised[several[k][0]])
        listed: list[tuple[Candidate, list[Start | Mapping[str, float]]]] = []
        for k in order:
            if self.gain[several[k][0]] < least or (
                    self.gain[several[k][0]] < self.faint and listed):
                break
            candidate = self.found.candidates[k]
            signs = several[k] if len(candidate.parameters) > 1 or not self.found.directions[
                several[k][0]].scales else several[k][:1]
            starts: list[Start | Mapping[str, float]] = [
                self._start(candidate, s, self.z[s]) for s in signs]
            if law(candidate):
                starts += self._instead(signs[0])
            if fixed(candidate):
                starts += self._at_the_guess()
            listed.append((candidate, starts))
        # decoys beside the entries, not in their place
        known = [one for one in listed if one[0].known][:count]
        # where no start is better than another, each has to be followed to its end
        known += [(c, [start]) for k, c in enumerate(self.found.candidates)
                  if always(c) and (c.levels or all(c is not one[0] for one in known))
                  for start in self._anyhow(k)]
        decoys = [one for one in listed if not one[0].known]
        return known + decoys[:max(count // self.settings.budget.names_a_decoy, 1)]

    def _anyhow(self, candidate: int) -> list[Start | Mapping[str, float]]:
        """Where a fit of a candidate begins that promises nothing."""
        c = self.found.candidates[candidate]
        if c.levels:
            points = [self.about.point, *([self.about.point_with(self.guess)] * bool(self.guess))]
            return [best_level(self.about, c, point) for point in points]
        own = np.flatnonzero((self.found.owner == candidate) & (self.lengths > 0))
        levels = [int(k) for k in own if not self.found.directions[k].scales]
        most = self.settings.budget.unpromising
        some = levels[::-2][:most] if len(levels) > most else levels
        if some:
            return [self._start(c, k, 0.0) for k in some]
        return [Start(self.about.point, self.about.point),
                *(self._instead(int(own[0])) if len(own) and law(c) else []),
                *(self._at_the_guess() if fixed(c) else [])]

    def _at_the_guess(self) -> list[Mapping[str, float]]:
        """Where an effect that nothing makes small may begin besides: the fit without it, as of a
        reversed sign, can have made all motion small instead.
        """
        return [self.about.point_with(self.guess)] if self.about.far and self.guess else []

    def _start(self, candidate: Candidate, sign: int, amplitude: float) -> Start:
        size = float(steady(np.array(amplitude / self.lengths[sign])))
        start = start_from(candidate, self.found.directions[sign], size, self.about.point)
        if not self.found.directions[sign].scales:
            return start
        moved = {n: self.about.point[n] - size * float(d)
                 for n, d in zip(self.names, self.taken[:, sign], strict=True)}
        return Start({**start.values, **moved}, start.origin)

    def _instead(self, sign: int) -> list[Mapping[str, float]]:
        """Where a fit may begin besides: with the effect in the place of most of a parameter.
        Out of a large misfit the first step is a small one, and a parameter that stands for the
        effect can hold a fit where it is.
        """
        if not (self.about.far and self.found.one_sided[sign]):
            return []
        moves = self.taken[:, sign]
        here = np.array([self.about.point[n] for n in self.names])
        with np.errstate(divide="ignore", invalid="ignore"):
            size = MOSTLY * float(np.min(np.abs(here / moves), initial=np.inf, where=moves != 0))
        if not np.isfinite(size):
            return []
        name = next(iter(self.found.directions[sign].start))
        return [{**self.about.point, name: size,
                 **dict(zip(self.names, (here - size * moves).tolist(), strict=True))}]

    def pairs(self, count: int
              ) -> list[tuple[tuple[Candidate, Candidate], list[Start]]]:
        """The pairs that take most away together, also where neither does alone."""
        # a law of free exponent is tried later, in the place of whole ones
        known = np.array([c.known and not c.covers for c in self.found.candidates])
        good = np.flatnonzero((self.lengths > 0) & known[self.found.owner])
        C = self.units[:, good].T @ self.units[:, good]
        z, owner = self.z[good], self.found.owner[good]
        rest = 1 - C**2
        with np.errstate(divide="ignore", invalid="ignore"):
            first = (z[:, None] - C * z[None, :]) / rest
            gain = first * z[:, None] + first.T * z[None, :]
        sided = self.found.one_sided[good]
        bad = (rest < ALIKE) | (owner[:, None] == owner[None, :]) | (
            sided[:, None] & (first <= 0)) | (sided[None, :] & (first.T <= 0))
        gain = np.triu(np.where(bad, 0.0, gain), 1)
        listed: list[tuple[tuple[Candidate, Candidate], list[Start]]] = []
        taken: set[tuple[int, int]] = set()
        order = np.argsort(-steady(gain), axis=None, kind="stable")
        for flat in order[:self.settings.budget.pairs_weighed]:
            i, j = divmod(int(flat), len(z))
            pair = (int(owner[i]), int(owner[j]))
            a, b = (self.found.candidates[k] for k in pair)
            if gain[i, j] < 2 * self.faint or len(listed) == count:
                break
            if pair in taken or (a.alike and a.alike == b.alike):
                continue
            taken.add(pair)
            start = self._start(a, int(good[i]), first[i, j])
            other = self._start(b, int(good[j]), first[j, i])
            own = {p.name for p in b.parameters}
            values, origin = ({**x, **{n: v for n, v in y.items() if n in own}} for x, y in (
                (start.values, other.values), (start.origin, other.origin)))
            for n, now in self.about.point.items():
                values[n] = start.values[n] + other.values[n] - now
            listed.append(((a, b), [Start(values, origin)]))
        return listed


def kept(screens: dict[object, Screen], about: Hypothesis, candidates: Sequence[Candidate]
         ) -> Screen:
    """The screen of these candidates, from those that are kept: the best hypotheses are extended
    again and again.  It lets go of the columns over time, which `Screen.pairs` alone asks for.
    """
    asked = about.fit, tuple(c.key for c in candidates)
    if asked not in screens:
        screen = Screen(about, candidates)
        screen.units = np.empty((0, len(screen.z)))
        screen.found = replace(screen.found, D=screen.units)
        screens[asked] = screen
    return screens[asked]
