"""Information, bounds, profiles: the study's numbers, linear algebra, what is not determined."""

from __future__ import annotations

import interpreted
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import norm

import pikanid as pk
from pikanid import errors
from pikanid.model import Model, Parameter, systems
from pikanid.problem.problem import FreeParameter
from pikanid.recording import Recording, excitation
from pikanid.uncertainty import (
    covariance,
    cramer_rao,
    identifiability_warnings,
    information_partition,
    profile,
)

DEGREE = np.pi / 180
MODEL = systems.sloshing()


# --- the bound -----------------------------------------------------------------------------------


@pytest.mark.parametrize(("stride", "noise", "length", "damping"), [
    (1, 0.1, 9.89e-6, 9.5e-4), (1, 1.0, 9.89e-5, 9.5e-3),
    (10, 0.1, 3.08e-5, 3.0e-3), (10, 1.0, 3.08e-4, 3.0e-2)])
def test_bounds_of_the_study(stride: int, noise: float, length: float, damping: float) -> None:
    recording = pk.simulate(MODEL, excitation.two_pulse()).decimate(stride, channels=["theta"])
    bound = cramer_rao(MODEL, recording, sigma=noise * DEGREE)
    assert bound.std("l_theta") == pytest.approx(length, rel=2e-3)
    assert bound.std("d_theta") == pytest.approx(damping, rel=2e-2)


def test_an_excitation_alone_is_enough_to_plan_with() -> None:
    bound = cramer_rao(MODEL, excitation.two_pulse(), sigma=0.1 * DEGREE)
    full = cramer_rao(MODEL, pk.simulate(MODEL, excitation.two_pulse()), sigma=0.1 * DEGREE)
    np.testing.assert_allclose(bound.fisher, full.fisher, rtol=1e-6)
    assert "l_theta" in str(bound)


def test_information_of_several_recordings_adds_up() -> None:
    one = excitation.two_pulse()
    two = excitation.two_pulse(amplitude=0.5)
    both = cramer_rao(MODEL, [one, two], sigma=0.01)
    np.testing.assert_allclose(
        both.fisher, cramer_rao(MODEL, one, sigma=0.01).fisher
        + cramer_rao(MODEL, two, sigma=0.01).fisher, rtol=1e-6)


def test_information_scales_with_the_noise_and_correlation_does_not() -> None:
    fine = cramer_rao(MODEL, excitation.two_pulse(), sigma=0.001)
    rough = cramer_rao(MODEL, excitation.two_pulse(), sigma={"theta": 0.01})
    # the integration error is a hundredth of what σ/√N allows
    assert rough.std("d_theta") == pytest.approx(10 * fine.std("d_theta"), rel=1e-3)
    np.testing.assert_allclose(rough.correlation, fine.correlation, atol=1e-3)
    assert abs(rough.correlation[0, 1]) < 1


def test_bound_needs_a_noise_and_a_known_name() -> None:
    with pytest.raises(errors.BadSetting, match="theta"):
        cramer_rao(MODEL, excitation.two_pulse())
    bound = cramer_rao(MODEL, excitation.two_pulse(), sigma=0.01)
    with pytest.raises(errors.BadModel, match="l_teta"):
        bound.std("l_teta")


@pytest.mark.parametrize("stated", [None, 0.3, {"x": 0.3, "w": 5.0}, {"w": 5.0}])
def test_bound_is_the_inverse_of_the_information_by_hand(
        stated: object, monkeypatch: pytest.MonkeyPatch) -> None:
    """x = a + b·t, w = 80·x + c: a σ that is asked for counts before that of the recording."""
    interpreted.instead_of_compiled(monkeypatch)
    model = Model.from_dict({
        "states": {"x": {"initial": "a"}}, "equations": {"x": "b"},
        "parameters": {n: {"guess": 1.0} for n in "abc"},
        "outputs": {"x": {"expression": "x"}, "w": {"expression": "80*x + c"}}})
    t, own = np.linspace(0, 2, 9), {"x": np.linspace(0.1, 0.2, 9), "w": 2.0}
    recording = Recording.from_arrays(t, {"x": np.cos(t), "w": np.sin(t)}, sigma=own)
    sigma = stated if isinstance(stated, dict) else {} if stated is None else dict.fromkeys(
        own, stated)
    bound = cramer_rao(model, recording, sigma=stated)  # type: ignore[arg-type]
    x = np.column_stack([np.ones(9), t, np.zeros(9)])
    rows = np.vstack([x / np.broadcast_to(sigma.get("x", own["x"]), 9)[:, None],
                      (80 * x + [0, 0, 1]) / sigma.get("w", 2.0)])
    np.testing.assert_allclose(bound.fisher, rows.T @ rows, rtol=1e-9)
    inverse = np.linalg.inv(rows.T @ rows)
    std = np.sqrt(np.diag(inverse))
    size = np.outer(std, std)
    np.testing.assert_allclose(bound.covariance / size, inverse / size, atol=1e-7)
    assert [bound.std(n) for n in "abc"] == pytest.approx(list(std), rel=1e-7)
    np.testing.assert_allclose(bound.correlation, inverse / size, atol=1e-7)


