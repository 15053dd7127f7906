"""Parsers of other people, each in a process of its own.

On damaged bytes a parser may go round in circles, take all memory, crash the interpreter, or print
and leave files behind.  Here that ends a process which has nothing else to do: it gets the bytes,
a limit of time and memory and an empty folder, and answers with JSON and arrays of numbers.
"""

from __future__ import annotations

import json
import os
import struct
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from importlib import import_module
from typing import IO, TYPE_CHECKING, Any

from pikanid.storage.limits import MEBI

if TYPE_CHECKING:
    import numpy as np

LONGEST = 30.0  # limit: [s] that a small file may take
SECONDS_A_MEBI = 1.0  # limit: [s] that each MiB of a file may take besides
MOST_MEMORY = 4096 * MEBI  # limit: bytes of memory, beside a few times the size of the file
_COPIES = 6  # limit: times that a parser may hold what a file holds
_HEAD = struct.Struct("<Q")


class Ended(Exception):
    """The process took too long, took too much memory or crashed: the bytes are damaged, or worse.

    Attributes:
        late: Whether its time was up.
    """

    def __init__(self, late: bool) -> None:
        super().__init__("too slow" if late else "crashed")
        self.late = late


def run(function: str, content: bytes, options: Any,
        longest: float | None = None) -> tuple[Any, list[np.ndarray]]:
    """What ``function(content, options)`` returns: something that JSON holds, and arrays.

    Args:
        function: As ``package.module:name``.
        content: Bytes of the file.
        options: Something that JSON holds.
        longest: [s] that it may take; by the size of the content if None.

    Raises:
        Ended: If there is no answer.

    >>> run("pikanid.storage.apart:size", b"abc", None)[0]
    3
    """
    import numpy as np

    size = len(content)
    limit = LONGEST + SECONDS_A_MEBI * size / MEBI if longest is None else longest
    asked = json.dumps([function, options, MOST_MEMORY + _COPIES * size, os.getpid()]).encode()
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        places = {"PYTHONPATH": os.pathsep.join(filter(None, sys.path)), "TMPDIR": folder,
                  "TEMP": folder, "TMP": folder}
        try:
            done = subprocess.run(
                [sys.executable, "-P", "-W", "ignore", "-c",
                 "from pikanid.storage.apart import answer; answer()"],
                input=_HEAD.pack(len(asked)) + asked + content, stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL, timeout=limit, cwd=folder,
                env={**os.environ, **places}, check=False)
        except subprocess.TimeoutExpired:
            raise Ended(late=True) from None
    if done.returncode or len(done.stdout) < _HEAD.size:
        raise Ended(late=False)
    start = _HEAD.size + _HEAD.unpack_from(done.stdout)[0]
    about, lengths = json.loads(done.stdout[_HEAD.size:start])
    arrays, values = [], np.frombuffer(done.stdout, float, offset=start)
    for n in lengths:
        arrays.append(values[:n].copy())
        values = values[n:]
    return about, arrays


def size(content: bytes, options: Any) -> tuple[int, Sequence[np.ndarray]]:
    """How many bytes there are: the shortest answer."""
    return len(content), ()


def answer() -> None:
    """What the process does: one question in, one answer out."""
    import numpy as np

    from pikanid.storage.workers import begin

    out = _only_ours()
    size = _HEAD.unpack(sys.stdin.buffer.read(_HEAD.size))[0]
    function, options, memory, parent = json.loads(sys.stdin.buffer.read(size))
    begin(parent)
    _bound(memory)
    module, name = function.split(":")
    about, arrays = getattr(import_module(module), name)(sys.stdin.buffer.read(), options)
    head = json.dumps([about, [len(a) for a in arrays]]).encode()
    with out:
        out.write(_HEAD.pack(len(head)) + head)
        for array in arrays:
            out.write(np.ascontiguousarray(array, float).tobytes())
    # Threads and finalisers of parsers have nothing more to say.
    os._exit(0)


def _only_ours() -> IO[bytes]:
    """The standard output, from now on closed to what others print."""
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    return out


def _bound(memory: int) -> None:
    """No more than so many bytes of memory; Windows has no such limit."""
    try:
        import resource
    except ImportError:
        return
    _, most = resource.getrlimit(resource.RLIMIT_AS)
    wanted = memory if most == resource.RLIM_INFINITY else min(memory, most)
    resource.setrlimit(resource.RLIMIT_AS, (wanted, most))
