"""One complete explanation of a recording: the nominal model with some effects added, refitted."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.data.records import Records
from pikanid.mismatch.data.whitened import Whitened
from pikanid.mismatch.fitting.decisions import below
from pikanid.mismatch.fitting.descent import (
    place,
)
from pikanid.mismatch.fitting.lowest import lowest
from pikanid.model import Model
from pikanid.optimise.levenberg_marquardt import Minimum, worth_a_step

GIVEN = 0.1  # numerical: of parameters, by which those that were given may be off
ENDLESS = 1e3  # numerical: times a size, or its error alone, that an error without end exceeds
KNOWN = 3.0  # numerical: standard errors from nothing, from which on a parameter is known
TOGETHER = 10.0  # numerical: times its error alone, that of a parameter known only with others


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

    def place(self) -> tuple[int, tuple[str, ...]]:
        """Its place among hypotheses that a criterion does not tell apart: fewest effects first,
        then by name.
        """
        return len(self.effects), tuple(sorted(self.key))

    @property
    def known(self) -> bool:
        """Whether all effects are entries of the catalogue."""
        return all(e.known for e in self.effects)

    @property
    def next_form(self) -> bool:
        """Whether an effect is of the form next to an entry's, one of many that might act."""
        return any(e.next_to for e in self.effects)

    @property
    def symbolic(self) -> bool:
        """Whether an effect is a formula that was read, not an entry of the catalogue."""
        return any(e.read for e in self.effects)

    @property
    def far(self) -> bool:
        """Whether so much is left that no test is needed to see it."""
        certain = self.whitened.settings.fits.certain
        return self.minimum.chi2 > certain * max(self.whitened.rows, 1)

    @functools.cached_property
    def blurred(self) -> frozenset[str]:
        """Keys of laws whose shape was left open and that, over the speeds of the motion, resemble
        viscous damping more than the law that they have their name from.
        """
        return frozenset(e.key for e in self.effects if e.refines and self._blurs(e))

    def _blurs(self, effect: Candidate) -> bool:
        if effect.resistance is None:
            return False
        speed = np.abs(self.whitened.motion(self.minimum.theta)[effect.site.v])
        force = effect.resistance(speed, *(self.values[p.name] for p in effect.parameters[1:]))
        viscous, dry = (np.sum(force * law) / max(float(np.linalg.norm(law)), 1e-300)
                        for law in (speed, np.sign(speed)))
        return bool(viscous > dry)

    @property
    def pinned(self) -> bool:
        """Whether a bound holds a parameter."""
        problem = self.whitened.problem
        return bool(np.any(self.minimum.pinned(problem.lower, problem.upper)))

    @functools.cached_property
    def movable(self) -> np.ndarray:
        """(rows, n) derivatives of the residual to the parameters, zeros where a bound holds one:
        that one takes up nothing of what else may be there.
        """
        problem = self.whitened.problem
        return self.minimum.movable(problem.lower, problem.upper)

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
        return self.point_with({})

    def point_with(self, given: Mapping[str, float]) -> dict[str, float]:
        """`point`, with the values that are `given` by name, in all recordings."""
        both = zip(self.whitened.problem.free, self.minimum.theta, strict=True)
        return {**self.values, **given,
                **{f.label: given.get(f.name, float(v)) for f, v in both}}

    @functools.cached_property
    def orders(self) -> np.ndarray:
        """(n, n) rows of a normal prior: no parameter of known size leaves its order of magnitude,
        or the error that it has where all others are known.  Along a valley that the recording does
        not close, what holds to first order ends there.
        """
        sizes = np.maximum(self.whitened.sizes, np.abs(self.minimum.theta))
        alone = 1.0 / np.maximum(np.linalg.norm(self.minimum.J, axis=0), 1e-100)
        return np.diag(1.0 / np.maximum(sizes, alone))

    @functools.cached_property
    def covariance(self) -> np.ndarray:
        """(n, n) of the estimates, where the model's parameters keep their order of magnitude;
        infinite variances become very large ones.
        """
        return _inverse(np.vstack([self.minimum.J, self.orders]))

    @functools.cached_property
    def std(self) -> dict[str, float]:
        """Standard errors by name."""
        return {f.name: float(v) for f, v in zip(self.whitened.problem.free, np.sqrt(np.diag(
            self.covariance)), strict=True)}

    @property
    def begun(self) -> float:
        """The penalty for parameters that only say how a recording begins: others assume that."""
        return sum(len(e.begins) for e in self.effects) * self._each

    @property
    def assumed(self) -> float:
        """The same, and for the shapes of laws, which are nuisance: ideal ones assume them."""
        return self.begun + sum(len(e.parameters) - 1 for e in self.effects if e.refines
                                ) * self._each

    @property
    def _each(self) -> float:
        return float(np.log(max(self.whitened.rows, 1)))

    def determines(self, effect: Candidate) -> bool:
        """Whether the recordings hold the size of an effect, or a bound does: one that has no end,
        though by itself it is seen, could be any, as of a play that is wider than the motion.  Of
        several parameters one at least must be known: where only what they make together is, the
        effect stands for a simpler one, as a loop that never yields for a spring.
        """
        size = effect.parameters[0] if effect.parameters else None
        if size is None or not size.free:
            return True
        alone, error = self._errors
        names = [f.name for f in self.whitened.problem.free]
        own = np.array([n == size.name for n in names]) & np.isfinite(alone)
        far = max(abs(self.values[size.name] - size.value), np.min(alone[own], initial=np.inf))
        if np.any(error[own] > ENDLESS * far):
            return False
        # an exponent is none of its sizes: that of nothing is a law as well
        sizes = {p.name for p in effect.parameters if p.free and p != effect.exponent}
        unknown = np.isfinite(alone) & (error > TOGETHER * alone) & (
            KNOWN * error > np.abs(self.minimum.theta))
        return len(sizes) < 2 or any(n in sizes for n in np.array(names)[~unknown])

    def explained_away(self, overdispersion: float = 1.0) -> bool:
        """Whether its effects take away what would be known of most of the model's own parameters
        were the effects known: they then stand for the model itself.

        Args:
            overdispersion: That divides χ²: standard errors grow with its root.
        """
        theirs = {p.name for e in self.effects for p in e.parameters}
        free = self.whitened.problem.free
        kept = [k for k, f in enumerate(free) if f.name not in theirs]
        own = np.array([free[k].recording is None for k in kept], bool)
        alone = np.diag(_inverse(np.vstack([self.minimum.J, self.orders])[:, kept]))
        squares = np.diag(self.covariance)[kept]
        lost = own & (squares > TOGETHER**2 * alone) & (
            KNOWN * np.sqrt(overdispersion * squares) > np.abs(self.minimum.theta[kept]))
        return 2 * int(np.sum(lost)) > int(np.sum(own))

    @functools.cached_property
    def _errors(self) -> tuple[np.ndarray, np.ndarray]:
        """(n,) standard errors were all others known, and with all that no bound holds; infinite
        where one does.
        """
        lengths = np.linalg.norm(self.movable, axis=0)
        seen = lengths > 0
        columns = self.movable[:, seen] / lengths[seen]
        prior = (np.diag(self.orders)[seen] / lengths[seen]) ** 2
        w, v = np.linalg.eigh(columns.T @ columns + np.diag(np.minimum(prior, 1.0)))
        alone, error = (np.full(len(lengths), np.inf) for _ in range(2))
        alone[seen] = 1.0 / lengths[seen]
        error[seen] = alone[seen] * np.sqrt(np.sum(v**2 / np.maximum(w, 1e-16), axis=1))
        return alone, error

    def improves_on(self, known: Hypothesis) -> bool:
        """Whether it is closer than another fit of the same effects, by more than fits stop at."""
        chi2, rows = known.minimum.chi2, max(known.whitened.rows, 1)
        equal = self.whitened.settings.search.equal
        return below(self.minimum.chi2, chi2 - max(equal, worth_a_step(chi2, rows)))

    def score(self, scale: float = 1.0) -> float:
        """The criterion: smaller is better; `scale` divides χ² where noise is underestimated."""
        return self.minimum.chi2 / scale + self.penalty


