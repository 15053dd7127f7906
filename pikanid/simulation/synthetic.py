"""`simulate`: a model and an excitation in, a recording out."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pikanid import errors
from pikanid.formula import quantity as units_quantity
from pikanid.model import Model
from pikanid.problem.arguments import a_model, one_recording
from pikanid.problem.problem import bind
from pikanid.recording import Channel, Recording
from pikanid.simulation.simulator import MethodChoice, Simulator


def simulate(model: Model, excitation: Recording, *,
             sigma: float | str | Mapping[str, float | str] = 0.0, seed: int | None = None,
             t: np.ndarray | None = None,
             parameters: Mapping[str, float] | None = None, tolerance: float | None = None,
             method: MethodChoice = "auto") -> Recording:
    """Simulate a model and return what would be recorded.

    Args:
        model: The model, at its guesses and fixed values.
        excitation: A recording that holds the model's inputs.
        sigma: Standard deviation of added white Gaussian noise, in the outputs' units; one for all
            outputs or one by name, or a text with a unit ("0.1deg").  It is stored with the
            channels.
        seed: Of the noise.
        t: Times of the outputs (N,); default: the time base of the excitation.
        parameters: Values that differ from the model's.
        tolerance: Of the outputs; default 1e-10 of the largest output, or 1e-8 where formulas have
            kinks that ever shorter steps hardly meet.

    Returns:
        Recording with the excitation's channels and one channel an output.

    Raises:
        BadRecording: An input is missing.
        SimulationFailed: The trajectory leaves the finite numbers.

    >>> from pikanid.recording import excitation
    >>> from pikanid.model import systems
    >>> rec = simulate(systems.sloshing(), excitation.two_pulse())
    >>> round(float(abs(rec["theta"].values).max()), 4)
    0.1979
    """
    model, excitation = a_model(model).with_values(parameters or {}), one_recording(excitation)
    times = np.asarray(excitation.t if t is None else t, dtype=float)
    ramp = np.linspace(0.0, 1.0, len(times))  # only the times of a placeholder mean something
    wanted = excitation.with_channels(
        *(Channel(o.name, times, ramp, o.unit) for o in model.outputs))
    simulator = Simulator(model, bind(model, wanted))
    p = np.array(list(model.values.values()))
    enough = 0.0
    if tolerance is None:
        rough = simulator.run(p, steps=simulator.choose_steps(p, method=method))
        largest = max(float(np.abs(rough.y).max(initial=0.0)), 1e-12)
        tolerance, enough = 1e-10 * largest, 1e-8 * largest
    steps = simulator.choose_steps(p, tolerance, method, enough=enough)
    response = simulator.run(p, steps=steps)
    if not response.finished:
        raise errors.SimulationFailed(errors.not_finite(response.stopped_at, "these parameters"))
    rng = np.random.default_rng(seed)
    channels = []
    for o, y in zip(model.outputs, response.y.reshape(len(model.outputs), -1), strict=True):
        s = sigma.get(o.name, 0.0) if isinstance(sigma, Mapping) else sigma
        if isinstance(s, str):
            s = units_quantity.quantity(s, o.unit, f"sigma of '{o.name}'", difference=True)
        noisy = y + rng.normal(0.0, s, len(y)) if s > 0 else y
        channels.append(Channel(o.name, times, noisy, o.unit, s if s > 0 else None))
    return excitation.with_channels(*channels)


def with_outputs(model: Model, recording: Recording, t: np.ndarray | None = None) -> Recording:
    """The recording with every output of the model, in the model's unit; what it lacks has a
    placeholder.

    Only the times of a placeholder mean something: t (N,), by default the recording's own.
    """
    times = recording.t if t is None else t
    ramp = np.linspace(0.0, 1.0, len(times))
    return recording.with_channels(*(
        recording.as_output(o.name, o.unit or None) if o.name in recording.channels
        else Channel(o.name, times, ramp, o.unit) for o in model.outputs))
