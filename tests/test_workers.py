"""Processes that work for another one end with it, even if it is killed."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from pikanid.storage.workers import begin, unordered

PARENTS = {
    "joblib": "from pikanid.storage.workers import unordered\n"
              "list(unordered(waits, [(folder,)] * 2, 2))",
    "a pool": "import multiprocessing\n"
              "with multiprocessing.get_context('spawn').Pool(2, begin, (os.getpid(),)) as pool:\n"
              "    pool.starmap(waits, [(folder,)] * 2)",
}


def waits(folder: str) -> None:
    """A task: says who works on it, and does not end."""
    Path(folder, str(os.getpid())).touch()
    time.sleep(100)


def alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    stat = Path(f"/proc/{process}/stat")
    return not stat.exists() or stat.read_text().rpartition(")")[2].split()[0] != "Z"


def until(said: object) -> None:
    """Wait for what has to come; a minute is for machines that do much else."""
    for _ in range(600):
        if said():  # type: ignore[operator]
            return
        time.sleep(0.1)
    pytest.fail("it has not come")


@pytest.mark.parametrize("kind", PARENTS)
def test_workers_end_with_a_parent_that_is_killed(kind: str, tmp_path: Path) -> None:
    code = (f"import os, sys\nfolder = {str(tmp_path)!r}\n"
            "from pikanid.storage.workers import begin\n"
            f"from test_workers import waits\n{PARENTS[kind]}")
    path = os.pathsep.join([str(Path(__file__).parent), *sys.path])
    parent = subprocess.Popen([sys.executable, "-c", code], env={**os.environ, "PYTHONPATH": path})
    try:
        until(lambda: len(list(tmp_path.iterdir())) == 2)
    finally:
        parent.send_signal(signal.SIGKILL)
        parent.wait()
    workers = [int(path.name) for path in tmp_path.iterdir()]
    try:
        until(lambda: not any(map(alive, workers)))
    finally:
        for worker in filter(alive, workers):
            os.kill(worker, signal.SIGKILL)


def test_one_process_works_itself() -> None:
    assert sorted(unordered(divmod, [(7, 2), (9, 2)], 1)) == [(3, 1), (4, 1)]


def test_a_worker_finds_its_settings() -> None:
    settings = {"PIKANID_TEST_OF_WORKERS": "1"}
    with multiprocessing.get_context("spawn").Pool(1, begin, (os.getpid(), settings)) as pool:
        assert pool.apply(os.getenv, list(settings)) == "1"
    assert not os.environ.keys() & settings.keys()
