"""Benchmarks as nonlinear_benchmarks hands them out: inputs, outputs and a sampling time.

Any object with these attributes will do (G. Beintema and others, the package nonlinear_benchmarks,
class ``Input_output_data``); the package itself is not needed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from numbers import Real
from typing import Any

import numpy as np

from pikanid import errors
from pikanid.recording.channel import LARGEST, Array, Channel


def is_benchmark(given: Any) -> bool:
    """Whether an object has inputs, outputs and a sampling time.

    >>> is_benchmark([1.0])
    False
    """
    return all(hasattr(given, name) for name in ("u", "y", "sampling_time"))


def channels(data: Any, inputs: Sequence[str] | None, outputs: Sequence[str] | None,
             units: Mapping[str, str],
             rate: float | None) -> tuple[dict[str, Channel], str, tuple[str, ...]]:
    """Channels, name and notes of such an object; the arguments are those of
    `Recording.from_benchmark`.

    Raises:
        BadRecording: If it is no such object, or does not say its sampling time.
        BadSetting: If there are more or fewer names than channels, or a unit of none.
    """
    if not is_benchmark(data):
        raise errors.BadRecording(errors.no_recording(type(data).__name__))
    name = str(getattr(data, "name", "") or "benchmark")
    step: Any = data.sampling_time
    if rate is not None and not 0 < rate < LARGEST:
        raise errors.BadSetting(errors.bad_rate(rate))
    if rate is None and not (isinstance(step, Real) and 0 < float(step) < LARGEST):
        raise errors.BadRecording(errors.no_sampling_time(name))
    values = {**_named(data.u, "u", inputs, "inputs"), **_named(data.y, "y", outputs, "outputs")}
    for unknown in set(units) - set(values):
        raise errors.BadSetting(errors.unknown_channel_setting("units", unknown, values))
    made = {}
    for key, samples in values.items():
        k = np.arange(len(samples), dtype=np.float64)
        time: Array = k / rate if rate is not None else k * np.float64(step)
        made[key] = Channel(key, time, samples, units.get(key, ""))
    first = getattr(data, "state_initialization_window_length", None)
    return made, name, (errors.note_warm_up(int(first)),) if first else ()


def _named(values: Any, letter: str, names: Sequence[str] | None, what: str) -> dict[str, Array]:
    """(N,) samples of each column of (N,) or (N, n) values, by name."""
    table = np.asarray(values)
    if table.ndim not in (1, 2) or table.dtype.kind not in "fiub":
        raise errors.BadRecording(errors.not_numbers(letter, "samples"))
    table = table.reshape(len(table), -1).astype(float)
    n = table.shape[1]
    called = list(names) if names is not None else (
        [letter] if n == 1 else [f"{letter}{k + 1}" for k in range(n)])
    if len(called) != n:
        raise errors.BadSetting(errors.not_as_many_names(what, len(called), n))
    return {name: table[:, k] for k, name in enumerate(called)}
