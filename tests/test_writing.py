"""Recordings written: files give them back, whole or not at all."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from swinging import TIMES, swing

from pikanid.errors import BadRecording
from pikanid.recording import Recording
from pikanid.recording.channel import Channel

FLOATS = st.one_of(st.floats(-1e200, 1e200), st.just(float("nan")))


@given(st.data(), st.sampled_from([".csv", ".csv.gz", ".tsv", ".parquet"]))
@settings(deadline=None, max_examples=60)
def test_files_give_the_recording_back(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject, ending: str
) -> None:
    path = tmp_path_factory.mktemp("rec") / f"run{ending}"
    first, second = data.draw(TIMES), data.draw(TIMES)
    y = data.draw(hnp.arrays(float, len(first), elements=FLOATS))
    z = data.draw(hnp.arrays(float, len(second), elements=st.floats(-1e200, 1e200)))
    spread = data.draw(hnp.arrays(float, len(second), elements=st.floats(1e-6, 1e6)))
    channels = [Channel("y", first, y, "deg"), Channel("z", second, z, "m/s^2", spread)]
    rec = Recording({ch.name: ch for ch in channels}, "run")
    rec.write(path)
    assert Recording.read(path) == rec


def test_parquet_carries_sigma_and_hold(tmp_path: Path) -> None:
    swing().write(tmp_path / "swing.parquet")
    assert Recording.read(tmp_path / "swing.parquet") == swing()


def test_writing_is_whole_or_not_at_all(tmp_path: Path) -> None:
    swing().write(tmp_path / "a.csv")
    assert [file.name for file in tmp_path.iterdir()] == ["a.csv"]
    with pytest.raises(BadRecording, match="no known format"):
        swing().write(tmp_path / "a.xyz")
    with pytest.raises(BadRecording, match="cannot be written"):
        swing().write(tmp_path / "missing" / "a.csv")
    first = (tmp_path / "a.csv").read_bytes()
    swing().write(tmp_path / "a.csv.gz")
    again = (tmp_path / "a.csv.gz").read_bytes()
    swing().write(tmp_path / "a.csv.gz")
    assert (tmp_path / "a.csv.gz").read_bytes() == again
    assert first.startswith(b"t [s],u_x [m/s^2],theta [rad]\n0.0,1.0,0.0\n")
