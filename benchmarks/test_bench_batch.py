"""A batch of seeds of one scenario beside the same trials one by one: data made and fitted."""

from __future__ import annotations

import pytest

import pikanid as pk
from pikanid.strategies import strategy_class
from pikanid.validation.benchmark import files, trial
from pikanid.validation.benchmark.scenario import Scenario

SEEDS = 10


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return files.chosen(["dense_low"])[0]


@pytest.mark.parametrize("name", ["nls", "ipda"])
def test_batch(benchmark, scenario: Scenario, name: str) -> None:
    """As a worker of `pikanid benchmark` does it: what seeds share is made once."""
    benchmark.group = f"Ten seeds of {name}, N = 501, sigma = 0.1 deg: data and fit"
    trials = tuple(trial.Trial(scenario.name, name, "default", k) for k in range(SEEDS))
    packed = trial.pack(scenario)
    found = benchmark.pedantic(trial.run_packed, (packed, trials), warmup_rounds=1, rounds=10)
    assert all(not o.reason for o in found)


@pytest.mark.parametrize("name", ["nls", "ipda"])
def test_one_by_one(benchmark, scenario: Scenario, name: str) -> None:
    """As a loop over `simulate` and `fit` does it."""
    benchmark.group = f"Ten seeds of {name}, N = 501, sigma = 0.1 deg: data and fit"
    benchmark.extra_info["reference"] = True
    sigma = scenario.noise["theta"].sigma

    def loop() -> list[pk.Estimate]:
        return [strategy_class(name)().fit(scenario.fitted, pk.simulate(
            scenario.truth, scenario.drive, sigma=sigma, seed=k)) for k in range(SEEDS)]

    found = benchmark.pedantic(loop, warmup_rounds=1, rounds=10)
    assert len(found) == SEEDS
