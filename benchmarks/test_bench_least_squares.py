"""Why MINPACK stands beside our own Levenberg-Marquardt: the same fit of NLS with both."""

from __future__ import annotations

import numpy as np
import pytest
import reference

import pikanid as pk
from pikanid.objective.shooting import Shooting
from pikanid.optimise import levenberg_marquardt, minpack
from pikanid.problem.problem import Problem

GROUP = "Least squares to nine digits, NLS, N = 501"


@pytest.fixture(scope="module")
def recording() -> pk.Recording:
    return pk.simulate(pk.systems.sloshing(), pk.excitation.two_pulse(), sigma=reference.SIGMA,
                       seed=0)


@pytest.mark.parametrize("name", ["minpack", "levenberg_marquardt"])
def test_least_squares(benchmark, recording, name: str) -> None:
    benchmark.group = GROUP
    benchmark.extra_info["reference"] = name == "minpack"
    shooting = Shooting(Problem(pk.systems.sloshing(), recording))
    lower, upper = shooting.problem.lower, shooting.problem.upper

    def both(theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return shooting.residual(theta), shooting.jacobian(theta)

    def fit() -> np.ndarray:
        shooting.choose_steps(reference.START, "fine")
        if name == "minpack":
            return minpack.minimise(shooting.residual, shooting.jacobian, reference.START, lower,
                                    upper).theta
        found = levenberg_marquardt.descend(
            lambda theta: levenberg_marquardt.Rows(*both(theta)), reference.START, lower, upper,
            100, lambda at: 1e-9 * at.cost)
        assert found is not None
        return found.theta

    found = benchmark.pedantic(fit, warmup_rounds=3, rounds=20)
    assert found == pytest.approx([0.045, 0.15], rel=0.02)
