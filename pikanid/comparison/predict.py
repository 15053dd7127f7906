"""A recording with a model's predictions in the place of its outputs."""

from __future__ import annotations

from typing import Any

import numpy as np

from pikanid.comparison.contender import contenders
from pikanid.comparison.horizon import predict_ahead, usual_window
from pikanid.comparison.runs import Start, fine_steps, free_run, simulator_of
from pikanid.problem.arguments import one_recording
from pikanid.problem.problem import bind
from pikanid.recording import Channel, Recording


def predict(model: Any, recording: Recording, *, first: int = 0, initial: Start = "model",
            horizon: int | None = None, window: int | None = None, origins: int = 5000
            ) -> Recording:
    """What a model says about a recording: its channels, with every output as predicted.

    A recording without outputs is simulated from the model's own initial state, on the time base
    of its first channel.  Arguments are those of `pikanid.validate`; samples that a prediction
    `horizon` ahead cannot reach are NaN.

    Raises:
        BadRecording: An input is missing or unusable.
        BadSetting: The recording is too short.

    >>> import pikanid as pk
    >>> model = pk.systems.sloshing()
    >>> drive = pk.excitation.two_pulse()
    >>> bool(np.allclose(predict(model, drive)["theta"].values,
    ...                  pk.simulate(model, drive)["theta"].values, atol=1e-9))
    True
    """
    recording = one_recording(recording)
    contender = contenders([model], ())[0]
    base = contender.model
    times = {o.name: recording[o.name].time if o.name in recording else recording.t
             for o in base.outputs}
    wanted = recording.with_channels(*(
        Channel(o.name, times[o.name], np.linspace(0.0, 1.0, len(times[o.name])), o.unit)
        for o in base.outputs))
    if any(o.name not in recording for o in base.outputs):
        fixed = base.fix(*base.free_names)
        p = np.array(list(base.values.values()))
        simulator = simulator_of(fixed, bind(fixed, wanted))
        steps = fine_steps(simulator, p)
    else:
        run = free_run(contender, recording, first, initial)
        p, steps = run.p, run.steps
        if horizon is not None:
            window = window or usual_window(horizon, len(base.states))
            found = predict_ahead(run, recording, horizon, window, origins)
            every = []
            for s, y in zip(run.experiment.samples, found, strict=True):
                name = base.outputs[s.output].name
                full = np.full(len(times[name]), np.nan)
                full[np.isin(times[name], s.t)] = y
                every.append(Channel(name, times[name], full, base.outputs[s.output].unit))
            return recording.with_channels(*every)
        simulator = simulator_of(run.experiment.model, bind(run.experiment.model, wanted))
    response = simulator.run(p, steps=steps)
    y = response.y if response.finished else np.full(len(response.y), np.nan)
    parts = np.split(y, np.cumsum([len(times[o.name]) for o in base.outputs])[:-1])
    return recording.with_channels(*(Channel(o.name, times[o.name], part, o.unit)
                                     for o, part in zip(base.outputs, parts, strict=True)))
