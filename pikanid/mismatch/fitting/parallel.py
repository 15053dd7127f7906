"""Work side by side that comes out as if it had been done one piece after the other."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

Job = TypeVar("Job")
State = TypeVar("State")
Result = TypeVar("Result")


AHEAD = 4  # numerical: jobs a thread that are begun; no result depends on it


def threads(workers: int | None, useful: int) -> int:
    """How many threads to use; by default as there are cores, and at most what is useful."""
    if workers is not None:
        return workers
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return min(cores or 1, useful)


@contextlib.contextmanager
def blas_on_one_thread() -> Iterator[None]:
    """Within, each product of matrices is made by the thread that asks for it.

    Matrices of a diagnosis are small: threads of a library beside one's own wait more than they
    work, and sums come out in another order on another machine.
    """
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1, "blas"):
        yield


def side_by_side(jobs: Sequence[Job], work: Callable[[Job], Result], workers: int) -> list[Result]:
    """What independent jobs give, in their order; of several failures the first one is raised.

    >>> side_by_side([1, 2, 3], lambda job: job**2, 2)
    [1, 4, 9]
    """
    if workers == 1 or len(jobs) < 2:
        return [work(job) for job in jobs]
    with ThreadPoolExecutor(min(workers, len(jobs))) as pool:
        return list(pool.map(work, jobs))


def ordered_parallel_map(
        jobs: Sequence[Job], state: Callable[[], State], work: Callable[[Job, State], Result],
        take: Callable[[Job, Result], None], go_on: Callable[[], bool], workers: int,
        stands: Callable[[Result, State], bool] = lambda result, state: False) -> None:
    """Work on jobs and take their results in order, while `go_on()`.

    What a job gives may depend on a state that taking earlier results changes.  Later jobs are
    begun ahead with the state as it is, and once more where it has changed when their turn comes
    and what they gave no longer stands: the outcome is that of one worker, for any number of them.

    Args:
        jobs: In the order in which they would be done alone.
        state: What jobs depend on, at the moment; compared by ==.
        work: Runs in any thread; changes nothing.
        take: Runs in the caller's thread.
        go_on: Asked before each job.
        workers: Threads; with one, everything runs in the caller's.
        stands: Whether a result is what the job would give in another state, too.

    >>> best = [9]
    >>> ordered_parallel_map([5, 7, 2], lambda: best[0], lambda job, least: min(job, least),
    ...         lambda job, result: best.__setitem__(0, result), lambda: True, 2)
    >>> best
    [2]
    """
    if workers == 1 or len(jobs) < 2:
        for job in jobs:
            if not go_on():
                return
            take(job, work(job, state()))
        return
    begun: dict[int, tuple[State, Future[Result]]] = {}
    pool = ThreadPoolExecutor(workers)
    try:
        for k, job in enumerate(jobs):
            if not go_on():
                return
            now = state()
            for ahead in range(k, min(k + AHEAD * workers, len(jobs))):
                if ahead not in begun or (begun[ahead][0] != now and begun[ahead][1].cancel()):
                    begun[ahead] = now, pool.submit(work, jobs[ahead], now)
            before, future = begun.pop(k)
            good = before == now or (future.exception() is None and stands(future.result(), now))
            take(job, future.result() if good else work(job, now))
    finally:
        pool.shutdown(cancel_futures=True)
