"""The benchmark's runner: nothing is lost, nothing is done twice, and numbers stay the same."""

from __future__ import annotations

import os
import signal
import sqlite3
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from pikanid import errors
from pikanid.validation.benchmark import files, runner, store, trial
from pikanid.validation.benchmark.scenario import Scenario

TIMES = ("seconds", "cpu")


@pytest.fixture(scope="module")
def sparse() -> tuple[Scenario, ...]:
    """Two scenarios that are fitted within milliseconds."""
    return tuple(files.chosen(["sparse_low", "sparse_high"]))


def order(scenarios: tuple[Scenario, ...], seeds: int = 3, **options: Any) -> runner.Order:
    return runner.Order(scenarios, ("nls", "ipda"), ("default",), seeds, **options)


def rows(folder: Path) -> list[dict[str, Any]]:
    """What is stored, without how long it took."""
    return [{k: v for k, v in row.items() if k not in TIMES} for row in store.read(folder)[1]]


@pytest.fixture(scope="module")
def whole(sparse: tuple[Scenario, ...], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study that nothing interrupted, made by one process."""
    folder = tmp_path_factory.mktemp("whole")
    runner.run(order(sparse), folder)
    return folder


def test_every_trial_is_stored_once(whole: Path) -> None:
    found = rows(whole)
    assert len(found) == 2 * 2 * 3 * 2  # scenarios, strategies, seeds, parameters
    assert all(row["reason"] == "" for row in found)
    assert {row["seed"] for row in found} == {0, 1, 2}


def test_two_workers_find_what_one_finds(
        whole: Path, sparse: tuple[Scenario, ...], tmp_path: Path) -> None:
    runner.run(order(sparse, workers=2), tmp_path)
    assert rows(tmp_path) == rows(whole)


def test_resuming_changes_nothing(
        whole: Path, sparse: tuple[Scenario, ...], tmp_path: Path) -> None:
    runner.run(order(sparse[:1], seeds=1), tmp_path)
    told: list[int] = []
    runner.run(order(sparse), tmp_path, resume=True,
               begin=lambda done, total: told.extend((done, total)))
    assert told == [2, 12]
    assert rows(tmp_path) == rows(whole)
    runner.run(order(sparse), tmp_path, resume=True,
               tell=lambda outcomes: pytest.fail("nothing was left to do"))


def test_a_killed_run_loses_only_what_was_in_flight(
        whole: Path, sparse: tuple[Scenario, ...], tmp_path: Path,
        monkeypatch: pytest.MonkeyPatch) -> None:
    code = (
        "import sys, time\nfrom pathlib import Path\n"
        "from pikanid.validation.benchmark import files, runner\n"
        "from test_benchmark_runner import order\n"
        "runner.TOGETHER = 1\n"
        "def tell(outcomes):\n    print(len(outcomes), flush=True)\n    time.sleep(0.2)\n"
        "runner.run(order(tuple(files.chosen(['sparse_low', 'sparse_high'])), workers=2),"
        " Path(sys.argv[1]), tell=tell)\n")
    path = os.pathsep.join([str(Path(__file__).parent), *sys.path])
    child = subprocess.Popen([sys.executable, "-c", code, str(tmp_path)], text=True,
                             stdout=subprocess.PIPE, env={**os.environ, "PYTHONPATH": path})
    assert child.stdout is not None
    try:
        told = [int(child.stdout.readline()) for _ in range(4)]
    finally:
        child.send_signal(signal.SIGKILL)
        child.wait()
        child.stdout.close()
    with sqlite3.connect(tmp_path / store.FILE) as file:
        kept = file.execute("select count(*) from trials").fetchone()[0]
    file.close()
    assert sum(told) <= kept < 12
    runner.run(order(sparse), tmp_path, resume=True)
    assert rows(tmp_path) == rows(whole)


def test_a_store_is_not_continued_unasked(whole: Path, sparse: tuple[Scenario, ...]) -> None:
    with pytest.raises(errors.BadSetting, match=r"holds 12 trials.*--resume"):
        runner.run(order(sparse), whole)


def test_two_runs_into_one_store_are_refused(whole: Path, sparse: tuple[Scenario, ...]) -> None:
    with store.Store(whole, True, runner.versions()), pytest.raises(
            errors.BadSetting, match="Another benchmark is writing"):
        runner.run(order(sparse), whole, resume=True)


def test_a_store_of_other_versions_is_refused(whole: Path, sparse: tuple[Scenario, ...],
                                              monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(runner, "versions", lambda: {"python": "2.7", "numpy": "0"})
    with pytest.raises(errors.BadSetting, match=r"made with python .*here 2\.7"):
        runner.run(order(sparse), whole, resume=True)


def test_another_scenario_of_the_same_name_is_refused(
        whole: Path, sparse: tuple[Scenario, ...]) -> None:
    import dataclasses

    other = dataclasses.replace(sparse[0], stride=5)
    with pytest.raises(errors.BadSetting, match="holds another scenario called 'sparse_low'"):
        runner.run(order((other,)), whole, resume=True)


def test_a_damaged_store_is_refused(tmp_path: Path, sparse: tuple[Scenario, ...]) -> None:
    (tmp_path / store.FILE).write_bytes(b"no database at all, but long enough to be one" * 50)
    with pytest.raises(errors.BadRecording, match="cannot be used"):
        runner.run(order(sparse), tmp_path, resume=True)
    with pytest.raises(errors.BadRecording, match="cannot be used"):
        store.read(tmp_path)


def test_a_trial_that_fails_is_recorded_and_others_go_on(
        sparse: tuple[Scenario, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    real = trial.fit

    def fit(scenario: Scenario, strategy: str, protocol: str, seed: int) -> Any:
        if seed == 1:
            raise ZeroDivisionError("nobody foresaw this")
        if strategy == "ipda":
            raise errors.BadSetting("This cannot work.")
        return real(scenario, strategy, protocol, seed)

    monkeypatch.setattr(trial, "fit", fit)
    runner.run(order(sparse[:1]), tmp_path)
    reasons = {(row["strategy"], row["seed"]): row["reason"] for row in rows(tmp_path)}
    assert reasons == {
        ("nls", 0): "", ("nls", 1): "ZeroDivisionError: nobody foresaw this", ("nls", 2): "",
        ("ipda", 0): "This cannot work.", ("ipda", 2): "This cannot work.",
        ("ipda", 1): "ZeroDivisionError: nobody foresaw this"}


def test_blas_has_one_thread_while_a_trial_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    from threadpoolctl import threadpool_info

    seen: list[int] = []
    monkeypatch.setattr(trial, "run", lambda *_: seen.extend(
        one["num_threads"] for one in threadpool_info() if one["user_api"] == "blas"))
    packed = trial.pack(files.chosen(["sparse_low"])[0])
    trial.run_packed(packed, (trial.Trial("sparse_low", "nls", "default", 0),))
    assert seen and set(seen) == {1}


@pytest.fixture(scope="module")
def scheduler(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Address of a scheduler that is a process of its own, with a worker that is another one."""
    pytest.importorskip("distributed", reason="needs the `cluster` extra")
    folder = tmp_path_factory.mktemp("dask")
    said = folder / "scheduler.json"
    options = ["--scheduler-file", str(said), "--no-dashboard"]
    path = os.pathsep.join([str(Path(__file__).parent), *sys.path])
    kept: list[subprocess.Popen[bytes]] = []
    with (folder / "log").open("wb") as log:
        for module, more in (("scheduler", ["--port", "0", "--host", "127.0.0.1"]),
                             ("worker", ["--nthreads", "1", "--nworkers", "1", "--no-nanny",
                                         "--local-directory", str(folder)])):
            kept.append(subprocess.Popen(
                [sys.executable, "-m", f"distributed.cli.dask_{module}", *options, *more],
                stdout=log, stderr=log, env={**os.environ, "PYTHONPATH": path}))
            for _ in range(300):
                if said.exists() and said.stat().st_size:  # it is there before it is written
                    break
                time.sleep(0.1)
        try:
            import json

            yield str(json.loads(said.read_text())["address"])
        finally:
            for one in reversed(kept):  # a worker waits for a scheduler that is gone
                one.kill()
                one.wait()


def test_a_scheduler_in_a_process_of_its_own_finds_the_same(
        whole: Path, sparse: tuple[Scenario, ...], scheduler: str, tmp_path: Path) -> None:
    for _ in range(100):  # until its worker has come
        try:
            runner.run(order(sparse, scheduler=scheduler), tmp_path, resume=True)
        except errors.BadSetting as problem:
            if "no workers" not in str(problem):
                raise
            time.sleep(0.2)
        else:
            break
    assert rows(tmp_path) == rows(whole)


def test_a_local_cluster_finds_the_same(
        whole: Path, sparse: tuple[Scenario, ...], tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed", reason="needs the `cluster` extra")
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, processes=True,
                                  dashboard_address=":0") as cluster:
        runner.run(order(sparse, scheduler=cluster.scheduler_address), tmp_path)
    assert rows(tmp_path) == rows(whole)


def test_an_address_where_nobody_answers(
        sparse: tuple[Scenario, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed", reason="needs the `cluster` extra")
    monkeypatch.setattr("pikanid.validation.benchmark.spread.PATIENCE", 0.3)
    with pytest.raises(errors.BadSetting, match="No Dask scheduler answers at 'tcp://127"):
        runner.run(order(sparse, scheduler="tcp://127.0.0.1:9"), tmp_path)
