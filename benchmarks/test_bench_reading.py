"""Reading 50,000 rows of a CSV file: ours, with its checks, beside NumPy's plain reader."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import pikanid as pk

GROUP = "CSV, 50,000 rows of four columns"


@pytest.fixture(scope="module")
def path(tmp_path_factory) -> Path:
    t = np.arange(50_000) * 0.01
    found = tmp_path_factory.mktemp("reading") / "long.csv"
    pk.Recording.from_arrays(t, {"u": np.sin(t), "y": np.cos(t), "z": t**2}).write(found)
    return found


def test_recording_read(benchmark, path) -> None:
    benchmark.group = GROUP
    found = benchmark.pedantic(pk.Recording.read, (path,), warmup_rounds=1, rounds=5)
    assert len(found["z"]) == 50_000


def test_numpy_loadtxt(benchmark, path) -> None:
    benchmark.group = GROUP
    benchmark.extra_info["reference"] = True
    found = benchmark.pedantic(np.loadtxt, (path,), {"delimiter": ",", "skiprows": 1},
                               warmup_rounds=1, rounds=5)
    assert found.shape == (50_000, 4)