# --- linear algebra ------------------------------------------------------------------------------


@settings(max_examples=40)
@given(st.integers(0, 10**6), st.integers(1, 5), st.floats(-8, 8))
def test_covariance_is_the_inverse_of_the_information(seed: int, n: int, scale: float) -> None:
    """Also where the parameters' sizes are decades apart."""
    rng = np.random.default_rng(seed)
    J = rng.normal(size=(30, n)) * 10.0 ** (scale * np.arange(n) / n)
    found = covariance(J, np.ones(n, bool))
    size = np.linalg.norm(J, axis=0)
    expected = np.linalg.inv((J / size).T @ (J / size)) / np.outer(size, size)
    np.testing.assert_allclose(found, expected, rtol=1e-8, atol=1e-10 * np.abs(expected).max())


def test_what_is_held_has_no_variance_and_what_is_unseen_an_infinite_one() -> None:
    J = np.random.default_rng(0).normal(size=(20, 4))
    J[:, 2] = 0
    found = covariance(J, np.array([True, False, True, True]))
    assert np.isnan(found[1]).all()
    assert np.isnan(found[:, 1]).all()
    assert found[2, 2] == np.inf
    kept = J[:, [0, 3]]
    np.testing.assert_allclose(found[np.ix_([0, 3], [0, 3])], np.linalg.inv(kept.T @ kept))


def test_a_direction_that_is_not_seen_has_a_hopeless_variance() -> None:
    a = np.random.default_rng(1).normal(size=(50, 1))
    found = covariance(np.hstack([a, 3 * a]), np.ones(2, bool))
    assert np.all(np.sqrt(np.diag(found)) > 1e9)


def parameters(*names: str) -> list[FreeParameter]:
    return [FreeParameter(n, None, 1.0, (-np.inf, np.inf)) for n in names]


def test_warnings_name_the_combination() -> None:
    rng = np.random.default_rng(2)
    a, b = rng.normal(size=(50, 1)), rng.normal(size=(50, 1))
    none = identifiability_warnings(np.hstack([a, b]), parameters("a", "b"), np.ones(2, bool))
    assert none == []
    tied = identifiability_warnings(np.hstack([a, b, a + 1e-9 * b]), parameters("a", "b", "c"),
                                    np.ones(3, bool))
    assert len(tied) == 1
    assert "·a" in tied[0]
    assert "·c" in tied[0]
    assert "·b" not in tied[0]
    blind = identifiability_warnings(np.hstack([a, 0 * b]), parameters("a", "b"), np.ones(2, bool))
    assert len(blind) == 1
    assert "'b'" in blind[0]
    held = identifiability_warnings(np.hstack([a, b, a]), parameters("a", "b", "c"),
                                    np.array([True, True, False]))
    assert held == []


@settings(max_examples=40)
@given(st.integers(0, 10**6), st.integers(1, 6), st.integers(1, 3))
def test_partition_is_the_schur_complement(seed: int, k: int, n: int) -> None:
    """And it is the inverse of the parameters' block of the joint covariance."""
    rng = np.random.default_rng(seed)
    C, P = rng.normal(size=(25, k)), rng.normal(size=(25, n))
    found = information_partition(C, P)
    F = np.hstack([C, P]).T @ np.hstack([C, P])
    np.testing.assert_allclose(found.alone, P.T @ P, rtol=1e-12)
    np.testing.assert_allclose(np.linalg.inv(found.effective), np.linalg.inv(F)[k:, k:], rtol=1e-7)
    assert np.all((found.shares > 0) & (found.shares <= 1 + 1e-12))


