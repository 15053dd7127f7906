"""Tracking the surface in 300 frames of 640 x 480 pixels beside decoding them with OpenCV alone."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest
from tracking_grid import Scene, swing, write

from pikanid.tracking import track

cv2 = pytest.importorskip("cv2")
ENDINGS = {"mjpg": "avi", "mp4v": "mp4", "ffv1": "avi"}
FRAMES = 300
# times as long as decoding alone: a frame of Motion JPEG takes OpenCV some 1.4 ms, one of a still
# scene in MPEG-4 a fourth of that, one without loss 20 ms
WORST = {"mjpg": 4.0, "mp4v": 11.0, "ffv1": 1.5}


@pytest.fixture(scope="module", params=sorted(ENDINGS))
def clip(request, tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("clips") / f"{request.param}.{ENDINGS[request.param]}"
    return write(path, swing(FRAMES), Scene(), codec=request.param)


def decode(path: Path) -> int:
    film, count = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG), 0
    while film.read()[0]:
        count += 1
    film.release()
    return count


def seconds(work, path: Path) -> float:
    begun = time.process_time()
    work(path)
    return time.process_time() - begun


def test_track(benchmark, clip: Path) -> None:
    benchmark.group = f"Surface in {FRAMES} frames of 640 x 480, {clip.stem}"
    found = benchmark.pedantic(track, (clip,), warmup_rounds=1, rounds=3)
    benchmark.extra_info["frames/s"] = round(FRAMES / benchmark.stats.stats.median)
    assert np.count_nonzero(np.isfinite(found.theta)) == FRAMES


def test_opencv_decoding_alone(benchmark, clip: Path) -> None:
    benchmark.group = f"Surface in {FRAMES} frames of 640 x 480, {clip.stem}"
    benchmark.extra_info["reference"] = True
    assert benchmark.pedantic(decode, (clip,), warmup_rounds=1, rounds=3) == FRAMES
    benchmark.extra_info["frames/s"] = round(FRAMES / benchmark.stats.stats.median)


def test_tracking_takes_few_times_as_long_as_decoding(clip: Path) -> None:
    """Both in one run, in turn, by the time of the processor: the best of three of each."""
    track(clip)  # imports
    pairs = [(seconds(track, clip), seconds(decode, clip)) for _ in range(3)]
    ours, decoding = (min(column) for column in zip(*pairs, strict=True))
    assert ours <= WORST[clip.stem] * decoding
