"""Whether recordings repeat one experiment, so that what differs between them is noise."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pikanid.formula.expressions import TIME
from pikanid.mismatch.settings.noise import NoiseSettings
from pikanid.model import Model
from pikanid.recording import Recording
from pikanid.recording.channel import Array


def same_experiment(model: Model, recordings: Sequence[Recording], alike: NoiseSettings) -> bool:
    """Whether recordings repeat one experiment: equal inputs, what else was recorded alike, and
    about the same motion.

    Each counts from its own start.  Of two free swings from different amplitudes what a missing law
    leaves differs as well: they are no repeats.

    >>> import pikanid as pk
    >>> model = pk.systems.sloshing()
    >>> moved = lambda seed, noise: pk.simulate(
    ...     model, pk.excitation.planar_moves(6, 10.0, seed=seed), sigma=0.002, seed=noise)
    >>> same_experiment(model, [moved(1, 1), moved(1, 2)], NoiseSettings())
    True
    >>> same_experiment(model, [moved(1, 1), moved(2, 2)], NoiseSettings())
    False
    """
    if any(e.has(TIME) for e in model.equations.values()):
        return False
    first, *others = recordings
    spans = [_span(model, r) for r in recordings]
    if min(spans) < alike.covered * max(spans):
        return False
    for other in others:
        for name in model.input_names:
            if (name in first) != (name in other):
                return False
            if name in first and _rms(_gap(first, other, name, min(spans))) > (
                    alike.driven_alike * _rms(_begin(first, name)[1])):
                return False
        if any(_differs(first, other, name, min(spans), alike) for name in first.channels
               if name in other and name not in (*model.input_names, *model.output_names)):
            return False
        # where a motion starts is its own
        if any(np.std(_gap(first, other, name, min(spans))) > alike.moved_alike * np.std(
                _begin(first, name)[1]) for name in model.output_names):
            return False
    return True


def _span(model: Model, recording: Recording) -> float:
    t = recording[model.output_names[0]].time
    return float(t[-1] - t[0])


def _begin(recording: Recording, name: str) -> tuple[Array, Array]:
    """Times from the start of the recording and values of a channel, where there are any."""
    c = recording[name]
    good = np.isfinite(c.values)
    return c.time[good] - recording.start, c.values[good]


def _gap(first: Recording, other: Recording, name: str, span: float) -> Array:
    """Difference (N,) of a channel, at the times of the first recording."""
    (t, a), (s, b) = _begin(first, name), _begin(other, name)
    inside = t <= span
    return np.asarray(a[inside] - np.interp(t[inside], s, b))


def _differs(first: Recording, other: Recording, name: str, span: float,
             alike: NoiseSettings) -> bool:
    """Whether a channel that the model does not use, such as a temperature, differs by more than
    its own noise: what differs with it is none.
    """
    if not len(_begin(other, name)[1]) or len(gap := _gap(first, other, name, span)) < 2:
        return False  # a column without values tells nothing
    values = _begin(first, name)[1]
    noise = np.mean(np.diff(gap) ** 2) / 2
    return bool(np.mean(gap**2) - noise > (alike.driven_alike * _rms(values)) ** 2
                + (alike.moved_alike * np.std(values)) ** 2)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
