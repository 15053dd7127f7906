"""Work side by side: the outcome of one worker, for any number of them."""

from __future__ import annotations

import random
import time

import numpy as np
import pytest

import pikanid as pk
from pikanid.mismatch.fitting.parallel import ordered_parallel_map, threads


def outcome(workers: int, limit: int) -> list[tuple[int, int]]:
    """Jobs that depend on the least number taken so far, and end in any order."""
    jobs = list(random.Random(1).sample(range(100), 30))
    taken: list[tuple[int, int]] = []

    def work(job: int, least: int) -> int:
        time.sleep(0.001 * (job % 3))
        return job - least if job > least else job

    ordered_parallel_map(jobs, lambda: min((r for _, r in taken), default=100), work,
            lambda job, result: taken.append((job, result)), lambda: len(taken) < limit, workers)
    return taken


@pytest.mark.parametrize("limit", [0, 7, 100])
def test_the_outcome_is_that_of_one_worker(limit: int) -> None:
    alone = outcome(1, limit)
    assert len(alone) == min(limit, 30)
    assert all(outcome(workers, limit) == alone for workers in (2, 5))


def test_failures_arrive() -> None:
    def work(job: int, state: int) -> float:
        return 1 / job

    with pytest.raises(ZeroDivisionError):
        ordered_parallel_map([2, 0, 1], lambda: 0, work, lambda job, result: None, lambda: True, 2)


def test_threads_by_default() -> None:
    assert threads(None, 2) in (1, 2)
    assert threads(5, 2) == 5


@pytest.mark.compiled
@pytest.mark.slow
def test_diagnosis_does_not_depend_on_workers() -> None:
    truth = pk.systems.sloshing().with_term(
        "theta_dot", "-c*sign(theta_dot)", [pk.Parameter("c", 0.5)])
    train, other = (
        pk.simulate(truth, pk.excitation.planar_moves(4, 6.0, seed=seed), sigma=0.002, seed=seed)
        for seed in (1, 2))
    answers = []
    for workers in (1, 2):
        answer = pk.diagnose(pk.systems.sloshing(), train, other, workers=workers).to_dict()
        answer.pop("seconds", None)
        answers.append(answer)
    np.testing.assert_equal(answers[0], answers[1])
    assert answers[0]["verdict"] != "none"


def test_no_workers_is_a_mistake() -> None:
    recording = pk.simulate(pk.systems.sloshing(), pk.excitation.planar_moves(2, 6.0, seed=1))
    with pytest.raises(pk.errors.BadSetting, match="workers"):
        pk.diagnose(pk.systems.sloshing(), recording, workers=0)


def test_what_another_state_would_not_change_is_not_done_again() -> None:
    """Only whether the least number so far is below the job's enters into a result."""
    runs: list[int] = []
    taken: list[tuple[int, bool]] = []

    def work(job: int, least: int) -> tuple[int, bool]:
        runs.append(job)
        return job, least < job

    jobs = [50, 40, 90, 30, 80, 20]
    ordered_parallel_map(jobs, lambda: min((job for job, _ in taken), default=100), work,
            lambda job, result: taken.append(result), lambda: True, 2,
            lambda result, least: result[1] == (least < result[0]))
    assert taken == [(50, False), (40, False), (90, True), (30, False), (80, True), (20, False)]
    assert len(runs) <= len(jobs) + 1  # at most 90, if it was begun before 50 was taken
