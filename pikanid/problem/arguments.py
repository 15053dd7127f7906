"""What fits, simulations and diagnoses are given: models and recordings, or what stands for one.

A table of pandas, a Dataset of xarray, an object of nonlinear_benchmarks and the path of a file
stand for a recording; whatever else is no recording is refused in a sentence.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import Any

from pikanid import errors
from pikanid.model import Model
from pikanid.recording import Recording
from pikanid.recording.benchmark import is_benchmark


def a_model(given: Any) -> Model:
    """The model.

    Raises:
        BadModel: If it is none.
    """
    if isinstance(given, Model):
        return given
    raise errors.BadModel(errors.no_model(_told(given)))


def one_recording(given: Any) -> Recording:
    """A recording, read from its file or made of a table where it is given so.

    Raises:
        BadRecording: If it is neither, or cannot be read.
    """
    if isinstance(given, Recording):
        return given
    if isinstance(given, str | os.PathLike):
        return Recording.read(given)
    if hasattr(given, "columns") and hasattr(given, "index") and hasattr(given, "to_numpy"):
        return Recording.from_frame(given)
    if _is_labelled(given):
        return Recording.from_xarray(given)
    if is_benchmark(given):
        return Recording.from_benchmark(given)
    raise errors.BadRecording(errors.no_recording(_told(given)))


def several(given: Any) -> tuple[Recording, ...]:
    """One recording, or several of them.

    Raises:
        BadRecording: If one of them is none, or there are none.
    """
    if isinstance(given, list | tuple) or (
            isinstance(given, Iterable) and not isinstance(given, str | os.PathLike | Recording)
            and not hasattr(given, "columns") and not hasattr(given, "dtype")
            and not _is_labelled(given) and not is_benchmark(given)):
        found = tuple(one_recording(r) for r in given)
    else:
        found = (one_recording(given),)
    if not found:
        raise errors.BadRecording(errors.no_recordings())
    return found


def _is_labelled(given: Any) -> bool:
    """Whether it is a Dataset or a DataArray of xarray."""
    return hasattr(given, "data_vars") or (hasattr(given, "coords") and hasattr(given, "dims"))


def _told(given: Any) -> str:
    return type(given).__name__
