"""Nonlinear least squares, Eq. (1): the ODE as a hard constraint, by single shooting.

    p̂ = argmin Σ_i |(y_i - h(x(t_i; p)))/σ_i|²   subject to   x' = f(x, u; p)

Jacobians are exact (forward sensitivities); the optimiser is Levenberg-Marquardt: MINPACK's inside
the bounds, one that holds parameters there at them (`pikanid.optimise.minpack`).
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, ClassVar, Literal

import numpy as np

from pikanid import errors
from pikanid.estimate import Estimate
from pikanid.model import Model
from pikanid.objective.settings import USUAL as ADEQUACY
from pikanid.objective.settings import AdequacySettings
from pikanid.objective.shooting import Accuracy, Shooting
from pikanid.optimise.minpack import Optimum
from pikanid.optimise.shooting_fit import fit_shooting
from pikanid.problem.problem import Problem
from pikanid.recording import Recording
from pikanid.settings import changed
from pikanid.strategies.finish import finish
from pikanid.strategies.growth import LONGEST, growth
from pikanid.strategies.multiple_shooting import multiple_shooting
from pikanid.strategies.segments import Followed, followed, joined
from pikanid.strategies.starts import starting_points
from pikanid.uncertainty.settings import USUAL as UNCERTAINTY
from pikanid.uncertainty.settings import UncertaintySettings

ROUGH = 1e-3  # numerical: relative change of θ and of the cost at which finer steps are due


@dataclass(frozen=True)
class NLS:
    """Single-shooting nonlinear least squares.

    Args:
        starts: Number of starting points; "auto" begins at the guess and adds a space-filling
            design of `extra` more only if that fit does not explain the recording.
        protocol: "default", or "paper": best of five starts drawn within ±20 % of the guess (Table
            II).
        tolerance: Relative change of parameters and cost at which the optimiser stops; of the cost
            also one that a Gauss-Newton step promises: θ is then within √(tolerance·rows) standard
            errors.
        max_evaluations: Simulations allowed a start.
        seed: Of the starting points.
        method: Integration method, see `pikanid.simulate`.
        segments: With more than one, every start is first led to a basin by multiple shooting.  An
            unstable plant is followed in segments by itself: `settings["pieces"]` says in how many
            of each recording.
        extra: Starting points that "auto" adds.
        adequacy: When a fit explains the recording.
        uncertainty: When a parameter counts as not determined.

    >>> import pikanid as pk
    >>> model = pk.systems.sloshing()
    >>> rec = pk.simulate(model, pk.excitation.two_pulse(), sigma=0.1*np.pi/180, seed=0)
    >>> est = NLS().fit(model.with_values(l_theta=0.06, d_theta=0.05), rec)
    >>> round(est.value("l_theta"), 4)
    0.045
    """

    name: ClassVar[str] = "nls"
    slow: ClassVar[bool] = False
    starts: int | Literal["auto"] = "auto"
    protocol: Literal["default", "paper"] = "default"
    tolerance: float = 1e-9
    max_evaluations: int = 100
    seed: int = 0
    method: Literal["auto", "explicit", "implicit"] = "auto"
    segments: int = 1
    extra: int = 8
    adequacy: AdequacySettings = ADEQUACY
    uncertainty: UncertaintySettings = UNCERTAINTY

    def fit(self, model: Model, recordings: Recording | Sequence[Recording]) -> Estimate:
        """Estimate the model's free parameters from one recording, or from several jointly.

        Raises:
            BadRecording: A channel is missing or unusable.
            SimulationFailed: No starting point can be simulated.
        """
        begun = time.perf_counter()
        return self._fit(Problem(model, recordings), begun, whole=True)

    def _fit(self, problem: Problem, begun: float, whole: bool = False) -> Estimate:
        """From the problem's guess on; `whole` recordings are cut where they cannot be followed."""
        shooting = Shooting(problem, self.method, self.adequacy)
        history: list[dict[str, float]] = []
        best: Optimum | None = None
        found: Optimum | None = None
        starts = starting_points(problem, self.starts, self.protocol, self.seed, self.extra)
        content = self.starts == "auto" and self.protocol == "default"
        for k, start in enumerate(starts):
            away = whole and k == 0 and shooting.runs_away(start)
            found = None if away else self.one_start(shooting, start)
            if whole and k == 0 and (found is None or not shooting.explains(found.theta)):
                cut = self._in_segments(problem, start if found is None else found.theta, begun)
                if isinstance(cut, Estimate):
                    return cut
                if away or cut is not None:
                    found = self.one_start(shooting, start if cut is None else cut)
            if found is None:
                continue
            history.append({"start": float(k), "cost": found.cost,
                            "evaluations": float(found.evaluations)})
            if best is None:
                shooting.hurry()
            if best is None or found.cost < best.cost * (1 - 1e-9):
                best = found
            # before the next start is drawn, which takes a tenth of a quick fit
            if k == 0 and content and shooting.explains(best.theta):
                break
        if best is None:
            raise errors.SimulationFailed(errors.bad_start(shooting.undefined(problem.guess)))
        if best is not found or len(history) > 1:
            shooting.hurry(False)
            shooting.choose_steps(best.theta, "fine")
        settings: dict[str, Any] = {
            "starts": self.starts, "protocol": self.protocol, "tolerance": self.tolerance,
                    "method": shooting.steps[0].method, "segments": self.segments,
                    "tried": len(history)}
        for name in ("adequacy", "uncertainty"):
            if own := changed(getattr(self, name)):
                settings[name] = own
        return finish(
            self.name, problem, shooting, best.theta, converged=best.converged, history=history,
            settings=settings, seed=self.seed, begun=begun, uncertainty=self.uncertainty,
            stable=not whole)

    def _in_segments(self, problem: Problem, other: np.ndarray, begun: float
                     ) -> Estimate | np.ndarray | None:
        """The estimate of an unstable plant; where only the guess made it one, what was found for
        θ to go on from; None where it is stable, or cannot be followed in segments.
        """
        for theta in (problem.guess, other):
            if any(grown := growth(problem, theta)):
                cut = self.followed(problem, theta, grown)
                if cut is None:
                    continue
                found = replace(joined(cut, problem, grown), seconds=time.perf_counter() - begun)
                at = {f.label: float(v) for f, v in zip(found.free, found.theta, strict=True)}
                led = np.array([at.get(f.label, f.guess) for f in problem.free])
                if not any(growth(problem, led)):
                    return led
                return replace(found, settings={
                    **found.settings, "starts": self.starts, "segments": self.segments})
        return None

    def followed(self, problem: Problem, theta: np.ndarray, grown: Sequence[float],
                 most: float = LONGEST) -> Followed | None:
        """Recordings of an unstable plant in segments; see `segments.followed`."""
        return followed(problem, theta, grown, partial(
            replace(self, starts=1, segments=1)._fit, begun=time.perf_counter()), most)

    def one_start(self, shooting: Shooting, start: np.ndarray) -> Optimum | None:
        """One local fit from θ = start: coarse steps first, then steps fine enough to finish.

        None where the model cannot be simulated at the start.
        """
        evaluations = 0
        theta, found = start, None
        if self.segments > 1:
            led = multiple_shooting(shooting, start, self.segments)
            theta = start if led is None else led
        passes: list[tuple[Accuracy, float]] = [
            ("coarse", max(ROUGH, self.tolerance)), ("fine", self.tolerance)]
        for accuracy, tolerance in passes:
            try:
                shooting.choose_steps(theta, accuracy)
            except errors.SimulationFailed:
                return None
            found = fit_shooting(shooting, theta, tolerance, self.max_evaluations, tolerance)
            evaluations += found.evaluations
            theta = found.theta
        assert found is not None
        return Optimum(theta, found.cost, found.converged, evaluations)