def test_partition_of_coefficients_that_depend_on_each_other() -> None:
    """A spline coefficient that no residual sees takes no information."""
    C = np.array([[1.0, 1.0], [0.0, 0.0], [0.0, 0.0]])
    P = np.array([[0.0], [1.0], [0.0]])
    assert information_partition(C, P).shares[0] == pytest.approx(1.0)


# --- profiles ------------------------------------------------------------------------------------


def noisy(seed: int = 0, sigma: float = 0.1 * DEGREE) -> Recording:
    return pk.simulate(MODEL, excitation.two_pulse(), sigma=sigma, seed=seed)


@pytest.mark.parametrize("level", [0.68, 0.95])
def test_profile_of_a_nearly_linear_fit_is_the_gaussian_interval(level: float) -> None:
    recording = noisy()
    found = pk.NLS().fit(MODEL, recording)
    half = norm.ppf(0.5 + level / 2)
    for name in ("l_theta", "d_theta"):
        interval = profile(MODEL, recording, found.theta, name, level).interval
        expected = found.value(name) + np.array([-1, 1]) * half * found.std(name)
        np.testing.assert_allclose(interval, expected, atol=0.02 * found.std(name))


def test_profile_without_a_known_noise_takes_that_of_the_residual() -> None:
    recording = noisy().with_sigma(theta=None)
    found = pk.NLS().fit(MODEL, recording)
    low, high = profile(MODEL, recording, found.theta, "d_theta").interval
    assert high - low == pytest.approx(2 * 1.96 * found.std("d_theta"), rel=0.02)


def test_profile_ends_at_a_bound() -> None:
    recording = noisy(sigma=1.0 * DEGREE)
    model = MODEL.with_bounds(d_theta=(0.149, 20.0)).with_values(d_theta=0.15)
    found = pk.NLS(starts=1).fit(model, recording)
    low, high = profile(model, recording, found.theta, "d_theta").interval
    assert low == 0.149
    assert np.isfinite(high)


def test_profile_of_what_is_not_determined_never_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    interpreted.instead_of_compiled(monkeypatch)
    model = Model.from_dict({
        "states": {"x": {"initial": 1.0}}, "parameters": {"a": {"guess": 1.0}, "b": {"guess": 1.0}},
        "equations": {"x": "-(a + b)*x"}, "outputs": {"x": {"expression": "x"}}})
    t = np.linspace(0, 2, 21)
    rng = np.random.default_rng(0)
    recording = Recording.from_arrays(t, {"x": np.exp(-2 * t) + rng.normal(0, 0.01, 21)},
                                      sigma={"x": 0.01})
    found = pk.NLS(starts=1).fit(model, recording)
    assert any("combination" in w for w in found.warnings)
    assert profile(model, recording, found.theta, "a").interval == (-np.inf, np.inf)


def test_profile_of_an_unknown_parameter_is_refused() -> None:
    with pytest.raises(errors.BadModel, match="m"):
        profile(MODEL, noisy(), np.array([0.045, 0.15]), "m")
    with pytest.raises(errors.BadModel, match="k"):
        profile(MODEL.with_parameters(Parameter("k", 1.0, free=False)), noisy(),
                np.array([0.045, 0.15]), "k")


def test_without_coefficients_all_information_is_left() -> None:
    parameters = np.random.default_rng(0).normal(size=(6, 2))
    part = information_partition(np.empty((6, 0)), parameters)
    np.testing.assert_allclose(part.effective, part.alone)
    np.testing.assert_allclose(part.shares, 1.0)


def test_the_condition_that_is_told_is_that_of_the_columns() -> None:
    rng = np.random.default_rng(1)
    a, b, c = np.linalg.qr(rng.normal(size=(30, 3)))[0].T[:, :, None]
    J = np.hstack([a, a + 0.1 * b, a + 0.05 * b + 1e-8 * c]) * [1.0, 40.0, 0.01]
    (note,) = identifiability_warnings(J, parameters("a", "b", "c"), np.ones(3, bool))
    condition = np.linalg.cond(J / np.linalg.norm(J, axis=0))
    assert f"condition {condition:.1g}" in note and 1e8 < condition < 1e10
