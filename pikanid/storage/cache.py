"""What took long to make, kept on disk: used again only where it is whole and the user's own.

An entry is one file: the SHA-256 of its name and content, then the content.  Its name is a digest
of everything that it was made from, of the versions of what made it, and of the processor, so that
an entry is never out of date, only unused.  One that is cut short, altered, exchanged for another,
a link, somebody else's or open to others for writing counts as absent: it is made anew and written
over.  Where nothing can be written, each process makes its own and holds it in memory.

The digest finds damage, not malice.  Against that stand the folder, which is the user's own and
closed to everybody else, and the owner of every file.  Entries are not flushed to the disk (fsync):
what a power failure leaves of one does not fit its digest.
"""

from __future__ import annotations

import functools
import hashlib
import os
import platform
import stat
import sys
import tempfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

_DIGEST = hashlib.sha256().digest_size
_OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH
# Neither follow a link nor wait for somebody to write into a pipe; Windows has neither flag.
_FLAGS = getattr(os, "O_NOFOLLOW", 0) | getattr(
    os, "O_NONBLOCK", 0)  # definition: of the operating system


def kept(name: str, make: Callable[[], bytes]) -> bytes:
    """The content of an entry; made, and kept if that is possible, where it is not there.

    Args:
        name: From `named`.
        make: Makes the content.
    """
    content = find(name)
    if content is None:
        content = make()
        keep(name, content)
    return content


def named(title: str, *parts: object) -> str:
    """The name of an entry that is made from `parts`, told apart by their `repr`.

    >>> named("model", "x' = -x") == named("model", "x' = -x") != named("model", "x' = x")
    True
    """
    text = repr((environment(), *parts))
    return f"{title}_{hashlib.sha256(text.encode()).hexdigest()[:32]}"


def find(name: str) -> bytes | None:
    """The content of an entry, or None where there is none to rely on."""
    folder = cache_folder()
    if folder is None:
        return None
    try:
        with open(folder / name, "rb", opener=_opened) as file:
            if not _reliable(os.fstat(file.fileno())):
                return None
            entry = file.read()
    except OSError:
        return None
    content = entry[_DIGEST:]
    return content if entry[:_DIGEST] == _digest(name, content) else None


def keep(name: str, content: bytes) -> None:
    """Write an entry as a whole; nothing happens where that is impossible.

    Several processes may write the same one at once: each renames a file of its own.
    """
    folder = cache_folder()
    if folder is None:
        return
    temporary = None
    try:
        handle, temporary = tempfile.mkstemp(dir=folder, prefix=f".{name}.")
        with os.fdopen(handle, "wb") as file:
            file.write(_digest(name, content) + content)
        os.replace(temporary, folder / name)
    except OSError:  # a full disk, say: the next process makes it again
        if temporary is not None:
            with suppress(OSError):
                os.unlink(temporary)


def cache_folder() -> Path | None:
    """The folder of the entries: the user's own, closed to others; None where there can be none.

    It lies below the environment variable PIKANID_CACHE, else in the user's cache folder, else in
    that of temporary files.
    """
    import platformdirs

    wanted = os.environ.get("PIKANID_CACHE") or platformdirs.user_cache_dir("pikanid")
    fallback = Path(tempfile.gettempdir()) / f"pikanid-{'own' if _user() is None else _user()}"
    return _folder(Path(wanted).absolute() / "compiled", fallback)


@functools.lru_cache(maxsize=8)
def _folder(*candidates: Path) -> Path | None:
    return next(filter(own_folder, candidates), None)


def own_folder(folder: Path) -> bool:
    """Make a folder that is the user's own and closed to others; False where that is impossible.

    A link is not followed, and what belongs to somebody else is left alone.
    """
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with suppress(FileExistsError):
            folder.mkdir(mode=0o700)
        found = folder.lstat()
        if not stat.S_ISDIR(found.st_mode) or _user() not in (None, found.st_uid):
            return False
        if stat.S_IMODE(found.st_mode) & 0o777 != 0o700:
            folder.chmod(0o700)
    except (OSError, ValueError):
        return False
    return os.access(folder, os.W_OK | os.X_OK)


def environment() -> tuple[object, ...]:
    """What compiled code depends on beside its source."""
    return *_versions(), *processor()


def processor() -> tuple[str, str, str]:
    """Triple, name and features of what is compiled for: this machine's, or as numba is told.

    Numba is told by the environment variables NUMBA_CPU_NAME and NUMBA_CPU_FEATURES.
    """
    from numba.core.registry import cpu_target

    triple, name, features = cpu_target.target_context.codegen().magic_tuple()
    return triple, name, features


@functools.cache
def sources(*files: Path) -> str:
    """The digest of the text of source files, whatever their line endings."""
    return hashlib.sha256("".join(f.read_text("utf-8") for f in files).encode()).hexdigest()


@functools.cache
def _versions() -> tuple[str, ...]:
    import llvmlite
    import numba
    import numpy

    return (sys.version, platform.system(), platform.machine(), numba.__version__,
            llvmlite.__version__, numpy.__version__)


def _user() -> int | None:
    """The user's number, where the system has such."""
    number: Callable[[], int] | None = getattr(os, "getuid", None)
    return None if number is None else number()


def _opened(path: str, flags: int) -> int:
    return os.open(path, flags | _FLAGS)


def _reliable(status: os.stat_result) -> bool:
    if _user() is None:
        return stat.S_ISREG(status.st_mode)
    return (stat.S_ISREG(status.st_mode) and status.st_uid == _user()
            and not status.st_mode & _OTHERS_WRITE)


def _digest(name: str, content: bytes) -> bytes:
    return hashlib.sha256(name.encode() + b"\0" + content).digest()
