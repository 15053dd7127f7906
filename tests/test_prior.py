"""What a fit says of shared parameters: exact where it is linearised, and where it is renewed."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

import pikanid as pk
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.judge.prior import Prior, elsewhere, of_fit
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.mismatch.steps.opening import open_case


@pytest.fixture(scope="module")
def fit() -> Hypothesis:
    """Nominal fit whose start is free as well: a parameter that no other recording shares."""
    model = pk.systems.sloshing().with_initial(theta="free", theta_dot="free")
    recs = [pk.simulate(pk.systems.sloshing(), pk.excitation.two_pulse(), sigma=0.002, seed=seed)
            for seed in (0, 1)]
    return open_case(model, (recs[0],), (recs[1],), None, lambda text: None, DEFAULTS).base


def test_the_others_follow_so_that_chi_squared_stays_least(fit: Hypothesis) -> None:
    names = ["d_theta", "l_theta"]
    prior = of_fit(fit, names)
    step = np.linalg.solve(prior.root, [0.3, -0.2])
    expected = np.array([fit.values[n] for n in names]) + step
    # least squares over the others, to first order
    free = [f.name for f in fit.whitened.problem.free]
    shared = [free.index(n) for n in names]
    others = [k for k in range(len(free)) if k not in shared]
    assert len(others) == 2
    J = fit.minimum.J
    moved = np.linalg.lstsq(J[:, others], -J[:, shared] @ step, rcond=None)[0]
    np.testing.assert_allclose(prior.follow[others] @ step, moved, rtol=1e-9, atol=1e-15)
    gone = fit.minimum.r + J[:, shared] @ step
    rise = np.sum((gone + J[:, others] @ np.linalg.lstsq(J[:, others], -gone, rcond=None)[0]) ** 2)
    rise -= fit.minimum.chi2
    assert prior.constant + np.sum(prior.residual(expected) ** 2) == pytest.approx(rise, rel=1e-9)
    assert prior.distance(expected) == pytest.approx(np.hypot(0.3, 0.2))


def test_far_from_the_estimates_chi_squared_is_that_of_a_simulation(fit: Hypothesis) -> None:
    names = [f.name for f in fit.whitened.problem.free]
    prior = of_fit(fit, names)
    away = fit.minimum.theta + np.linalg.solve(prior.root, np.full(len(names), 40.0))
    renewed = elsewhere(prior, fit, away)
    assert renewed is not None
    truth = fit.whitened.chi2(away) - fit.minimum.chi2
    found = renewed.constant + float(np.sum(renewed.residual(away) ** 2))
    assert found == pytest.approx(truth, rel=1e-9)
    # so far away the ellipsoid of the estimates says something else
    assert abs(float(np.sum(prior.residual(away) ** 2)) / truth - 1) > 1e-3


def test_a_prior_is_not_taken_where_nothing_can_be_simulated() -> None:
    problem = SimpleNamespace(lower=np.full(2, -9.0), upper=np.full(2, 9.0))
    known = Prior(np.eye(1), np.zeros(1), np.zeros(1), 0.0, np.zeros(2), np.eye(2)[:, :1], (0,))

    def after(residual: object) -> Prior | None:
        whitened = SimpleNamespace(problem=problem, residual=lambda theta: residual)
        h = SimpleNamespace(whitened=whitened, minimum=SimpleNamespace(chi2=1.0))
        return elsewhere(known, cast(Any, h), np.array([0.5]))

    J = np.array([[2.0, 0.0], [0.0, 1.0], [0.0, 0.0]])
    assert after(None) is None
    assert after((np.ones(3), np.full((3, 2), np.nan))) is None
    found = after((np.ones(3), J))
    assert found is not None and found.all.tolist() == [0.5, 0.0]
    assert np.abs(found.root).tolist() == [[2.0]]
