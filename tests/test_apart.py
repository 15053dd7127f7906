"""A process that hangs, crashes or takes too much ends, and says so."""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pikanid.storage import apart


def echo(content: bytes, options: Any) -> tuple[Any, list[np.ndarray]]:
    print("what a library prints is not in the answer")
    return [options, os.getcwd(), os.environ["TMPDIR"]], [
        np.frombuffer(content, float), np.array([]), np.array([np.nan])]


def fails(content: bytes, options: Any) -> tuple[Any, list[np.ndarray]]:
    if options == "loop":
        while True:
            time.sleep(0.01)
    if options == "crash":
        os.abort()
    if options == "memory":
        return bytes(apart.MOST_MEMORY + 2**30).count(b"x"), []
    raise ValueError(options)


def test_arrays_come_back_as_they_were() -> None:
    values = np.array([1.0, -0.0, np.inf, 5e-324])
    (told, where, temporary), arrays = apart.run(
        "test_apart:echo", values.tobytes(), {"θ": [1, None]})
    assert told == {"θ": [1, None]} and where == temporary and not Path(where).exists()
    np.testing.assert_array_equal(arrays[0].view("i8"), values.view("i8"))
    assert [len(a) for a in arrays] == [4, 0, 1]


@pytest.mark.parametrize("how", ["crash", "memory", "raise"])
def test_what_goes_wrong_ends_there(how: str) -> None:
    with pytest.raises(apart.Ended, match="crashed") as end:
        apart.run("test_apart:fails", b"", how)
    assert not end.value.late


def test_what_goes_on_for_ever_ends() -> None:
    with pytest.raises(apart.Ended) as end:
        apart.run("test_apart:fails", b"", "loop", longest=2.0)
    assert end.value.late
