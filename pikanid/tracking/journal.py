"""What was found so far, on disk: a run that was stopped goes on where it was."""

from __future__ import annotations

import json
import math
import os
from dataclasses import astuple
from pathlib import Path
from typing import Any, TextIO

from pikanid import errors
from pikanid.tracking.marker import Place
from pikanid.tracking.surface import Surface
from pikanid.tracking.tracked import Seen


class Journal:
    """Lines of JSON: first what was asked, then one for each picture.

    Args:
        path: Of the file; nothing is written if None.
        asked: What the pictures depend on.  Lines of another question are not taken up.
        resume: Whether to go on behind the lines that are there; else they are begun anew.

    Raises:
        BadRecording: If the file cannot be written.
    """

    def __init__(self, path: Path | None, asked: dict[str, Any], resume: bool = True):
        self.path = path
        self.asked = json.loads(json.dumps(asked))
        self.found = _read(path, self.asked) if path is not None and resume else []
        self._file: TextIO | None = None
        if path is None:
            return
        try:
            self._file = path.open("w", encoding="utf-8")
            self._file.write(json.dumps(self.asked) + "\n")
            for seen in self.found:
                self._file.write(_line(seen))
            self._file.flush()
        except OSError as failure:
            raise errors.BadRecording(
                errors.cannot_write(str(path), failure.strerror or "")) from None

    def add(self, seen: Seen) -> None:
        """Keep one more."""
        if self._file is not None:
            self._file.write(_line(seen))
            if seen.number % 50 == 0:  # numerical: pictures between two writes to the system
                self._file.flush()

    def close(self, done: bool) -> None:
        """No more will come; what was done to the end needs no journal."""
        if self._file is None or self.path is None:
            return
        self._file.close()
        self._file = None
        if done:
            self.path.unlink(missing_ok=True)


def question(path: Path) -> dict[str, Any]:
    """What tells a video from another one: its place, size and date."""
    about = os.stat(path)
    return {"video": str(path.resolve()), "bytes": about.st_size, "changed": about.st_mtime_ns}


def _line(seen: Seen) -> str:
    s = seen.surface
    row = (seen.number, seen.time, s.theta, s.level, s.shape, s.variance, s.finer, s.gains,
           s.points, s.reason, seen.repeated,
           None if seen.place is None else astuple(seen.place))
    return json.dumps(row) + "\n"


def _read(path: Path, asked: dict[str, Any]) -> list[Seen]:
    found: list[Seen] = []
    try:
        lines = path.read_text("utf-8").splitlines()
        if not lines or json.loads(lines[0]) != asked:
            return []
    except (OSError, ValueError):
        return []
    for line in lines[1:]:
        try:
            row = json.loads(line)
            (number, time, theta, level, shape, variance, finer, gains, points, reason, again,
             place) = row
            seen = Seen(int(number), float(time), Surface(
                float(theta), float(level), tuple(map(float, shape)), float(variance),
                float(finer), tuple(map(float, gains)), float(points), str(reason)), bool(again),
                None if place is None else Place(*place))
        except (ValueError, TypeError):  # the line at which it was stopped
            break
        if not math.isfinite(seen.time):
            break
        found.append(seen)
    return found
