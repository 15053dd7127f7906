"""A rendered motion as a video file."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from pikanid import errors
from pikanid.tracking.render.scene import Scene
from pikanid.tracking.render.stage import Stage

# definition: what OpenCV writes without further libraries: Motion JPEG, MPEG-4 part 2, lossless
CODECS = {"mjpg": ("MJPG", ".avi"), "mp4v": ("mp4v", ".mp4"), "ffv1": ("FFV1", ".avi")}


def write(path: str | os.PathLike[str], surfaces: Iterable[float | ArrayLike],
          scene: Scene | None = None, rate: float = 100.0, codec: str | None = None,
          quality: float = 95.0, seed: int = 0,
          motion: Iterable[tuple[float, float]] | None = None) -> Path:
    """Draw one picture after the other and write them as a video.

    Args:
        path: Ends in .avi or .mp4.
        surfaces: An angle [rad] or heights for every frame: see `Stage.picture`.
        scene: What is shown.
        rate: Frames per second.
        codec: "mjpg", "mp4v" or "ffv1" (lossless); by the ending if None.
        quality: Of Motion JPEG, from 1 to 100.
        seed: Of the sensor's noise.
        motion: How far the tank has moved (x, y) [px] in every frame, as far as surfaces go; at
            rest if None.

    Raises:
        BadSetting: If ending or codec is unknown, or OpenCV is not installed.
        BadRecording: If the file cannot be written.
    """
    try:
        import cv2
    except ImportError:
        raise errors.BadSetting(errors.not_installed("Video", "cv2", "video")) from None
    file = Path(path)
    codec = codec or ("mp4v" if file.suffix.lower() == ".mp4" else "mjpg")
    if codec not in CODECS or file.suffix.lower() != CODECS[codec][1]:
        raise errors.BadSetting(errors.unknown_codec(str(file), codec, CODECS))
    stage = Stage(scene or Scene())
    height, width = stage.scene.size
    rng = np.random.default_rng(seed)
    # of OpenCV's own writer the quality can be set
    backend = cv2.CAP_OPENCV_MJPEG if codec == "mjpg" else cv2.CAP_FFMPEG
    film = cv2.VideoWriter(str(file), backend, cv2.VideoWriter.fourcc(*CODECS[codec][0]), rate,
                           (width, height))
    if not film.isOpened():
        raise errors.BadRecording(errors.cannot_write(str(file), "OpenCV opens no video there"))
    try:
        film.set(cv2.VIDEOWRITER_PROP_QUALITY, quality)
        moved = None if motion is None else iter(motion)
        for number, surface in enumerate(surfaces):
            if moved is not None:
                stage = stage.at(*next(moved))
            film.write(np.ascontiguousarray(stage.picture(surface, rng, number)[..., ::-1]))
    finally:
        film.release()
    return file
