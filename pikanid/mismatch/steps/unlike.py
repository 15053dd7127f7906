"""Recordings that can hardly be meant as they are read: told before hours are spent on them.

A header without a unit, a logger that counts milliseconds, one run exported in degrees and the
other in radians: such recordings cannot be told from physics that is missing, but for their sizes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from pikanid import errors
from pikanid.mismatch.design.response import decay_rate, natural_frequency
from pikanid.model import Input, Model, Output
from pikanid.problem.problem import Experiment, bind
from pikanid.recording import Recording

OFTEN = 20.0  # numerical: as large or as long, for a question: a radian is 57 degrees
PERIODS = 5.0  # numerical: of the model's slowest motion between two samples, for a question


def unlike(model: Model, train: Sequence[Recording], later: Sequence[Recording]) -> list[str]:
    """Questions about units: where a channel of the held-out recordings is far larger or smaller
    than that of the others, where their times are, or where samples are far apart for the model.

    Args:
        model: Nominal model, at its guesses.
        train: Recordings to explain.
        later: Held-out recordings.

    Empty where a recording cannot be used: that is refused where it is used.

    >>> import numpy as np
    >>> from pikanid.model import systems
    >>> t = 0.05 * np.arange(200)
    >>> one = Recording.from_arrays(t, {"u_x": np.sin(t), "theta": 0.1 * np.sin(t)}, name="one")
    >>> other = Recording.from_arrays(t, {"u_x": np.sin(t), "theta": 6 * np.sin(t)}, name="other")
    >>> unlike(systems.sloshing(), [one], [other])[0]
    "'theta' is 60 times as large in 'other' as in 'one': is it in rad in both?"
    """
    try:
        one, *others = [bind(model, some[0]) for some in (train, later) if some]
    except errors.BadRecording:
        return []
    said = [*_coarse(model, train[0])]
    for other in others:
        said += [*_sizes(one, other), *_times(model, train[0], later[0])]
    return said


def _sizes(one: Experiment, other: Experiment) -> Iterator[str]:
    items: list[Input | Output] = [*one.model.inputs, *one.model.outputs]
    for item, *ends in zip(items, _largest(one), _largest(other), strict=True):
        (small, where), (large, there) = sorted(ends)
        if small > 0 and large / small > OFTEN:
            yield errors.sizes_differ(item.name, item.unit, large / small, there, where)


def _largest(bound: Experiment) -> list[tuple[float, str]]:
    """Largest absolute value of each input and output, and of which recording it is."""
    values = [*(h.values for h in bound.held), *(s.y for s in bound.samples)]
    return [(float(np.nanmax(np.abs(v), initial=0.0)), bound.name) for v in values]


def _times(model: Model, one: Recording, other: Recording) -> Iterator[str]:
    lengths = [r.stop - r.start for r in (one, other)]
    steps = [r[model.output_names[0]].interval for r in (one, other)]
    if all(min(pair) > 0 and max(pair) / min(pair) > OFTEN for pair in (lengths, steps)):
        yield errors.times_differ(one.name, other.name, *steps)


def _coarse(model: Model, recording: Recording) -> Iterator[str]:
    rate = natural_frequency(model) or decay_rate(model)
    step = recording[model.output_names[0]].interval
    if rate and step * rate > PERIODS:
        yield errors.samples_far_apart(step, 1 / rate)
