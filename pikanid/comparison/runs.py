"""One contender simulated along one recording: its start fitted, its outputs and sensitivities."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from pikanid import errors
from pikanid.comparison.contender import Contender
from pikanid.formula.expressions import symbol
from pikanid.model import Model, Parameter
from pikanid.noise.level import difference_noise
from pikanid.optimise.minpack import minimise
from pikanid.problem.problem import Experiment, Samples, bind
from pikanid.recording import Recording
from pikanid.simulation.simulator import Response, Simulator, Steps
from pikanid.simulation.translated import Translated

Start = Literal["model", "free"]
ACCURACY = 1e-12  # numerical: of an output's range, that a simulation may err by
ROUGH = 1e-6  # numerical: likewise, where the usual explicit steps do not do
FINEST = 64  # limit: steps between two samples
SHORTEST = 20  # numerical: samples from which a start is fitted first, before all of them
TOLERANCE = 1e-12  # numerical: relative change of a start at which its fit stops


@dataclass(frozen=True, eq=False)
class Run:
    """A simulation from the start to the end of a recording.

    Attributes:
        experiment: The recording as the model sees it.
        own: Names (a,) of what was fitted to this recording: initial values, and parameters of
            which each recording has its own.
        p: All parameters (P,), those included.
        response: Outputs, sensitivities by `own` and then by the contender's estimated parameters
            (rows, a + f), states.
        steps: Of the integration.
    """

    experiment: Experiment
    own: tuple[str, ...]
    p: np.ndarray
    response: Response
    steps: Steps

    @property
    def finished(self) -> bool:
        """Whether the motion stayed finite to the end."""
        return self.response.finished


def free_run(contender: Contender, recording: Recording, first: int = 0, start: Start = "model"
             ) -> Run:
    """Simulate a contender along a recording without looking at its outputs, but for the start.

    Args:
        contender: The model.
        recording: With the model's inputs and outputs.
        first: Samples of each output from which the initial state is fitted; 0: none.
        start: Where `first` is 0: the initial state as the model has it, or fitted to all samples.
            Initial values that the model itself leaves free are always fitted.

    Raises:
        BadRecording: A channel is missing or unusable.
        BadSetting: There are fewer samples than `first`, or too few for the start.
    """
    model = contender.model.fix(*contender.estimated) if contender.estimated else contender.model
    experiment = bind(model, recording)
    if first or start == "free":
        model = with_free_start(model, experiment)
        experiment = bind(model, recording)
    own = tuple(p.name for p in model.parameters if p.free)
    for s in experiment.samples:
        if len(s.t) <= max(first, 1):
            raise errors.BadSetting(errors.too_few_to_start(
                recording.name, model.outputs[s.output].name, len(s.t), first))
    if own and sum(min(len(s.t), first or len(s.t)) for s in experiment.samples) < len(own):
        raise errors.BadSetting(errors.too_few_for_states(recording.name, first, len(own)))
    p = np.array(list(model.values.values()))
    simulator = simulator_of(model, experiment)
    try:
        steps = fine_steps(simulator, p)
        if own:
            stages = [first] if first else [SHORTEST * len(own), 0]
            for count in stages:
                p = fitted_start(model, until(experiment, count), steps, p, own)
            steps = fine_steps(simulator, p)
    except errors.SimulationFailed:
        none = np.full(experiment.n_samples, np.nan)
        failed = Response(none, np.zeros((len(none), len(own) + len(contender.estimated))),
                          np.empty(0), np.empty((0, len(model.states))), finished=False)
        return Run(experiment, own, p, failed, Steps("explicit", np.inf))
    names = model.parameter_names
    active = np.array([names.index(n) for n in (*own, *contender.estimated)], np.int64)
    response = simulator.run(p, active, steps, states=True)
    if not response.finished:
        response = response._replace(y=np.full(len(response.y), np.nan))
    return Run(experiment, own, p, response, steps)


def with_free_start(model: Model, experiment: Experiment) -> Model:
    """The model with every initial value a free parameter, from where it begins now."""
    begin = experiment.initial(np.array(list(model.values.values())))
    taken = {*model.symbols}
    states, parameters = [], []
    for state, value in zip(model.states, begin, strict=True):
        name = f"{state.name}_start"
        while name in taken:
            name += "_"
        parameters.append(Parameter(name, float(value), state.unit, scope="recording"))
        states.append(replace(state, initial=symbol(name)))
    before = {s.initial for s in model.states if s.initial.is_Symbol}
    replaced = [p.name for p in model.parameters if p.free and any(
        str(s) == p.name for s in before)]
    fixed = model.fix(*replaced) if replaced else model
    return fixed.with_parameters(*parameters).replace(states=tuple(states))


def until(experiment: Experiment, count: int) -> Experiment:
    """The experiment with the first `count` samples of each output alone; 0 for all."""
    if not count:
        return experiment
    return replace(experiment, samples=tuple(s.part(slice(count)) for s in experiment.samples))


def weights(samples: tuple[Samples, ...]) -> np.ndarray:
    """1/σ (rows,) of all samples: as given, or by the output's own high-frequency noise."""
    spreads = [np.empty(0)]
    for s in samples:
        least = max(1e-6 * float(np.ptp(s.y)), 1e-300) if len(s.y) else 1.0
        sigma = difference_noise(s.y, s.t) if s.sigma is None and len(s.y) else s.sigma
        spreads.append(np.full(len(s.y), 1.0) * np.maximum(1.0 if sigma is None else sigma, least))
    return 1.0 / np.concatenate(spreads)


