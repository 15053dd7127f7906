"""Named arrays (MAT variables, NPZ members) as columns."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pikanid.recording.reading.table import Column

_TIME_NAMES = ("t", "time", "times")
_WIDEST = 64  # limit: signals in one matrix; wider ones are images or tables of something else


def columns(arrays: Mapping[str, np.ndarray]) -> tuple[Column, ...]:
    """One column a vector, named by its path.

    A matrix gives one column for each of its signals, ``name.1``, ``name.2``, ..., along its
    shorter side.  A vector called ``t`` or ``time`` beside a signal of the same length, or in the
    structure around it, holds that signal's times (as in Simulink's "structure with time").
    """
    vectors: dict[str, np.ndarray] = {}
    for path, array in arrays.items():
        vectors.update(_vectors(path, np.asarray(array)))
    return tuple(Column(path, values, time=_time_of(path, len(values), vectors)) for path,
                 values in vectors.items())


def _vectors(path: str, array: np.ndarray) -> dict[str, np.ndarray]:
    if array.dtype.kind not in "fiub" or array.size < 2:
        return {}
    squeezed = np.squeeze(array).astype(float)
    if squeezed.ndim == 1:
        return {path: squeezed}
    if squeezed.ndim != 2 or min(squeezed.shape) > _WIDEST:
        return {}
    signals = squeezed if squeezed.shape[0] < squeezed.shape[1] else squeezed.T
    return {f"{path}.{k + 1}": row.copy() for k, row in enumerate(signals)}


def _time_of(path: str, length: int, vectors: Mapping[str, np.ndarray]) -> str | None:
    parts = path.split(".")
    for depth in range(len(parts) - 1, -1, -1):
        for name in _TIME_NAMES:
            for candidate in vectors:
                *around, last = candidate.split(".")
                if (
                    around == parts[:depth]
                    and last.casefold() == name
                    and candidate != path
                    and len(vectors[candidate]) == length
                ):
                    return candidate
    return None
