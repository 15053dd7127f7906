"""Residuals of a model against recordings, whitened by the noise, with exact derivatives."""

from __future__ import annotations

import functools
import math
from dataclasses import replace

import numpy as np

from pikanid import errors
from pikanid.mismatch.data.records import Records
from pikanid.model import Model
from pikanid.problem.problem import Problem
from pikanid.simulation.compiled import Method
from pikanid.simulation.simulator import Response, Steps
from pikanid.simulation.translated import Translated

SHARE = 0.05  # numerical: of the noise that a simulation may err by, 1/400 of its power
OF_MISFIT = 0.2  # numerical: of the root of χ² per row, that a simulation may err more by
TOO_ROUGH = 20  # numerical: times the error that steps are chosen for: beyond, they are none
SHARP = 8  # numerical: steps a sample from which on stopping at corners is cheaper than finer steps
STIFF = 4  # numerical: implicit steps a sample, at most, where the explicit method fails
IMPLICIT = 10  # numerical: explicit steps that one of those takes the time of
FINEST, COARSEST = 64, 16  # numerical: steps a sample, at most; of a motion that misses grossly


def allowance(misfit: float) -> float:
    """How many times more than usual an integration may err where χ² per row is `misfit`."""
    return max(1.0, OF_MISFIT * misfit**0.5)


