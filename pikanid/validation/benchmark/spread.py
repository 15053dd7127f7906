"""Trials spread over processes of this machine (joblib) or over a cluster (Dask distributed)."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from typing import Any

from pikanid import errors
from pikanid.storage.workers import unordered
from pikanid.validation.benchmark.trial import Outcome, Trial, run_packed

Task = tuple[bytes, tuple[Trial, ...]]
WAITING = 3  # limit: tasks that a worker of a cluster has at hand
PATIENCE = 10.0  # limit: [s] for a scheduler to answer


def here(tasks: Sequence[Task], workers: int) -> Generator[tuple[Outcome, ...], None, None]:
    """Outcomes as they come from processes of this machine.

    Raises:
        BadSetting: A process was ended from outside.
    """
    from joblib.externals.loky.process_executor import BrokenProcessPool

    try:
        yield from unordered(run_packed, tasks, workers)
    except BrokenProcessPool:
        raise errors.BadSetting(errors.workers_lost()) from None


def on_cluster(tasks: Sequence[Task], address: str) -> Generator[tuple[Outcome, ...], None, None]:
    """Outcomes as they come from the workers of a Dask scheduler.

    Raises:
        BadSetting: distributed is not installed, nobody answers at that address, there is no
            worker, or what a worker does there fails before a trial begins.
    """
    try:
        from distributed import Client, as_completed
    except ImportError:
        raise errors.BadSetting(errors.not_installed(
            "--scheduler", "distributed", "cluster")) from None
    try:
        client = Client(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as failure:
        raise errors.BadSetting(errors.no_scheduler(address, str(failure))) from None
    with client:
        cores = sum(client.ncores().values())
        if not cores:
            raise errors.BadSetting(errors.no_workers(address))
        rest = iter(tasks)
        first = [_sent(client, task) for _, task in zip(range(WAITING * cores), rest, strict=False)]
        running = as_completed(first, loop=client.loop)
        for future in running:
            try:
                yield future.result()
            except Exception as failure:  # a worker's, before or beside a trial: it may be anything
                raise errors.BadSetting(errors.cluster_failed(
                    address, f"{type(failure).__name__}: {failure}")) from None
            for task in rest:
                running.add(_sent(client, task))
                break


def _sent(client: Any, task: Task) -> Any:
    # Two tasks of one content are two tasks: nothing is remembered by the scheduler.
    return client.submit(run_packed, *task, pure=False)
