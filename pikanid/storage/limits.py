"""Bytes of files, and what is packed in them: never more than a stated amount of memory.

A file of a few kilobytes can unpack to gigabytes, a name can lead to a pipe that never ends, and a
list of empty tables takes twenty times the memory of its text.
"""

from __future__ import annotations

import io
import json
import os
import stat
import struct
import zipfile
import zlib
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from pikanid import errors

if TYPE_CHECKING:
    import numpy as np

MEBI = 2**20  # definition: bytes in a mebibyte
MOST_MODEL = 2 * MEBI  # limit: bytes of a model file
MOST_JSON = 512 * MEBI  # limit: bytes of an estimate, a network, a truth or a diagnosis, unpacked
MOST_UNPACKED = 512 * MEBI  # limit: bytes that a compressed recording may unpack to
MOST_PARSED = 768 * MEBI  # limit: bytes that the objects in a JSON file may take

# What the parsers of other people raise on damaged bytes: they promise no closed list.
DAMAGE: tuple[type[Exception], ...] = (
    ValueError, TypeError, LookupError, AttributeError, ArithmeticError, AssertionError, OSError,
    EOFError, RuntimeError, NameError, MemoryError, SyntaxError, BufferError, struct.error,
    zlib.error, zipfile.BadZipFile,
)  # fmt: skip

Wrong = Callable[[str], errors.PikanidError]


def file_bytes(path: str | os.PathLike[str], wrong: Wrong, most: int | None = None,
               first: int = -1) -> bytes:
    """The content of a regular file.

    Args:
        path: Of the file.
        wrong: Makes the exception from what is wrong, such as ``"it is a folder"``.
        most: Size of the largest file that is read; None for any.
        first: Bytes that are wanted of it; all if negative.

    Raises:
        PikanidError: If it is missing, no regular file (a pipe may never end), or too large.
    """
    if not isinstance(path, str | os.PathLike):
        raise wrong(errors.detail_no_path(type(path).__name__))
    try:
        with open(path, "rb", opener=_without_waiting) as file:
            about = os.fstat(file.fileno())
            if not stat.S_ISREG(about.st_mode):
                raise wrong("it is no regular file")
            if most is not None and about.st_size > most:
                raise wrong(errors.detail_too_large(about.st_size, most))
            return file.read(first)
    except OSError as failure:
        raise wrong(failure.strerror or "it cannot be opened") from None
    except ValueError:  # a NUL in the name
        raise wrong("there is no file of that name") from None


def _without_waiting(path: str, flags: int) -> int:
    """Open a pipe without waiting for its writer."""
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))


def gunzipped(content: bytes, wrong: Wrong, most: int | None = None) -> bytes:
    """What a gzip file holds, all of its members.

    Raises:
        PikanidError: If it is damaged, or unpacks to more than `most` bytes, which are
            `MOST_UNPACKED` if None.
    """
    most = MOST_UNPACKED if most is None else most
    parts, rest, room = [], content, most
    try:
        while rest:
            unpacker = zlib.decompressobj(wbits=31)
            parts.append(unpacker.decompress(rest, room + 1))
            room -= len(parts[-1])
            if room < 0:
                raise wrong(errors.detail_unpacks(most))
            if not unpacker.eof:
                raise wrong("it is damaged or cut off")
            rest = unpacker.unused_data.lstrip(b"\0")  # padding, as of tapes
    except zlib.error:
        raise wrong("it is damaged or cut off") from None
    return b"".join(parts)


def toml_content(path: str | os.PathLike[str], wrong: Wrong) -> dict[str, Any]:
    """The content of a TOML file.

    Raises:
        PikanidError: If it is missing, too large, or no TOML.
    """
    import tomllib

    try:
        return tomllib.loads(file_bytes(path, wrong, MOST_MODEL).decode("utf-8"))
    except UnicodeDecodeError:
        raise wrong("it is not text") from None
    except (ValueError, RecursionError) as problem:  # also an integer of thousands of digits
        detail = str(problem) or "it is nested too deep"
        if detail.startswith("Invalid value"):
            detail += '; text, as a formula or a unit, stands in quotes: x = "-k*x"'
        raise wrong(detail) from None


def json_content(path: str | os.PathLike[str], wrong: Wrong) -> Any:
    """The content of a JSON file, gzipped or not.

    Raises:
        PikanidError: If it is missing, too large, damaged, or no JSON.
    """
    content = file_bytes(path, wrong, MOST_JSON)
    if content[:2] == b"\x1f\x8b":
        content = gunzipped(content, wrong, MOST_JSON)
    return parsed(content, wrong)


def parsed(content: bytes, wrong: Wrong) -> Any:
    """JSON text as Python's objects, once it is known that these fit into `MOST_PARSED`.

    Raises:
        PikanidError: If it is no JSON, nested without end, or would take more memory.
    """
    # What CPython takes for a number, an entry of a table, a list and a table.
    needed = len(content) + 64 * content.count(b",") + 110 * content.count(b":") + (
        64 * content.count(b"[") + 250 * content.count(b"{"))
    if needed > MOST_PARSED + len(content):
        raise wrong(errors.detail_memory(MOST_PARSED))
    try:
        return json.loads(content)
    except (ValueError, RecursionError):
        raise wrong("it is no JSON") from None


def unpacked_size(content: bytes, wrong: Wrong, most: int | None = None) -> int:
    """Bytes of all members of a ZIP archive (.npz, .xlsx), which it states and cannot exceed.

    Args:
        content: Of the file.
        wrong: Makes the exception from what is wrong.
        most: Bytes; `MOST_UNPACKED` if None.

    Raises:
        PikanidError: If it is no archive, or these are more than `most`.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            size = sum(member.file_size for member in archive.infolist())
    except (zipfile.BadZipFile, ValueError, NotImplementedError, LookupError, OSError, EOFError):
        raise wrong("it is damaged or cut off") from None
    most = MOST_UNPACKED if most is None else most
    if size > most:
        raise wrong(errors.detail_unpacks(most))
    return size


def archived(content: bytes, wrong: Wrong, most: int | None = None) -> dict[str, np.ndarray]:
    """The arrays of an NPZ archive; pickled objects are refused.

    Raises:
        PikanidError: If it is damaged, holds objects, or unpacks to more than `most` bytes.
    """
    import numpy as np

    unpacked_size(content, wrong, most)
    found = {}
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            for name in archive.namelist():
                member = archive.read(name)
                if not member.startswith(np.lib.format.MAGIC_PREFIX):
                    continue
                # Its header states a shape, for which NumPy asks memory before it looks further.
                if _stated_size(member) > len(member):
                    raise wrong("it is damaged or cut off")
                found[name.removesuffix(".npy")] = np.lib.format.read_array(
                    io.BytesIO(member), allow_pickle=False)
    except DAMAGE:
        raise wrong("it is damaged, or holds what are no plain arrays") from None
    return found


def _stated_size(member: bytes) -> int:
    """Bytes that the values of an array take by its header."""
    import math

    import numpy as np

    file = io.BytesIO(member)
    version = np.lib.format.read_magic(file)
    read = (np.lib.format.read_array_header_1_0 if version == (1, 0)
            else np.lib.format.read_array_header_2_0)
    shape, _, dtype = read(file)
    return math.prod(shape) * dtype.itemsize
