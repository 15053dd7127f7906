"""One complete explanation of a recording: the nominal model with some effects added, refitted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pikanid.mismatch.candidate import Candidate, Sign
from pikanid.mismatch.least_squares import Minimum, minimise
from pikanid.mismatch.whitened import Records, Whitened
from pikanid.model import Model

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
    def known(self) -> bool:
        """Whether all effects are entries of the catalogue."""
        return all(e.known for e in self.effects)

    @property
    def values(self) -> dict[str, float]:
        """Estimates by name."""
        free = self.whitened.problem.free
        return {f.name: float(v) for f, v in zip(free, self.minimum.theta, strict=True)}

    @property
    def covariance(self) -> np.ndarray:
        """(n, n) of the estimates; infinite variances become very large ones."""
        J = self.minimum.J
        norms = np.maximum(np.linalg.norm(J, axis=0), 1e-300)
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


def fitted(nominal: Model, effects: Sequence[Candidate], records: Records,
           starts: Sequence[Mapping[str, float]], choices: int, limit: int = 30
           ) -> Hypothesis | None:
    """Refit the nominal model with effects added.

    Args:
        nominal: Without effects.
        effects: To add.
        records: To fit.
        starts: Parameter values by name to begin from; the others begin at the model's.
        choices: Number of effects to choose from.
        limit: Iterations.

    Returns:
        The best local fit, or None where none of the starts can be simulated.
    """
    model = extended(nominal, effects)
    whitened = Whitened(model, records)
    problem = whitened.problem
    best: Minimum | None = None
    for start in starts:
        guess = np.array([start.get(f.name, f.guess) for f in problem.free])
        guess = np.clip(guess, problem.lower, problem.upper)
        if not whitened.choose_steps(guess):
            continue
        found = minimise(whitened.residual, guess, problem.lower, problem.upper,
                         COARSE if len(starts) > 1 else limit)
        if found is not None and (best is None or found.chi2 < best.chi2):
            best = found
    if best is None:
        return None
    if not best.converged:
        if not whitened.choose_steps(best.theta):
            return None
        best = minimise(whitened.residual, best.theta, problem.lower, problem.upper, limit)
        if best is None:
            return None
    penalty = _penalty(effects, whitened.rows, choices)
    return Hypothesis(tuple(effects), model, whitened, best, penalty)


def _penalty(effects: Sequence[Candidate], rows: int, choices: int) -> float:
    free = sum(max(len(e.parameters), 1) for e in effects)
    return free * float(np.log(rows)) + 2 * len(effects) * float(np.log(max(choices, 1)))


def start_from(candidate: Candidate, sign: Sign, amplitude: float,
               values: Mapping[str, float]) -> dict[str, float]:
    """Parameter values at which a fit with one more effect begins."""
    start = {**values, **sign.start}
    if sign.scales and candidate.parameters:
        size = next(iter(sign.start), candidate.parameters[0].name)
        null = next((p.value for p in candidate.parameters if p.name == size), 0.0)
        null = null if sign.null is None else sign.null
        start[size] = null + amplitude * sign.start.get(size, 1.0)
    return start