def _inverse(J: np.ndarray) -> np.ndarray:
    """(JᵀJ)⁻¹ (n, n) of J (rows, n), as far as its columns are seen and told apart."""
    norms = np.maximum(np.linalg.norm(J, axis=0), 1e-100)
    _, s, vt = np.linalg.svd(J / norms, full_matrices=False)
    inverse = vt.T / np.maximum(s, 1e-9 * (s[0] or 1.0) if len(s) else 1.0) ** 2 @ vt
    return np.asarray(inverse / np.outer(norms, norms))


def near_guess(nominal: Model, records: Records) -> Hypothesis | None:
    """The nominal model where a recording has it if the guess is right to about a tenth: along a
    valley that the recording hardly closes it stays there.  None where that cannot be simulated.
    """
    whitened = Whitened(nominal, records)
    theta = place(whitened, records.guess)
    rows = np.diag(1.0 / (GIVEN * whitened.sizes))
    found = lowest(whitened, theta, records.settings.budget.iterations,
                   besides=lambda at: (rows @ (at - theta), rows)) if whitened.choose_steps(
                       theta, misfit=records.settings.fits.gross) else None
    if found is None:
        return None
    seen = len(found.r) - len(rows)
    return Hypothesis((), nominal, whitened, Minimum(
        found.theta, found.r[:seen], found.J[:seen], False), 0.0)


def unfitted(nominal: Model, records: Records, values: Mapping[str, float]) -> Hypothesis | None:
    """The nominal model at these parameters as they are; None where that cannot be simulated."""
    whitened = Whitened(nominal, records)
    theta = place(whitened, values)
    found = whitened.residual(theta) if whitened.choose_steps(
        theta, misfit=records.settings.fits.gross) else None
    return found and Hypothesis((), nominal, whitened, Minimum(theta, *found, False), 0.0)
