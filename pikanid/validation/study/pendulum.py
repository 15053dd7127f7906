"""The real recording: the free swing of a pendulum arm, against the viscous pendulum.

Parameters and the state at t = 0 are estimated on the first 36.7 s.  Held-out error: the fitted
model runs on, from t = 0, through the following 18.3 s, which it has never seen and whose start it
is not told.  As a second figure the state at the start of the held-out part is estimated from its
first second and the model runs from there: this forgives the phase that the first figure counts.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from pikanid import errors
from pikanid.estimate import Estimate
from pikanid.mismatch.diagnose import diagnose
from pikanid.mismatch.report.diagnosis import Diagnosis
from pikanid.model import Model, systems
from pikanid.recording import Recording, datasets
from pikanid.simulation import simulate
from pikanid.strategies import strategy_class
from pikanid.strategies.nls import NLS

# The recording itself gives the guess of the initial state, so that one start is enough for NLS.
SETTINGS: dict[str, dict[str, Any]] = {"nls": {"starts": 1}}  # definition: of the study
FIRST = 1.0  # definition: seconds of the held-out part that may serve to find its initial state


@dataclass(frozen=True, eq=False)
class Swing:
    """The recording in two parts that follow each other."""

    train: Recording
    held_out: Recording


@dataclass(frozen=True, eq=False)
class Result:
    """One fit with its errors [rad], or the sentence that says why there is none.

    `predicted` (N,) is the simulated angle over the held-out part, run on from t = 0.
    """

    strategy: str
    estimate: Estimate | None
    reason: str = ""
    held_out: float = np.nan
    restarted: float = np.nan
    predicted: np.ndarray | None = None


def load() -> Swing:
    """The excerpt that comes with the package: 100 Hz, which is 130 samples a swing."""
    return Swing(datasets.single_pendulum_excerpt("train"),
                 datasets.single_pendulum_excerpt("held_out"))


def guess(recording: Recording) -> Model:
    """The viscous pendulum, started from the first samples."""
    theta = recording["theta"]
    # A parabola through the first 0.1 s: the speed changes by a third within it.
    slope = np.polyfit(theta.time[:10] - theta.time[0], theta.values[:10], 2)[1]
    return systems.pendulum().with_values(
        theta_0=float(theta.values[0]), theta_dot_0=float(slope))


def warm_up(swing: Swing) -> None:
    """Compile the model, so that timed fits are warm."""
    short = swing.train.window(swing.train.start, swing.train.start + FIRST)
    NLS(starts=1).fit(guess(short), short)


def fit(swing: Swing, name: str) -> Result:
    """One strategy on the training part, judged on the held-out part."""
    try:
        found = strategy_class(name)(**SETTINGS.get(name, {})).fit(guess(swing.train), swing.train)
    except errors.PikanidError as problem:
        return Result(name, None, str(problem))
    predicted = run_on(found.fitted_model, swing)
    measured = swing.held_out["theta"].values
    return Result(name, found, "", rms(predicted - measured), restarted(found, swing.held_out),
                  predicted)


def missing_physics(swing: Swing) -> Diagnosis:
    """What the viscous pendulum leaves out, by the training part, and what that does on the
    held-out part, whose initial state is estimated from it.
    """
    return diagnose(systems.pendulum(), swing.train, swing.held_out)


def run_on(model: Model, swing: Swing) -> np.ndarray:
    """The angle (N,) over the held-out part of a run from the start of the training part."""
    t = np.concatenate([swing.train["theta"].time, swing.held_out["theta"].time])
    y = simulate(model, swing.train, t=t)["theta"].values
    return y[len(swing.train["theta"]):]


def restarted(found: Estimate, held_out: Recording) -> float:
    """RMSE over the held-out part when its first second may give the initial state."""
    physics = {p.name: found.value(p.name) for p in systems.pendulum().parameters
               if p.free and p.scope == "shared"}
    start = guess(held_out).fix(**physics)
    head = held_out.window(held_out.start, held_out.start + FIRST)
    model = NLS(starts=1).fit(start, head).fitted_model
    return rms(simulate(model, held_out)["theta"].values - held_out["theta"].values)


def rms(values: np.ndarray) -> float:
    """Root mean square.

    >>> rms(np.array([3.0, -4.0, 0.0, 0.0]))
    2.5
    """
    return float(np.sqrt(np.mean(values**2)))
