"""The one way in which results become files: whole or not at all, and those of one run together.

A file is written beside its place under another name, flushed to the disk (fsync), and renamed:
nobody ever reads half of it, and a power failure leaves the old one or the new one.  That costs
some milliseconds a file, little against what a result took to compute; the cache, whose entries
are checked before they are used, does without.

Files of one run are all written before the first is renamed.  A full disk, a closed folder or an
interrupt then changes none of them; only a kill within the microseconds between two renames could.
A kill while they are written leaves hidden files (`STAGED`) that nobody reads.
"""

from __future__ import annotations

import errno
import os
import secrets
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import TypeVar

from pikanid import errors

STAGED = ".*.part"  # what a file is called before it has its name
_Path = TypeVar("_Path", bound=str | os.PathLike[str])


def atomically(path: str | os.PathLike[str], content: bytes, private: bool = False) -> None:
    """Replace a file as a whole; see `together`."""
    together({path: content}, private)


def together(files: Mapping[_Path, bytes], private: bool = False) -> None:
    """Write or replace several files, all or none.

    Args:
        files: Path -> content.
        private: Whether only the user may read them; else permissions are as of any new file.

    Raises:
        BadRecording: If a folder is missing or a place cannot be written to.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     together({Path(folder) / "a.json": b"{}", Path(folder) / "a.svg": b"<svg/>"})
    ...     sorted(os.listdir(folder))
    ['a.json', 'a.svg']
    """
    staged: list[tuple[Path, Path]] = []
    path = Path()
    try:
        for path, content in ((Path(p), c) for p, c in files.items()):
            if path.is_dir():
                raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
            staged.append((path.with_name(f".{path.name}.{secrets.token_hex(4)}.part"), path))
            _write(staged[-1][0], content, 0o600 if private else 0o666)
        for temporary, path in staged:
            os.replace(temporary, path)
    except OSError as failure:
        raise errors.BadRecording(errors.cannot_write(str(path), failure.strerror or "")) from None
    finally:
        for temporary, _ in staged:
            with suppress(OSError):
                temporary.unlink()


def finished(staged: Path, path: Path) -> None:
    """Give a file that a library has written piece by piece beside it its name."""
    os.replace(staged, path)


def _write(path: Path, content: bytes, mode: int) -> None:
    # The system takes the user's mask from the mode, which Python could only ask for by setting it.
    with open(path, "xb", opener=lambda name, flags: os.open(name, flags, mode)) as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())
