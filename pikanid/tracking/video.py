"""A video of a liquid's surface as a recording: an angle and its standard error for every frame."""

from __future__ import annotations

import os
from collections import Counter
from pathlib import Path

import numpy as np

from pikanid import errors
from pikanid.recording import Recording
from pikanid.tracking.surface import Surface, find


def track(path: str | os.PathLike[str], rate: float | None = None,
          roi: tuple[int, int, int, int] | None = None) -> Recording:
    """Read a video frame by frame; one picture at a time is held in memory.

    Channels of the result are ``theta`` [rad] with a sigma for each frame and ``level``, the
    surface's height at the middle above the region's lower edge, in pixels.  Frames that show no
    clear surface are NaN; the notes say how many and why, and whether the file ended early.

    Args:
        path: Of any video that OpenCV reads.
        rate: Frames per second; as the file says if None.
        roi: Left, top, width, height [px] of the inside of the tank; the whole picture if None.

    Raises:
        BadRecording: If the file is no video, or fewer than two frames show a surface.
        BadSetting: If the rate is not positive, the region lies outside the picture, or OpenCV is
            not installed.
    """
    try:
        import cv2
    except ImportError:
        raise errors.BadSetting(errors.not_installed("Video", "cv2", "video")) from None
    file = Path(path)
    if not file.is_file():
        raise errors.BadRecording(errors.no_file(str(file)))
    found: list[Surface] = []
    film = cv2.VideoCapture(str(file))
    try:
        stated = float(film.get(cv2.CAP_PROP_FPS)) if rate is None else rate
        promised = int(film.get(cv2.CAP_PROP_FRAME_COUNT))
        while True:
            there, picture = film.read()
            if not there:
                break
            left, top, width, height = roi or (0, 0, picture.shape[1], picture.shape[0])
            if (min(left, top) < 0 or min(width, height) < 1
                    or left + width > picture.shape[1] or top + height > picture.shape[0]):
                raise errors.BadSetting(errors.region_outside(roi, picture.shape[:2]))
            cut = picture[top:top + height, left:left + width]
            found.append(find(np.asarray(cut, np.uint8)))
    finally:
        film.release()
    if not np.isfinite(stated) or stated <= 0:
        raise errors.BadSetting(errors.bad_frame_rate(stated))
    failed = Counter(one.reason for one in found if one.reason)
    if len(found) - failed.total() < 2:
        raise errors.BadRecording(errors.no_surface(file.name, len(found), [*failed]))
    notes = [f"{count} of {len(found)} frames have no angle: {why}."
             for why, count in failed.items()]
    if promised > len(found):
        notes.append(f"The video ends after {len(found)} of {promised} frames; those were read.")
    made = Recording.from_arrays(
        np.arange(len(found)) / stated,
        {"theta": [one.theta for one in found], "level": [one.level for one in found]},
        {"theta": "rad"}, {"theta": [one.sigma for one in found]}, name=file.stem)
    return Recording(made.channels, made.name, tuple(notes))
