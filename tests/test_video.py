"""From a compressed clip to a recording with a sigma for each frame; bad videos in a sentence."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pikanid import errors
from pikanid.recording import Recording
from pikanid.tracking.render import picture
from pikanid.tracking.video import track

cv2 = pytest.importorskip("cv2")


def clip(path: Path, angles: np.ndarray, level: float | None = None) -> Path:
    film = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"MJPG"), 50.0, (200, 160))
    for k, theta in enumerate(angles):
        hidden = 500.0 if k == 7 else level
        film.write(np.ascontiguousarray(picture(theta, seed=k, level=hidden)[..., ::-1]))
    film.release()
    return path


def test_a_clip_becomes_a_recording(tmp_path: Path) -> None:
    truth = np.radians(20) * np.sin(np.arange(120) / 9)
    found = track(clip(tmp_path / "run.avi", truth))
    found.write(tmp_path / "run.csv")
    back = Recording.read(tmp_path / "run.csv")["theta"]
    assert np.flatnonzero(np.isnan(back.values)).tolist() == [7]
    assert "1 of 120 frames" in found.notes[0]
    off, sigma = np.delete(back.values - truth, 7), np.delete(np.asarray(back.sigma), 7)
    assert np.sqrt(np.mean(off**2)) < np.radians(0.1)
    # compression in blocks is counted in part only: the band is known to be somewhat narrow
    assert np.sqrt(np.mean((off / sigma) ** 2)) < 1.5
    assert back.interval == pytest.approx(0.02)


def test_what_is_no_video_is_refused(tmp_path: Path) -> None:
    (tmp_path / "no.avi").write_bytes(b"no video")
    with pytest.raises(errors.BadRecording, match="fewer than two"):
        track(tmp_path / "no.avi", rate=50.0)
    with pytest.raises(errors.BadRecording, match="There is no file"):
        track(tmp_path / "absent.avi")


def test_a_region_outside_the_picture_is_refused(tmp_path: Path) -> None:
    with pytest.raises(errors.BadSetting, match="within the picture"):
        track(clip(tmp_path / "run.avi", np.zeros(3)), roi=(100, 0, 150, 100))
