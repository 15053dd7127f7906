"""Named arrays (MAT variables, NPZ members) as columns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from pikanid.recording.reading.headers import TIME_NAMES, are_times
from pikanid.recording.reading.signals import WIDEST
from pikanid.recording.reading.table import Column


def columns(arrays: Mapping[str, np.ndarray]) -> tuple[Column, ...]:
    """One column a vector, named by its path.

    A matrix gives one column for each of its signals, ``name.1``, ``name.2``, ..., along its
    shorter side.  A vector called ``t`` or ``time`` beside a signal of the same length, or in the
    structure around it, holds that signal's times (as in Simulink's "structure with time").
    """
    vectors: dict[str, np.ndarray] = {}
    for path, array in arrays.items():
        vectors.update(_vectors(path, np.asarray(array)))
    names = {path: path.rpartition(".")[2] for path in vectors}
    told = are_times([(name, None) for name in names.values()])
    clocks = sorted((path for path, is_time in zip(names, told, strict=True) if is_time),
                    key=lambda path: TIME_NAMES.index(names[path].casefold()))
    return tuple(Column(path, values, time=_time_of(path, vectors, clocks)) for path,
                 values in vectors.items())


def _vectors(path: str, array: np.ndarray) -> dict[str, np.ndarray]:
    if array.dtype.kind not in "fiub" or array.size < 2:
        return {}
    squeezed = np.squeeze(array).astype(float)
    if squeezed.ndim == 1:
        return {path: squeezed}
    if squeezed.ndim != 2 or min(squeezed.shape) > WIDEST:
        return {}
    signals = squeezed if squeezed.shape[0] < squeezed.shape[1] else squeezed.T
    return {f"{path}.{k + 1}": row.copy() for k, row in enumerate(signals)}


def _time_of(path: str, vectors: Mapping[str, np.ndarray], clocks: Sequence[str]) -> str | None:
    parts = path.split(".")
    for depth in range(len(parts) - 1, -1, -1):
        for clock in clocks:
            if (clock.split(".")[:-1] == parts[:depth] and clock != path
                    and len(vectors[clock]) == len(vectors[path])):
                return clock
    return None
