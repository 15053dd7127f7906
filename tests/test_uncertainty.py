"""Fisher information, bounds and profiles against published and closed-form values."""

from __future__ import annotations

import math

import numpy as np
import pytest

import pikanid as pk
from pikanid import errors
from pikanid.uncertainty import covariance, information_partition, profile


@pytest.mark.parametrize(("stride", "noise", "l", "d"), [
    (1, 0.1, 9.89e-6, 9.5e-4), (1, 1.0, 9.89e-5, 9.5e-3),
    (10, 0.1, 3.08e-5, 3.0e-3), (10, 1.0, 3.08e-4, 3.0e-2)])
def test_cramer_rao_bound_of_the_papers_experiment(stride: int, noise: float, l: float, d: float,  # noqa: E741
                                                   ) -> None:
    model = pk.systems.sloshing()
    rec = pk.simulate(model, pk.excitation.two_pulse()).decimate(stride, channels=["theta"])
    bound = pk.uncertainty.cramer_rao(model, rec, sigma=math.radians(noise))
    assert bound.std("l_theta") == pytest.approx(l, rel=2e-3)
    assert bound.std("d_theta") == pytest.approx(d, rel=1e-2)


def test_bound_before_there_is_data_and_without_noise() -> None:
    model = pk.systems.sloshing()
    before = pk.uncertainty.cramer_rao(model, pk.excitation.two_pulse(), sigma=1e-3)
    after = pk.uncertainty.cramer_rao(
        model, pk.simulate(model, pk.excitation.two_pulse(), sigma=1e-3, seed=0))
    np.testing.assert_allclose(before.fisher, after.fisher, rtol=1e-12)
    with pytest.raises(errors.BadSetting, match="theta"):
        pk.uncertainty.cramer_rao(model, pk.excitation.two_pulse())


def test_covariance_of_a_straight_line() -> None:
    t = np.linspace(0, 1, 50)
    J = np.stack([np.ones(50), t], axis=1)
    np.testing.assert_allclose(covariance(J, np.ones(2, bool)), np.linalg.inv(J.T @ J), rtol=1e-10)


def test_unseen_and_held_parameters() -> None:
    J = np.array([[1.0, 0.0, 1.0], [2.0, 0.0, 0.5]])
    c = covariance(J, np.array([True, True, False]))
    assert c[0, 0] == pytest.approx(0.2)
    assert np.isinf(c[1, 1])
    assert np.isnan(c[2, 2])


def test_a_combination_that_the_data_cannot_split_is_named() -> None:
    model = pk.systems.sloshing().free("m")  # only d/m enters
    recording = pk.simulate(pk.systems.sloshing(), pk.excitation.two_pulse(),
                            sigma=math.radians(0.1), seed=0)
    estimate = pk.NLS(starts=1).fit(model, recording)
    assert any("combination" in w and "d_theta" in w and "m" in w for w in estimate.warnings)


def test_profile_agrees_with_the_standard_error_and_covers() -> None:
    model = pk.systems.sloshing()
    recording = pk.simulate(model, pk.excitation.two_pulse(), sigma=math.radians(0.1), seed=4)
    estimate = pk.NLS().fit(model, recording)
    for name in ("l_theta", "d_theta"):
        found = profile(model, recording, estimate.theta, name)
        low, high = estimate.interval(name)
        assert found.interval[0] == pytest.approx(low, abs=0.03 * (high - low))
        assert found.interval[1] == pytest.approx(high, abs=0.03 * (high - low))
    with pytest.raises(errors.BadModel):
        profile(model, recording, estimate.theta, "m")


def test_profile_of_an_unidentified_parameter_never_closes() -> None:
    model = pk.systems.sloshing().free("m").with_bounds(m=(0.01, 10.0))
    recording = pk.simulate(pk.systems.sloshing(), pk.excitation.two_pulse(),
                            sigma=math.radians(0.1), seed=0)
    estimate = pk.NLS(starts=1).fit(model, recording)
    low, high = profile(model, recording, estimate.theta, "m", points=6).interval
    assert low <= 0.02 or low == -np.inf
    assert high >= 9.9


def test_partition_loses_what_the_coefficients_explain() -> None:
    rng = np.random.default_rng(0)
    c, p = rng.normal(size=(200, 30)), rng.normal(size=(200, 2))
    part = information_partition(c, p)
    schur = p.T @ p - p.T @ c @ np.linalg.solve(c.T @ c, c.T @ p)
    np.testing.assert_allclose(part.effective, schur, rtol=1e-10)
    assert np.all((part.shares > 0) & (part.shares < 1))