class Whitened:
    """(ŷ - y) of a model, whitened to unit variance, as a function of θ (n_free,).

    >>> from pikanid.model import systems
    >>> systems.sloshing().free_names                       # what θ holds
    ('l_theta', 'd_theta')
    """

    def __init__(self, model: Model, records: Records):
        held = [r.with_hold(**{i.name: i.hold for i in model.inputs if i.name in r})
                for r in records.recordings]
        self.problem = Problem(model, held)
        self.records = records
        self.settings = records.settings
        self.columns = [self.problem.columns(r) for r in range(len(self.problem.experiments))]
        self.simulators = [
            Translated(model, e, estimated=tuple(active.tolist()))
            for e, (active, _) in zip(self.problem.experiments, self.columns, strict=True)]
        self.steps: list[Steps] = []
        # errors of the last choice of steps, and what is allowed of each where nothing is left [σ]
        self.weighed: list[tuple[float, float]] = []
        self.rows = self.problem.n_samples
        self._measured = [np.concatenate([s.y for s in e.samples])
                          for e in self.problem.experiments]
        self._whitening = [
            [found[model.outputs[s.output].name].whitening(s.t, s.sigma) for s in e.samples]
            for e, found in zip(self.problem.experiments, records.levels, strict=True)]
        # σ (rows,) of every sample of each recording, in the units of its outputs
        self.sigma = [np.concatenate([w.spreads for w in own]) for own in self._whitening]
        self.work = 0.0
        self._counted: np.ndarray | None = None  # where the last simulation was counted already

    def choose_steps(self, theta: np.ndarray, share: float = SHARE, misfit: float = 1.0) -> bool:
        """Steps whose error stays below a share of the noise; False where nothing can be run.

        Where a misfit of many times the noise is left anyway (`misfit`, χ² per row), a fifth of
        that share of the misfit is allowed instead.
        """
        self.weighed = []
        allowed = share * allowance(misfit)
        finest = FINEST if misfit < self.settings.fits.gross else COARSEST
        found = []
        for r in range(len(self.simulators)):
            steps = self._steps(r, theta, share, allowed, finest)
            if steps is None:
                return False
            found.append(steps)
        self.steps = found
        return True

    def step_errors(self, theta: np.ndarray) -> list[float]:
        """Errors of the steps in use elsewhere than where they were chosen, as shares of what
        `choose_steps` allows where nothing is left; by halving each step once.
        """
        found = []
        for r, simulator in enumerate(self.simulators):
            p = self.problem.parameters(theta, r)
            halved = replace(self.steps[r], longest=self.steps[r].longest / 2)
            rough, fine = (simulator.run(p, steps=s) for s in (self.steps[r], halved))
            if not rough.finished or not fine.finished:
                found.append(np.inf)
                continue
            size = float(np.abs((fine.y - rough.y) / self.sigma[r]).max(initial=0.0)) * 16 / 15
            found.append(size / SHARE)
        return found

    def step_as(self, *others: Whitened) -> None:
        """Simulate as others do that hold the same recordings, one after the other."""
        self.simulators = [s for other in others for s in other.simulators]
        self.steps = [s for other in others for s in other.steps]

    def _steps(self, r: int, theta: np.ndarray, share: float, allowed: float, finest: int
               ) -> Steps | None:
        """Those of one recording, by whichever way does; None where none comes near."""
        def tried(most: int, method: Method = "explicit") -> Steps | None:
            try:
                steps = self.simulators[r].choose_steps(
                    self.problem.parameters(theta, r), allowed, method,
                    finest=self._spacing(r) / most, scale=self.sigma[r])
            except errors.SimulationFailed:
                return None
            self.weighed.append((steps.error, share))
            return steps

        simulator = self.simulators[r]
        steps = tried(SHARP if simulator.corners else finest)
        if simulator.corners and (steps is None or steps.error > allowed):
            self.simulators[r] = Translated(simulator.model, simulator.experiment, located=True,
                                            estimated=simulator.estimated)
            steps = tried(finest)
            if steps is None:  # a motion at rest on a corner meets it without end
                self.simulators[r] = simulator
                steps = tried(finest)
        if steps is None or steps.error > TOO_ROUGH * allowed:
            steps = tried(STIFF, "implicit")
        return steps if steps is not None and steps.error <= TOO_ROUGH * allowed else None

    def _spacing(self, r: int) -> float:
        samples = self.problem.experiments[r].samples[0]
        return float(np.median(np.diff(samples.t)))

    def responses(self, theta: np.ndarray, states: bool = False) -> list[Response]:
        """Simulate every recording, with derivatives by its own parameters."""
        self.work += 0.0 if theta is self._counted else self.cost
        return [s.run(self.problem.parameters(theta, r), self.columns[r][0], self.steps[r], states)
                for r, s in enumerate(self.simulators)]

    @functools.cached_property
    def sizes(self) -> np.ndarray:
        """(n_free,) of the model's parameters that keep their sign, as they were given; infinite
        for others, and where none was given.
        """
        given = [abs(self.records.guess.get(f.name, 0.0)) * (f.bounds[0] >= 0 or f.bounds[1] <= 0)
                 for f in self.problem.free]
        return np.array([size or np.inf for size in given])

    def motion(self, theta: np.ndarray) -> dict[str, np.ndarray]:
        """States (L,) by name, the recordings' one after the other."""
        states = np.concatenate([r.states for r in self.responses(theta, states=True)])
        return dict(zip(self.problem.model.state_names, states.T, strict=True))

    @property
    def cost(self) -> float:
        """Of a simulation with derivatives: states times steps."""
        spans = [e.samples[0].t[-1] - e.samples[0].t[0] for e in self.problem.experiments]
        steps = [max(span / s.longest, len(e.samples[0].t))
                 * (IMPLICIT if s.method == "implicit" else 1)
                 for span, s, e in zip(spans, self.steps, self.problem.experiments, strict=True)]
        return float(len(self.problem.model.states) * sum(steps))

    def residual(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        """Whitened residual (rows,) and Jacobian (rows, n_free); None where it cannot be run, no
        steps were found that could, or squares of either overflow.
        """
        if not self.steps:
            return None
        responses = self.responses(theta)
        if not all(r.finished for r in responses):
            return None
        parts, jacobians = [], []
        for r, response in enumerate(responses):
            J = np.zeros((len(response.y), len(theta)))
            J[:, self.columns[r][1]] = response.sensitivity
            parts.append(self.whiten(r, response.y - self.measured(r)))
            jacobians.append(self.whiten(r, J))
        rows, jacobian = np.concatenate(parts), np.concatenate(jacobians)
        finite = all(math.isfinite(np.vdot(a, a)) for a in (rows, jacobian))
        return (rows, jacobian) if finite else None

    def rows_alone(self, theta: np.ndarray) -> np.ndarray | None:
        """The rows of `residual`, the same numbers, without derivatives: for a fraction of the
        time, where there are many parameters.  It counts as work as they do, both together once.
        """
        if not self.steps:
            return None
        self.work += self.cost
        self._counted, found = theta, self._each(theta)
        return None if found is None else np.concatenate(found)

    def chi2(self, theta: np.ndarray) -> float:
        """Sum of squares of the whitened residual, without derivatives; infinite if it fails, or
        where no steps were found that could do.
        """
        found = self._each(theta)
        return np.inf if found is None else sum(float(np.sum(part ** 2)) for part in found)

    def _each(self, theta: np.ndarray) -> list[np.ndarray] | None:
        """Whitened residuals of the recordings, without derivatives."""
        parts: list[np.ndarray] = []
        for r, simulator in enumerate(self.simulators if self.steps else ()):
            response = simulator.run(self.problem.parameters(theta, r), steps=self.steps[r])
            if not response.finished:
                return None
            parts.append(self.whiten(r, response.y - self.measured(r)))
        return parts or None

    def measured(self, r: int) -> np.ndarray:
        """All samples of recording r (rows,)."""
        return self._measured[r]

    def whiten(self, r: int, rows: np.ndarray) -> np.ndarray:
        """Rows (rows,) or (rows, k) of recording r as white noise of unit variance."""
        first, *more = self._whitening[r]
        if not more:
            return first(rows)
        ends = np.cumsum([len(w.spreads) for w in self._whitening[r]])[:-1]
        return np.concatenate([w(part) for w, part in zip(
            self._whitening[r], np.split(rows, ends), strict=True)])
