"""Missing stretches of a recording are said where it is read."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import pikanid as pk


def written(path: Path, t: np.ndarray) -> pk.Recording:
    np.savetxt(path, np.column_stack([t, np.sin(t), np.cos(t)]), delimiter=",",
               header="t [s],u [V],y [m]", comments="")
    return pk.Recording.read(path)


def test_rows_that_are_absent_are_said_once(tmp_path: Path) -> None:
    t = np.arange(400) * 0.5
    absent = np.delete(t, [*range(100, 150), *range(300, 320)])
    assert written(tmp_path / "gap.csv", absent).notes == (
        "No samples of u, y between 49.5 s and 75 s, and in 1 shorter stretch: inputs are held or "
        "interpolated there.",)


@pytest.mark.parametrize("kind", ["even", "few lost", "by events"])
def test_usual_recordings_have_none(kind: str, tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    t = {"even": np.arange(400) * 0.5, "few lost": np.delete(np.arange(400) * 0.5, [7, 8, 9, 200]),
         "by events": np.cumsum(rng.exponential(0.5, 400))}[kind]
    assert written(tmp_path / "fine.csv", t).notes == ()
