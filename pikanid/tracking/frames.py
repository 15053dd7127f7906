"""Pictures of a video or of a folder, one after the other, with their times."""

from __future__ import annotations

import os
import re
from collections.abc import Generator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from pikanid import errors
from pikanid.tracking.colours import Picture

IMAGES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp")
FASTEST = 1e6  # limit: pictures a second that a camera takes


@dataclass(frozen=True)
class Frame:
    """One picture.

    Attributes:
        number: Its place in the video, or the number in its file's name.
        time: In seconds.
        picture: (H, W, 3), BGR; None where it could not be read.
    """

    number: int
    time: float
    picture: Picture | None


@dataclass(frozen=True)
class Film:
    """A video that can be read from its start on, any number of times.

    Attributes:
        path: Of the file or the folder.
        rate: Pictures per second.
        promised: How many the file says it has; 0 if it does not say.
        size: Height and width [px].
        stretch: Seconds of the recording for each second of the file.
        files: Of a folder.
    """

    path: Path
    rate: float
    promised: int
    size: tuple[int, int]
    stretch: float = 1.0
    files: tuple[Path, ...] = ()

    def frames(self, skip: int = 0) -> Generator[Frame, None, None]:
        """The pictures, one at a time in memory, without the first `skip`."""
        if self.files:
            yield from self._of_folder(skip)
            return
        film = _opened(self.path)
        try:
            number = 0
            while film.grab():
                if number >= skip:
                    # the stamp of the picture just taken; containers without stamps say 0
                    stamp = float(film.get(_cv2().CAP_PROP_POS_MSEC)) / 1e3 * self.stretch
                    there, picture = film.retrieve()
                    time = stamp if stamp > 0 or number == 0 else number / self.rate
                    yield Frame(number, time, _coloured(picture) if there else None)
                number += 1
        finally:
            film.release()

    def _of_folder(self, skip: int) -> Generator[Frame, None, None]:
        numbers = numbered(self.files)
        for k, file in enumerate(self.files):
            if k >= skip:
                picture = _cv2().imread(str(file), _cv2().IMREAD_COLOR)
                if picture is not None and picture.shape[:2] != self.size:
                    picture = None
                yield Frame(numbers[k], (numbers[k] - numbers[0]) / self.rate,
                            None if picture is None else np.asarray(picture, np.uint8))


def open_film(path: str | os.PathLike[str], rate: float | None = None) -> Film:
    """A video that OpenCV reads, or a folder of images in the order of the numbers in their names.

    Args:
        path: Of the file or folder.
        rate: Pictures per second; as the file says if None.

    Raises:
        BadRecording: If there is no file, or no picture in it.
        BadSetting: If the rate is missing or not positive, or OpenCV is not installed.
    """
    if rate is not None and not 0 < rate < FASTEST:
        raise errors.BadSetting(errors.bad_frame_rate(rate))
    place = Path(path)
    if place.is_dir():
        return _folder(place, rate)
    if not place.is_file():
        raise errors.BadRecording(errors.no_file(str(place)))
    film = _opened(place)
    try:
        there, picture = film.read()
        stated = float(film.get(_cv2().CAP_PROP_FPS))
        promised = int(film.get(_cv2().CAP_PROP_FRAME_COUNT))
    finally:
        film.release()
    if not there:
        raise errors.BadRecording(errors.no_video(place.name))
    if rate is None and not 0 < stated < FASTEST:
        raise errors.BadSetting(errors.bad_frame_rate(stated))
    stretch = 1.0 if rate is None or not 0 < stated < FASTEST else stated / rate
    return Film(place, stated if rate is None else rate, max(promised, 0), picture.shape[:2],
                stretch)


def numbered(files: tuple[Path, ...]) -> list[int]:
    """The last number in each name; places in the list where names have none, or share one.

    >>> numbered((Path("a_7.png"), Path("a_9.png"))), numbered((Path("a.png"), Path("b.png")))
    ([7, 9], [0, 1])
    """
    found = [re.findall(r"\d+", file.stem) for file in files]
    numbers = [int(f[-1][-15:]) for f in found if f]
    rising = len(numbers) == len(files) and all(
        a < b for a, b in pairwise(numbers))
    return numbers if rising else list(range(len(files)))


def _folder(place: Path, rate: float | None) -> Film:
    files = [f for f in place.iterdir() if f.suffix.lower() in IMAGES]
    if not files:
        raise errors.BadRecording(errors.no_video(place.name))
    if rate is None:
        raise errors.BadSetting(errors.rate_of_images(place.name))
    files.sort(key=lambda f: [int(p) if p.isdigit() else p for p in re.split(r"(\d+)", f.name)])
    first = _cv2().imread(str(files[0]), _cv2().IMREAD_COLOR)
    if first is None:
        raise errors.BadRecording(errors.no_video(files[0].name))
    return Film(place, rate, len(files), first.shape[:2], 1.0, tuple(files))


def _coloured(picture: Any) -> Picture:
    shown = np.asarray(picture, np.uint8)
    return shown if shown.ndim == 3 else np.repeat(shown[..., None], 3, axis=2)


def _opened(path: Path) -> Any:
    film = _cv2().VideoCapture(str(path), _cv2().CAP_FFMPEG)
    if not film.isOpened():
        film = _cv2().VideoCapture(str(path))
    if not film.isOpened():
        raise errors.BadRecording(errors.no_video(path.name))
    return film


def _cv2() -> Any:
    try:
        import cv2
    except ImportError:
        raise errors.BadSetting(errors.not_installed("Video", "cv2", "video")) from None
    return cv2
