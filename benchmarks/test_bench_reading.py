"""Reading 200,000 rows of a CSV file: ours, with its checks, beside NumPy's plain reader."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

import pikanid as pk

GROUP = "CSV, 200,000 rows of five columns"
ROWS = 200_000
WORST = 3.0  # times as long as NumPy's reader


@pytest.fixture(scope="module")
def path(tmp_path_factory) -> Path:
    t = np.arange(ROWS) * 0.01
    found = tmp_path_factory.mktemp("reading") / "long.csv"
    pk.Recording.from_arrays(t, {"u": np.sin(t), "y": np.cos(t), "z": t**2,
                                   "w": np.sqrt(t)}).write(found)
    return found


def test_recording_read(benchmark, path) -> None:
    benchmark.group = GROUP
    found = benchmark.pedantic(pk.Recording.read, (path,), warmup_rounds=1, rounds=5)
    assert len(found["z"]) == ROWS


def test_numpy_loadtxt(benchmark, path) -> None:
    benchmark.group = GROUP
    benchmark.extra_info["reference"] = True
    found = benchmark.pedantic(np.loadtxt, (path,), {"delimiter": ",", "skiprows": 1},
                               warmup_rounds=1, rounds=5)
    assert found.shape == (ROWS, 5)


def test_reading_takes_at_most_three_times_as_long(path) -> None:
    """Both in one run, in turn, by the time of the processor: the best of three of each."""
    def seconds(work) -> float:
        begun = time.process_time()
        work()
        return time.process_time() - begun

    pk.Recording.read(path)  # imports
    pairs = [(seconds(lambda: pk.Recording.read(path)),
              seconds(lambda: np.loadtxt(path, delimiter=",", skiprows=1))) for _ in range(3)]
    ours, theirs = (min(column) for column in zip(*pairs, strict=True))
    assert ours <= WORST * theirs
