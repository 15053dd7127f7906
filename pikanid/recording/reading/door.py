"""Which format a file is of, by its ending and by its content, and the plain failures."""

from __future__ import annotations

import io
import os
import zipfile
from functools import partial
from pathlib import Path

from pikanid import errors
from pikanid.recording.formats import (
    FORMATS,
    GZIPPED,
    ZIP,
    Format,
    by_content,
    by_ending,
    read_endings,
)
from pikanid.storage.limits import file_bytes, gunzipped, unpacked_size


def opened(path: str | os.PathLike[str]) -> tuple[Format, bytes, str]:
    """The format of a file, its bytes (unpacked if gzipped text) and its stem.

    Raises:
        BadRecording: If it is missing, a folder that is no bag, empty, unreadable, of unknown
            ending, or something else than its ending says.
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
        return _gathered(file, str(path))
    told = by_ending(where)
    if told is None:
        raise errors.BadRecording(errors.unknown_ending(where, read_endings()))
    content = file_bytes(file, partial(_closed, where))
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


def _gathered(folder: Path, shown: str) -> tuple[Format, bytes, str]:
    """The format that keeps its files in a folder, these files as one archive, and its name."""
    for found in FORMATS:
        names = sorted(p.name for p in folder.iterdir() if found.members
                       and p.name.lower().endswith(found.members))
        if not names:
            continue
        packed = io.BytesIO()
        with zipfile.ZipFile(packed, "w") as archive:  # stored: nothing is compressed
            for name in names:
                archive.writestr(name, file_bytes(folder / name, partial(_closed, name)))
        return found, packed.getvalue(), folder.name or folder.resolve().name
    raise errors.BadRecording(errors.is_folder(shown))


def _closed(where: str, why: str) -> errors.BadRecording:
    return errors.BadRecording(errors.cannot_open(where, why))


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
