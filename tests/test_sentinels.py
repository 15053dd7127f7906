"""Numbers that stand for missing readings are read as missing, and nothing else is."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import pikanid as pk

T = np.arange(200) * 0.1


def read(path: Path, values: np.ndarray) -> pk.Recording:
    np.savetxt(path, np.column_stack([T, values]), delimiter=",", header="t,y [degC]", comments="")
    return pk.Recording.read(path)


@pytest.mark.parametrize("mark", [-9999.0, 99999.0, -999.9, 999.99, -32768.0, 65535.0])
def test_customary_numbers_far_from_all_others_are_missing(mark: float, tmp_path: Path) -> None:
    values = 20.0 + np.sin(T)
    values[[3, 50, 51, 52]] = mark
    found = read(tmp_path / "run.csv", values)
    assert np.flatnonzero(np.isnan(found["y"].values)).tolist() == [3, 50, 51, 52]
    assert found.notes == (f"4 samples of 'y' are {mark:g} and read as missing.",)


def test_a_slow_sensor_beside_a_fast_one(tmp_path: Path) -> None:
    values = np.where(np.arange(200) % 30, -9999.0, np.sin(T))
    assert np.isfinite(read(tmp_path / "run.csv", values)["y"].values).sum() == 7


@pytest.mark.parametrize("values", [
    np.where(T < 5, 0.0, 999.0),  # a switch
    np.where(T < 5, 0.0, np.where(T < 15, 500.0, 999.0)),  # steps
    990.0 + np.round(9 * np.sin(T) ** 2),  # passes 999
    np.where(np.arange(200) == 7, -1234.0, np.sin(T)),  # an outlier that is no custom of loggers
    np.where(T < 5, 0.0, np.where(T < 15, 20.0, 9999.0)),  # levels
])
def test_samples_are_left_as_they_are(values: np.ndarray, tmp_path: Path) -> None:
    found = read(tmp_path / "run.csv", values)
    np.testing.assert_allclose(found["y"].values, values)
    assert not found.notes