def fitted_start(model: Model, experiment: Experiment, steps: Steps, p: np.ndarray,
                 own: tuple[str, ...]) -> np.ndarray:
    """Parameters p (P,) with those named `own` by least squares to the experiment's samples."""
    simulator = simulator_of(model, experiment)
    index = np.array([model.parameter_names.index(n) for n in own], np.int64)
    limits = np.array([model.parameter(n).bounds for n in own], float).reshape(-1, 2)
    y = np.concatenate([s.y for s in experiment.samples])
    w = weights(experiment.samples)
    kept: dict[bytes, Response] = {}

    def run(theta: np.ndarray) -> Response:
        key = theta.tobytes()
        if key not in kept:
            kept.clear()
            full = p.copy()
            full[index] = theta
            kept[key] = simulator.run(full, index, steps)
        return kept[key]

    def residual(theta: np.ndarray) -> np.ndarray:
        response = run(theta)
        return (response.y - y) * w if response.finished else np.full(len(y), 1e10)

    def jacobian(theta: np.ndarray) -> np.ndarray:
        response = run(theta)
        return response.sensitivity * w[:, None] * float(response.finished)

    found = minimise(residual, jacobian, p[index], limits[:, 0], limits[:, 1], TOLERANCE)
    done = p.copy()
    done[index] = found.theta
    return done


def simulator_of(model: Model, experiment: Experiment) -> Simulator:
    """One that compiles nothing: every contender is simulated a few dozen times only."""
    made = Translated(model, experiment)
    return replace(made, located=True) if made.corners else made


def fine_steps(simulator: Simulator, p: np.ndarray) -> Steps:
    """Explicit steps where these do, else whatever the integrator finds."""
    samples = simulator.experiment.samples
    scale = np.concatenate([np.full(len(s.t), max(float(np.ptp(s.y)), 1e-300)) for s in samples])
    finest = simulator.grid(p).spacings[0] / FINEST
    try:
        found = simulator.choose_steps(p, ACCURACY, "explicit", finest=finest, scale=scale)
        if found.error < ROUGH:
            return found
    except errors.SimulationFailed:
        pass
    return simulator.choose_steps(p, ROUGH, finest=finest, scale=scale)
