"""Shooting: standardised residuals of all recordings and their exact Jacobian by θ."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Literal

import numpy as np

from pikanid import errors
from pikanid.noise.level import difference_noise
from pikanid.objective.adequacy import Adequacy, judge
from pikanid.objective.settings import USUAL, AdequacySettings
from pikanid.problem.problem import Problem, Samples
from pikanid.simulation.simulator import MethodChoice, Response, Simulator, Steps

Accuracy = Literal["coarse", "fine"]
AWAY = 10.0  # limit: ranges of an output that a simulation may miss it by before it is lost
HURRY = 16.0  # limit: how many times shorter steps another start may take
REFUSED = 1e10  # numerical: residuals of a trajectory that cannot be finished


class Shooting:
    """Residuals (ŷ - y)/σ (rows,) of a problem by simulation.

    Outputs without a known σ are weighted by their own high-frequency noise when there are several
    (so that units do not decide), and equally when there is one.  A trajectory that cannot be
    finished gives huge residuals: a bad step, not a crash.
    """

    def __init__(self, problem: Problem, method: MethodChoice = "auto",
                 settings: AdequacySettings = USUAL):
        self.problem = problem
        self.settings = settings
        self.method = method
        self.simulators = [Simulator(problem.model, e) for e in problem.experiments]
        self.columns = [problem.columns(r) for r in range(len(self.simulators))]
        self.steps: list[Steps] = []
        self.limits: list[Steps] = []
        self.data = [s.y for e in problem.experiments for s in e.samples]
        self.times = [s.t for e in problem.experiments for s in e.samples]
        self.known = [s.sigma for e in problem.experiments for s in e.samples]
        several = len(problem.model.outputs) > 1
        spreads = [_spread(s, several) for e in problem.experiments for s in e.samples]
        self.weights = 1.0 / np.concatenate([np.empty(0), *spreads])
        self.y = np.concatenate([np.empty(0), *self.data])
        self.rows = len(self.y)
        self._at = b""
        self._kept: tuple[np.ndarray, np.ndarray] | None = None
        self._tried: tuple[bytes, dict[tuple[int, str, float, bool], Response]] = (b"", {})

    def choose_steps(self, theta: np.ndarray, accuracy: Accuracy, passed: bool = False) -> bool:
        """Choose integration steps at θ; returns whether they changed.

        "fine": the integration error moves no estimate by more than about a hundredth of its
        standard error (0.01 σ/√N an output), or, where no σ is known, is 1e-10 of the signal;
        "coarse": ten times that (1e-5 of the signal), never more than 1e-3 of the signal.  Each
        output has a tolerance of its own, in its own unit.  Coarse steps may be `passed`: none but
        the finer ones that follow from them are used.
        """
        old, new = self.steps, list[Steps]()
        for r, simulator in enumerate(self.simulators):
            p = self.problem.parameters(theta, r)
            scale, coarse = self._tolerances[r]
            tolerance = None if scale is None else coarse if accuracy == "coarse" else 1.0
            known = old[r] if old and accuracy == "fine" else None
            method, finest = self.method, 0.0
            if self.limits:
                method, finest = self.limits[r].method, self.limits[r].longest / HURRY
            def trial(steps: Steps, likely: bool, r: int = r) -> Response:
                # half of what is passed is often fine
                return self._trial(theta, r, steps, likely != passed)

            new.append(
                simulator.choose_steps(p, tolerance, method, known, finest, trial, scale))
        self._at, self.steps = b"", new
        return [(s.method, s.longest) for s in old] != [
            (s.method, s.longest) for s in self.steps]

    @functools.cached_property
    def _tolerances(self) -> list[tuple[np.ndarray | None, float]]:
        """For each recording the errors allowed to "fine" samples, (rows,) or (1,) for all, and how
        many times as much "coarse" ones may err.
        """
        found: list[tuple[np.ndarray | None, float]] = []
        for e in self.problem.experiments:
            samples = [s for s in e.samples if len(s.t)]
            fine = [_tolerance(s) for s in samples]
            scale = (np.array(fine) if len(fine) == 1
                     else np.repeat(fine, [len(s.t) for s in samples]))
            found.append((scale, min(map(_coarser, samples, fine))) if samples else (None, 1.0))
        return found

    def hurry(self, on: bool = True) -> None:
        """From now on refuse steps much shorter than the present ones, and other methods.

        A far-off starting point can ask for steps a thousand times shorter than the optimum does.
        Not `on`: from now on refuse none, as the best point may have whatever steps it needs.
        """
        self.limits = list(self.steps) if on else []

    def responses(self, theta: np.ndarray) -> list[Response]:
        """Simulate every recording at θ: states, and sensitivities of its own parameters."""
        return [self._trial(theta, r, steps, True) for r, steps in enumerate(self.steps)]

    def _trial(self, theta: np.ndarray, r: int, steps: Steps, likely: bool) -> Response:
        """The response of recording r at θ, with states and sensitivities if the steps are `likely`
        used.

        Those at the latest θ are kept: where steps are checked the optimiser starts.
        """
        at = theta.tobytes()
        if self._tried[0] != at:
            self._tried = (at, {})
        kept = self._tried[1]
        for more in (True, likely):
            if (found := kept.get((r, steps.method, steps.longest, more))) is not None:
                return found
        active = self.columns[r][0] if likely else None
        response = self.simulators[r].run(self.problem.parameters(theta, r), active, steps, likely)
        kept[r, steps.method, steps.longest, likely] = response
        return response

    def keep(self, theta: np.ndarray, response: Response, residual: np.ndarray,
             jacobian: np.ndarray) -> None:
        """Take over what someone else has evaluated at θ, of the only recording."""
        steps = self.steps[0]
        self._at, self._kept = theta.tobytes(), (residual, jacobian)
        self._tried = (self._at, {(0, steps.method, steps.longest, True): response})

    def residual(self, theta: np.ndarray) -> np.ndarray:
        """(ŷ - y)/σ (rows,)."""
        return self._evaluate(theta)[0]

    def jacobian(self, theta: np.ndarray) -> np.ndarray:
        """∂ residual/∂θ (rows, n_free)."""
        return self._evaluate(theta)[1]

    def _evaluate(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        at = theta.tobytes()
        if self._kept is None or self._at != at:
            self._at, self._kept = at, self._simulate(theta)
        return self._kept

    def _simulate(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        responses = self.responses(theta)
        if not all(r.finished for r in responses):
            return np.full(self.rows, REFUSED), np.zeros((self.rows, len(theta)))
        residual, row = np.empty(self.rows), 0
        # column by column, as optimisers take it; each recording fills those of its own parameters
        columns = np.zeros((len(theta), self.rows))
        for response, (_, own) in zip(responses, self.columns, strict=True):
            self._standardise(response.y, response.sensitivity, row, own, self.y, self.weights,
                              residual, columns)
            row += len(response.y)
        return residual, columns.T

    @functools.cached_property
    def _standardise(self) -> Callable[..., None]:
        from pikanid.objective.standardised import standardise

        return standardise

    def adequacy(self, theta: np.ndarray) -> Adequacy:
        """The χ² verdict at θ."""
        r, own, row = self.residual(theta) / self.weights, [], 0
        for d in self.data:
            own.append(r[row:row + len(d)])
            row += len(d)
        return judge(own, self.known, self.data, len(theta), self.settings,
                     self.times)

    def runs_away(self, theta: np.ndarray) -> bool:
        """Whether a simulation at θ leaves the finite numbers, or what was measured far behind."""
        try:
            self.choose_steps(theta, "coarse")
        except errors.SimulationFailed:
            return True
        left = self.residual(theta) / self.weights
        own = np.concatenate([np.full(len(d), np.ptp(d)) for d in self.data if len(d)])
        return bool(np.max(np.abs(left) / np.maximum(own, 1e-300), initial=0.0) > AWAY)

    def undefined(self, theta: np.ndarray) -> str:
        """Where a recording begins with a rate that is no number, in words; empty where none does.
        """
        from pikanid.simulation.vectorfield import VectorField

        model = self.problem.model
        field = VectorField(model)
        for r, e in enumerate(self.problem.experiments):
            p = self.problem.parameters(theta, r)
            x = e.initial(p)
            t = np.array([e.t0])
            rates = field.rhs(t, x[None], e.inputs(t), p)[0]
            bad = [n for n, rate in zip(model.state_names, rates, strict=True)
                   if not np.isfinite(rate)]
            if bad:
                names = (*model.state_names, *model.input_names)
                at = ", ".join(f"{n} = {v:.4g}" for n, v in zip(
                    names, (*x, *e.inputs(t)[0]), strict=True))
                return f"the rate of {' and of '.join(bad)} is no finite number at its start ({at})"
        return ""

    def explains(self, theta: np.ndarray) -> bool:
        """Whether the fit at θ is within the noise, so that no other start is needed."""
        return self.adequacy(theta).verdict == "fits"


def _spread(samples: Samples, several: bool) -> np.ndarray:
    if samples.sigma is not None:
        return samples.sigma
    noise = difference_noise(samples.y, samples.t) if several else 1.0
    floor = 1e-6 * float(np.ptp(samples.y)) if several and len(samples.y) else 1e-300
    return np.full(len(samples.y), max(noise, floor))


def _tolerance(samples: Samples) -> float:
    if samples.sigma is not None:
        return 0.01 * float(samples.sigma.min()) / np.sqrt(len(samples.t))
    return 1e-10 * max(float(np.ptp(samples.y)), 1e-300)


def _coarser(samples: Samples, limit: float) -> float:
    """How many times more than `limit` an output may err at first."""
    usual = 10.0 if samples.sigma is not None else 1e5
    return min(usual, 1e-3 * float(np.ptp(samples.y)) / limit)
