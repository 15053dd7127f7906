"""NLS and iPDA at N = 501 beside hand-written references of problem and optimiser."""

from __future__ import annotations

import numpy as np
import pytest
import reference
from in_turn import in_turn

import pikanid as pk
from pikanid.objective.shooting import Shooting
from pikanid.problem.problem import Problem

GROUP = "One start, N = 501, sigma = 0.1 deg"


@pytest.fixture(scope="module")
def recording() -> pk.Recording:
    clean = pk.simulate(pk.systems.sloshing(), pk.excitation.two_pulse())
    noise = np.random.default_rng(0).normal(0, reference.SIGMA, reference.COUNT)
    theta = clean["theta"]
    return clean.with_channels(
        pk.Channel("theta", theta.time, theta.values + noise, "rad", reference.SIGMA))


@pytest.fixture(scope="module")
def by_hand(recording):
    """The reference that ratios are against."""
    simulate, values = reference.numba_rk4(), recording["theta"].values
    return lambda: reference.fit(simulate, values)


def test_one_start_of_pikanid(benchmark, recording, by_hand) -> None:
    """From a bound problem and a starting point to the optimum, as the references do it."""
    benchmark.group = GROUP
    model = pk.systems.sloshing().with_values(l_theta=0.06, d_theta=0.05)
    shooting = Shooting(Problem(model, recording))
    strategy = pk.NLS(starts=1)
    found = in_turn(benchmark, strategy.one_start, (shooting, reference.START), by_hand, 500)
    assert found.theta == pytest.approx([0.04501202, 0.14891704], rel=1e-5)


def test_whole_fit_of_pikanid(benchmark, recording, by_hand) -> None:
    """`NLS(starts=1).fit`: reading units, covariance, verdict, warnings and trajectory as well."""
    benchmark.group = GROUP
    model = pk.systems.sloshing().with_values(l_theta=0.06, d_theta=0.05)
    estimate = in_turn(benchmark, pk.NLS(starts=1).fit, (model, recording), by_hand, 500)
    # p̂ of the hand-written reference in the limit of small steps
    assert estimate.theta == pytest.approx([0.04501202, 0.14891704], rel=1e-5)


def test_ipda_of_pikanid(benchmark, recording, by_hand) -> None:
    """`IPDA().fit`, which estimates the trajectory as well."""
    benchmark.group = GROUP
    model = pk.systems.sloshing().with_values(l_theta=0.06, d_theta=0.05)
    estimate = in_turn(benchmark, pk.IPDA().fit, (model, recording), by_hand, 500)
    assert estimate.theta == pytest.approx([0.04501202, 0.14891704], rel=1e-4)


@pytest.mark.parametrize("name", ["numba_rk4", "casadi_rk4", "dop853"])
def test_reference(benchmark, recording, name: str) -> None:
    benchmark.group = GROUP
    benchmark.extra_info["reference"] = name == "numba_rk4"
    simulate = getattr(reference, name)()
    found = benchmark.pedantic(reference.fit, (simulate, recording["theta"].values),
                               warmup_rounds=2, rounds=500 if name == "numba_rk4" else 5)
    assert found == pytest.approx([0.045012, 0.148917], rel=1e-3)
