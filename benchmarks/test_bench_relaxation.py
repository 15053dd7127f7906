"""PDA and iPDA at N = 501 beside NLS."""

from __future__ import annotations

import math

import pytest

import pikanid as pk

GROUP = "Strategies, N = 501, sigma = 0.1 deg"


@pytest.mark.parametrize(("label", "strategy"), [
    ("nls", pk.NLS(starts=1)), ("pda", pk.PDA()), ("ipda", pk.IPDA()),
    ("ipda, protocol of the paper", pk.IPDA(protocol="paper"))])
def test_strategy(benchmark, label: str, strategy) -> None:
    benchmark.group = GROUP
    benchmark.extra_info["reference"] = label == "nls"
    benchmark.name = label
    model = pk.systems.sloshing()
    recording = pk.simulate(model, pk.excitation.two_pulse(), sigma=math.radians(0.1), seed=0)
    start = model.with_values(l_theta=0.06, d_theta=0.05)
    estimate = benchmark.pedantic(strategy.fit, (start, recording), warmup_rounds=1, rounds=15)
    assert 0.04 < estimate.value("l_theta") < 0.056
