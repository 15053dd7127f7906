"""Predictions of every output of every recording: by models, and by the linear baseline."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pikanid import errors
from pikanid.comparison.contender import Contender
from pikanid.comparison.horizon import predict_ahead
from pikanid.comparison.linear import ARX, Series, best_arx, even_grid
from pikanid.comparison.runs import Run, Start, free_run
from pikanid.model import Model
from pikanid.noise.level import difference_noise, estimate
from pikanid.optimise.propagation import propagated
from pikanid.problem.problem import Experiment, Samples, bind
from pikanid.recording import Recording

BASELINE = "linear (ARX)"


@dataclass(frozen=True, eq=False)
class Prediction:
    """One output of one recording, as one model predicts it.

    Attributes:
        model, recording, output, unit: What.
        t, measured, predicted: (N,) times [s] and values in the model's unit; predictions are NaN
            where the protocol gives none, and everywhere if the motion leaves the finite numbers.
        sigma: (N,) noise, as given or estimated; an estimate is no more than what some model
            leaves at the highest frequencies.
        sigma_source: "given" or "estimated".
        spread: (N,) standard deviation of the prediction that the parameters' covariance gives, or
            None where that is not known.
        held_out: Whether the model was not fitted to it; None if that is not known.
        parameters: Number of all estimated parameters; `fitted_here` of them on this recording.
    """

    model: str
    recording: str
    output: str
    unit: str
    t: np.ndarray
    measured: np.ndarray
    predicted: np.ndarray
    sigma: np.ndarray
    sigma_source: str
    spread: np.ndarray | None
    held_out: bool | None
    parameters: int
    fitted_here: int

    @property
    def residual(self) -> np.ndarray:
        """measured - predicted (N,)."""
        return self.measured - self.predicted


@dataclass(frozen=True)
class Protocol:
    """How predictions are made: see `validate`."""

    first: int = 0
    start: Start = "model"
    horizon: int | None = None
    window: int = 0
    origins: int = 5000

    def __str__(self) -> str:
        begin = (f"the initial state from the first {self.first} samples, which are not scored"
                 if self.first else {"model": "the initial state as the model has it",
                                     "free": "the initial state fitted to the recording"}[
                                         self.start])
        if self.horizon is None:
            return f"Free simulation, {begin}."
        return (f"Prediction {self.horizon} samples ahead, from a state estimated of the "
                f"{self.window} samples up to each origin.")


def of_model(contender: Contender, recording: Recording, protocol: Protocol
             ) -> tuple[list[Prediction], Run]:
    """The predictions of a model, and its free simulation."""
    run = free_run(contender, recording, protocol.first, protocol.start)
    if protocol.horizon is None:
        predicted = np.split(run.response.y, _ends(run.experiment))
    else:
        predicted = predict_ahead(run, recording, protocol.horizon, protocol.window,
                                  protocol.origins)
    spread = _spread(contender, run) if protocol.horizon is None else None
    spreads = [None] * len(predicted) if spread is None else np.split(
        spread, _ends(run.experiment))
    model = contender.model
    found = []
    for s, y, std in zip(run.experiment.samples, predicted, spreads, strict=True):
        output = model.outputs[s.output]
        sigma, source = noise_of(recording, model, s)
        y = np.array(y)
        if run.finished:
            y[:protocol.first] = np.nan
        found.append(Prediction(
            contender.name, recording.name, output.name, output.unit, s.t, s.y, y, sigma, source,
            std, contender.held_out(s.t, s.y, output.name),
            len(contender.estimated) + len(run.own),
            0 if protocol.first or protocol.horizon else len(run.own)))
    return found, run


def _ends(experiment: Experiment) -> np.ndarray:
    return np.cumsum([len(s.t) for s in experiment.samples])[:-1]


def _spread(contender: Contender, run: Run) -> np.ndarray | None:
    """√diag(J C Jᵀ) (rows,) by the parameters that recordings share."""
    if not run.finished or not np.any(contender.covariance):
        return None
    return propagated(run.response.sensitivity[:, len(run.own):], contender.covariance)


def noise_of(recording: Recording, model: Model, samples: Samples) -> tuple[np.ndarray, str]:
    """σ (N,) of an output's samples: as given, else from a quiet stretch or high frequencies."""
    if samples.sigma is not None:
        return np.asarray(samples.sigma, float), "given"
    output = model.outputs[samples.output]
    unit = output.unit if output.unit and recording[output.name].unit else None
    try:
        sigma = estimate(recording.as_output(output.name, unit)).sigma
    except errors.BadRecording:
        sigma = difference_noise(samples.y, samples.t)
    return np.full(len(samples.t), max(sigma, least_noise(samples.y))), "estimated"


def least_noise(values: np.ndarray) -> float:
    """σ that an output (N,) has at least: rounding."""
    return 1e-9 * max(float(np.ptp(values)), 1e-300)


class Baseline:
    """The best linear model of each output, fitted to training recordings.

    Args:
        model: Whose inputs and outputs are used.
        training: What it is fitted to.
        protocol: How it predicts.
    """

    def __init__(self, model: Model, training: Sequence[Recording], protocol: Protocol):
        self.model, self.protocol = model, protocol
        self.training = tuple(training)
        self.notes: list[str] = []
        self.fitted: dict[int, tuple[ARX, float]] = {}
        bound = [bind(model, r) for r in training]
        for k, output in enumerate(model.outputs):
            made = [_series(e, next(s for s in e.samples if s.output == k)) for e in bound]
            grids = [m for m in made if m is not None]
            if len(grids) < len(made):
                self.notes.append(errors.baseline_uneven(output.name))
                continue
            if np.ptp([g[2] for g in grids]) > 1e-3 * grids[0][2]:
                self.notes.append(errors.baseline_rates(output.name))
                continue
            arx = best_arx([g[0] for g in grids], protocol.first, protocol.horizon)
            if arx is None:
                self.notes.append(errors.baseline_unstable(output.name))
                continue
            self.fitted[k] = arx, grids[0][2]

    def predictions(self, recording: Recording) -> list[Prediction]:
        """Of every output that it could be fitted to, on a recording."""
        experiment = bind(self.model, recording)
        found = []
        for s in experiment.samples:
            made = _series(experiment, s)
            if s.output not in self.fitted or made is None:
                continue
            arx, interval = self.fitted[s.output]
            series, places, own = made
            if abs(own - interval) > 1e-3 * interval:
                continue
            p = self.protocol
            y = arx.simulate(series, p.first) if p.horizon is None else arx.ahead(series, p.horizon)
            y = y[places]
            y[:p.first] = np.nan
            output = self.model.outputs[s.output]
            sigma, source = noise_of(recording, self.model, s)
            found.append(Prediction(
                BASELINE, recording.name, output.name, output.unit, s.t, s.y, y, sigma, source,
                None, all(recording is not r for r in self.training), arx.parameters,
                0 if p.first or p.horizon else arx.order))
        return found


def _series(experiment: Experiment, samples: Samples) -> tuple[Series, np.ndarray, float] | None:
    """An output with the inputs on its even grid, the places of its samples, the interval [s]."""
    grid = even_grid(samples.t)
    if grid is None:
        return None
    places, interval = grid
    y = np.full(places[-1] + 1, np.nan)
    y[places] = samples.y
    t = samples.t[0] + interval * np.arange(len(y))
    return Series(y, experiment.inputs(t)), places, interval
