"""k-step-ahead prediction: ŷ(t_i + k) from what was measured until t_i, and the inputs.

An ODE has no noise model that would say how far to believe the last sample, and most recordings
show a part of the state only.  So the state is estimated anew before each origin: of a window of W
samples of every output that ends at the origin, by least squares,

    min over x(t_{i-W+1}) of Σ_j ((h(x(t_j)) - y_j)/σ)²,

and the model runs on from there to sample i + k.  With all states measured, W = 1 and no noise that
is the plain restart from the measured state.  What the window does not show of the state stays as
in the window before.  (The estimate is that of a moving horizon with no arrival cost: C. V. Rao,
J. B. Rawlings and D. Q. Mayne, IEEE Trans. Autom. Control 48, 2003.)
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pikanid import errors
from pikanid.comparison.runs import Run, simulator_of, weights, with_free_start
from pikanid.problem.late import sample_delays
from pikanid.problem.problem import Experiment, Samples, bind
from pikanid.recording import Recording
from pikanid.simulation.simulator import Response

PER_STATE = 10  # numerical: samples a state that a window has, unless it is said
ITERATIONS = 20  # limit: Gauss-Newton steps of one window
SETTLED = 1e-11  # numerical: change of a window's outputs, relative, at which its fit is done
LEAST = 1e-3  # numerical: share of a step below which nothing is gained by halving it
SHOWN = 1e-9  # numerical: of the largest singular value, below which a direction is not shown


def usual_window(horizon: int, states: int) -> int:
    """Samples before each origin: as many as are predicted, at least 10 a state.

    >>> usual_window(1, 2), usual_window(50, 2)
    (20, 50)
    """
    return max(horizon, PER_STATE * states)


def predict_ahead(run: Run, recording: Recording, horizon: int, window: int, origins: int
                  ) -> list[np.ndarray]:
    """Predictions of every output's samples (N,), NaN where there is none.

    Args:
        run: The free simulation: parameters, steps, and where the first window begins.
        recording: As in the run.
        horizon: k, in samples of the first output.
        window: W, likewise.
        origins: At most so many windows, evenly spread.

    Raises:
        BadSetting: The recording is shorter than window and horizon.
    """
    base = run.experiment
    clock = base.samples[0].t
    found = [np.full(len(s.t), np.nan) for s in base.samples]
    if len(clock) < window + horizon:
        raise errors.BadSetting(errors.horizon_too_long(base.name, len(clock), window, horizon))
    if not run.finished:
        return found
    model = with_free_start(base.model, base)
    experiment = bind(model, recording)
    index = np.array([model.parameter_names.index(str(s.initial)) for s in model.states], np.int64)
    known = dict(zip(base.model.parameter_names, run.p, strict=True))
    p = np.array([known.get(name, value) for name, value in model.values.items()])
    late = max(0.0, *(float(np.max(d)) for d in sample_delays(model, base.samples, p)))
    every = np.arange(window - 1, len(clock) - horizon)
    every = every[np.unique(np.linspace(0, len(every) - 1, min(origins, len(every))).astype(int))]
    latest = run.response
    for i in every:
        # a measured sample shows the state as it was before the output's delay
        part = replace(experiment, t0=float(clock[i - window + 1]) - late)
        guesses = [_state_at(r, part.t0) for r in (latest, run.response)
                   if r.t[0] <= part.t0 <= r.t[-1] or r is run.response]
        x = _window_state(_between(part, clock[i - window + 1], clock[i]), run, p, index, guesses)
        if x is None:
            continue
        p[index] = x
        # what is predicted from here lies behind the sample before it: each sample once
        ahead = _between(part, clock[i + horizon - 1], clock[i + horizon], after=True)
        response = simulator_of(model, ahead).run(p, steps=run.steps, states=True)
        if not response.finished:
            continue
        latest, first = response, 0
        for k, s in enumerate(ahead.samples):
            place = np.searchsorted(experiment.samples[k].t, s.t)
            found[k][place] = response.y[first:first + len(s.t)]
            first += len(s.t)
    return found


def _state_at(response: Response, t: float) -> np.ndarray:
    """The state (n,) of a simulation at t, between stops by straight lines."""
    return np.array([np.interp(t, response.t, column) for column in response.states.T])


def _between(experiment: Experiment, begin: float, end: float, after: bool = False) -> Experiment:
    """The experiment with the samples in [begin, end], or in (begin, end]."""
    kept = []
    for s in experiment.samples:
        low = int(np.searchsorted(s.t, begin, "right" if after else "left"))
        high = int(np.searchsorted(s.t, end, "right"))
        kept.append(s.part(slice(low, high)))
    return replace(experiment, samples=tuple(kept))


def _window_state(experiment: Experiment, run: Run, p: np.ndarray, index: np.ndarray,
                  guesses: list[np.ndarray]) -> np.ndarray | None:
    """The state (n,) at the beginning of a window, by Gauss-Newton from the better of some guesses;
    steps that go uphill are halved.  None where the model cannot be run there.
    """
    simulator = simulator_of(experiment.model, experiment)
    y = np.concatenate([s.y for s in experiment.samples])
    w = _window_weights(run, experiment.samples)

    def simulated(x: np.ndarray) -> tuple[float, Response]:
        full = p.copy()
        full[index] = x
        response = simulator.run(full, index, run.steps)
        return (float(np.sum(((response.y - y) * w) ** 2)) if response.finished else np.inf,
                response)

    runs = [(*simulated(x), x) for x in guesses]
    cost, response, x = min(runs, key=lambda one: one[0])
    if not np.isfinite(cost):
        return None
    for _ in range(ITERATIONS):
        J = response.sensitivity * w[:, None]
        size = np.linalg.norm(J, axis=0)
        size[size == 0] = 1.0
        step = -np.linalg.lstsq(J / size, (response.y - y) * w, rcond=SHOWN)[0]
        share = 1.0
        lower, tried = simulated(x + step / size)
        while not lower <= cost and share > LEAST:
            share /= 4
            lower, tried = simulated(x + share * step / size)
        if not lower <= cost:
            break
        x, cost, response = x + share * step / size, lower, tried
        if np.linalg.norm(share * step) <= SETTLED * np.linalg.norm(y * w):
            break
    return x


def _window_weights(run: Run, samples: tuple[Samples, ...]) -> np.ndarray:
    """1/σ of the samples of a window, of unknown noise that of the whole recording."""
    whole = weights(run.experiment.samples)
    first, parts = 0, [np.empty(0)]
    for s, every in zip(samples, run.experiment.samples, strict=True):
        own = whole[first:first + len(every.t)]
        low = int(np.searchsorted(every.t, s.t[0])) if len(s.t) else 0
        parts.append(own[low:low + len(s.t)])
        first += len(every.t)
    return np.concatenate(parts)
