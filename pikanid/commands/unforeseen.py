"""What the command line says of a failure that nobody foresaw."""

from __future__ import annotations

import shlex
import traceback
from collections.abc import Sequence
from pathlib import Path

from pikanid import errors

DEBUG = "--debug"
_ROOT = Path(__file__).parents[1]  # definition: folder above the package


def without_debug(words: Sequence[str]) -> tuple[list[str], bool]:
    """The words of a command line without ``--debug``, and whether it was among them.

    It is taken wherever it stands, so that it can be put behind a command that has failed; behind
    ``--`` it is a word like any other.

    >>> without_debug(["identify", "run.csv", "--debug", "--", "--debug"])
    (['identify', 'run.csv', '--', '--debug'], True)
    """
    end = words.index("--") if "--" in words else len(words)
    kept = [word for word in words[:end] if word != DEBUG]
    return [*kept, *words[end:]], len(kept) < end


def sentence(failure: BaseException, words: Sequence[str]) -> str:
    """One sentence: what was being done and on which files, what failed where, how to report it.

    Args:
        failure: What was raised.
        words: Of the command line, without the program's name.
    """
    frames = traceback.extract_tb(failure.__traceback__)
    own = [frame for frame in frames if _ROOT in Path(frame.filename).parents]
    place = ""
    if own:
        place = f" ({Path(own[-1].filename).relative_to(_ROOT)}, line {own[-1].lineno})"
    told = ": ".join([type(failure).__name__, *filter(None, [str(failure)])]).rstrip(".")
    return errors.unforeseen(shlex.join(["pikanid", *words]), told, place)
