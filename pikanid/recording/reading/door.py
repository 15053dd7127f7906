"""Which format a file is of, by its ending and by its content, and the plain failures."""

from __future__ import annotations

import os
from pathlib import Path

from pikanid import errors
from pikanid.recording.formats import GZIPPED, ZIP, Format, by_content, by_ending, read_endings
from pikanid.storage.limits import file_bytes, gunzipped, unpacked_size


def opened(path: str | os.PathLike[str]) -> tuple[Format, bytes, str]:
    """The format of a file, its bytes (unpacked if gzipped text) and its stem.

    Raises:
        BadRecording: If it is missing, a directory, empty, unreadable, of unknown ending, or
            something else than its ending says.
    """
    if not isinstance(path, str | os.PathLike):
        raise errors.BadRecording(errors.no_path(type(path).__name__))
    file = Path(path)
    where = file.name or str(path)
    try:
        missing, folder = not file.exists(), file.is_dir()
    except (ValueError, OSError):  # a NUL in the name, a name that is too long
        missing, folder = True, False
    if missing:
        raise errors.BadRecording(errors.no_file(str(path)))
    if folder:
        raise errors.BadRecording(errors.is_folder(str(path)))
    told = by_ending(where)
    if told is None:
        raise errors.BadRecording(errors.unknown_ending(where, read_endings()))
    content = file_bytes(file, lambda why: errors.BadRecording(errors.cannot_open(where, why)))
    if content and told.packed and by_content(content) is GZIPPED:
        content = gunzipped(content, lambda why: errors.BadRecording(
            errors.cannot_unpack(where, why)))
    if not content:
        raise errors.BadRecording(errors.empty_file(where))
    found = _checked(told, content, where)
    if content.startswith(ZIP):
        unpacked_size(content, lambda why: errors.BadRecording(errors.cannot_unpack(where, why)))
    stem = Path(file.stem).stem if file.suffix.lower() == ".gz" else file.stem
    return found, content, stem or where


def _checked(told: Format, content: bytes, where: str) -> Format:
    """The format of a file that calls itself `told`."""
    if told.recognised and told.recognised(content):
        return told
    actual = by_content(content)
    if actual is None and told.recognised is None:
        return told
    if actual is None:
        raise errors.BadRecording(errors.damaged(where, told.name))
    if actual.file == told.file:
        return actual  # Excel itself opens old and new workbooks under both endings
    raise errors.BadRecording(errors.wrong_ending(where, actual.name, told.name))
