"""Where tables and progress go, and how plain they have to be.

A terminal gets colours and progress bars.  A pipe, a file, ``NO_COLOR`` or a dumb terminal gets
plain text, without a single escape sequence, and no progress.
"""

from __future__ import annotations

import logging
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Protocol, TextIO

from pikanid.pieces.sheet import sentence

if TYPE_CHECKING:
    from rich.console import Console

# Nothing wraps a line that is read by a program.
PIPE_WIDTH = 400  # layout: characters of a line


def console(stream: TextIO | None = None) -> Console:
    """A console on a stream (standard output by default), as colourful as it may be.

    >>> import io
    >>> text = io.StringIO()
    >>> console(text).print("[bold]plain[/bold]")
    >>> text.getvalue()
    'plain\\n'
    """
    from rich.console import Console

    file = sys.stdout if stream is None else stream
    lively = file.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"
    return Console(file=file, color_system="auto" if lively else None,
                   force_terminal=None if lively else False, no_color=not lively,
                   width=None if file.isatty() else PIPE_WIDTH, highlight=False, emoji=False)


def complain(text: str) -> None:
    """One sentence on standard error."""
    print(f"Error: {sentence(text)}", file=sys.stderr)


class Step(Protocol):
    """Tells what is being done."""

    def __call__(self, text: str, within: bool = False) -> None:
        """The next step begins, or, `within` it, how far it is."""


@contextmanager
def working(description: str, total: int, quiet: bool = False) -> Iterator[Step]:
    """A progress bar on standard error while something runs; nothing where nobody watches.

    Yields a function that names the next step and counts the last one as done.

    >>> with working("fitting", 2) as step:
    ...     step("nls")
    """
    screen = console(sys.stderr)
    if quiet or not screen.is_terminal:
        yield lambda text, within=False: None
        return
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = (SpinnerColumn(), TextColumn("{task.description}"), BarColumn(),
               TextColumn("{task.completed}/{task.total}"), TimeElapsedColumn())
    with Progress(*columns, console=screen, transient=True) as progress:
        task = progress.add_task(description, total=total)
        started = False

        def step(text: str, within: bool = False) -> None:
            nonlocal started
            progress.update(task, description=f"{description}: {sentence(text)}",
                            advance=1 if started and not within else 0)
            started = True

        with _told(step):
            yield step


@contextmanager
def _told(step: Step) -> Iterator[None]:
    """What the package logs meanwhile, such as that it compiles, is shown as part of the step."""
    class Shown(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            step(record.getMessage(), within=True)

    log, handler = logging.getLogger("pikanid"), Shown(logging.INFO)
    before = log.level
    log.addHandler(handler)
    log.setLevel(min(before or logging.INFO, logging.INFO))
    try:
        yield
    finally:
        log.removeHandler(handler)
        log.setLevel(before)
