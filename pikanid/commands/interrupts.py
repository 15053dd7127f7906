"""An interrupt ends a command wherever it arrives."""

from __future__ import annotations

import _thread
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

AGAIN = 0.05  # limit: s after which an interrupt that was dropped is asked for again


@contextmanager
def none_lost() -> Iterator[None]:
    """Inside, an interrupt is asked for again where Python can only drop it.

    What is raised inside a finaliser or in Python code that compiled code calls cannot go up to
    the caller: Python hands it to `sys.unraisablehook` and goes on.
    """
    before, waiting = sys.unraisablehook, list[threading.Timer]()

    def hook(unraisable: sys.UnraisableHookArgs) -> None:
        if issubclass(unraisable.exc_type, KeyboardInterrupt):
            # not here: what is raised in the hook is dropped as well
            waiting.append(threading.Timer(AGAIN, _thread.interrupt_main))
            waiting[-1].start()
        else:
            before(unraisable)

    sys.unraisablehook = hook
    try:
        yield
    finally:
        sys.unraisablehook = before
        for timer in waiting:
            timer.cancel()


@contextmanager
def interrupted_by_kill() -> Iterator[None]:
    """Inside, a request to terminate is an interrupt, so that what is finished can be kept."""
    if threading.current_thread() is not threading.main_thread():
        yield  # only there can Python take signals
        return
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def became(failure: BaseException | None) -> bool:
    """Whether an interrupt became this failure: an import that it broke off raises its own.

    >>> try:
    ...     try:
    ...         raise KeyboardInterrupt
    ...     except BaseException:
    ...         raise ImportError("half a library")
    ... except ImportError as failure:
    ...     became(failure)
    True
    """
    while failure is not None:
        if isinstance(failure, KeyboardInterrupt):
            return True
        failure = failure.__cause__ or failure.__context__
    return False
