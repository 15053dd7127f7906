"""Processes that work for another one, and end with it however it ends."""

from __future__ import annotations

import multiprocessing
import os
import threading
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TypeVar

_Result = TypeVar("_Result")
OFTEN = 0.3  # limit: [s] between two looks at whether the parent lives


def unordered(function: Callable[..., _Result], calls: Iterable[Sequence[object]],
              number: int) -> Iterable[_Result]:
    """Results of a function in processes, as they come.

    Args:
        function: Of a module, so that a process can import it.
        calls: Arguments of each call.
        number: Of processes; 1 calls it here.
    """
    from joblib import Parallel, delayed, parallel_config

    with parallel_config("loky", initializer=begin, initargs=(os.getpid(),)):
        pool = Parallel(n_jobs=number, return_as="generator_unordered", batch_size=1)
    results: Iterable[_Result] = pool(delayed(function)(*call) for call in calls)
    return results


def begin(parent: int, settings: Mapping[str, str] | None = None) -> None:
    """What a worker does first: it watches its parent from now on, and ends when that is gone.

    A parent that is killed can tell nobody; a worker that waits for its next task would wait on.

    Args:
        parent: Number of the parent's process.
        settings: Environment variables to be set before libraries read them.
    """
    os.environ.update(settings or {})
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


def _end_with(parent: int) -> None:
    known = multiprocessing.parent_process()
    if os.name == "nt" and known is not None:
        known.join()  # Windows gives the number of a parent that is gone; joblib's know it there
    else:
        while os.getppid() == parent:
            time.sleep(OFTEN)
    os._exit(1)
