"""Whitened residuals, what a fit to them predicts elsewhere, and which side a sign counts on."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from scipy.optimize import least_squares

import pikanid as pk
from pikanid.mismatch.catalogue.catalogue import candidates
from pikanid.mismatch.catalogue.sites import sites
from pikanid.mismatch.data.preparation import prepared
from pikanid.mismatch.data.records import Records
from pikanid.mismatch.data.whitened import Whitened
from pikanid.mismatch.fitting.fit import fitted
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.judge.prediction import HeldOut, held_out
from pikanid.mismatch.search.screen import Screen
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.model import Model
from pikanid.noise.level import NoiseModel
from pikanid.recording import Recording
from pikanid.recording.channel import Channel

SIGMA, RHO = 0.002, 0.4
LEVEL = NoiseModel(SIGMA, RHO, 0.0, 0.01, "given")


def model(free_start: bool = False) -> Model:
    return pk.systems.sloshing().with_initial(theta="free") if free_start else (
        pk.systems.sloshing())


@functools.cache
def recorded(seed: int, start: float = 0.0, length: float = 0.045, drag: float = 0.0) -> Recording:
    truth = pk.systems.sloshing().with_initial(theta=start).with_values(l_theta=length)
    if drag:
        truth = truth.with_term("theta_dot", f"-({drag})*abs(theta_dot)*theta_dot")
    clean = pk.simulate(truth, pk.excitation.two_pulse(3.0, 0.01))
    noise, e = np.zeros(301), np.random.default_rng(seed).normal(size=301) * SIGMA
    noise[0] = e[0]
    for k in range(1, 301):
        noise[k] = RHO * noise[k - 1] + np.sqrt(1 - RHO**2) * e[k]
    theta = clean["theta"]
    return clean.with_channels(pk.Channel("theta", theta.time, theta.values + noise, "rad"))


def records(*recordings: Recording) -> Records:
    return Records(recordings, tuple({"theta": LEVEL} for _ in recordings), DEFAULTS)


def white(r: np.ndarray) -> np.ndarray:
    """By the Cholesky factor of the covariance of AR(1) noise."""
    lags = np.abs(np.subtract.outer(np.arange(len(r)), np.arange(len(r))))
    return np.linalg.solve(np.linalg.cholesky(SIGMA**2 * RHO**lags), r)


def misfit(theta: np.ndarray, recording: Recording, start: float = 0.0) -> np.ndarray:
    """ŷ - y for (l, d), simulated by compiled functions."""
    given = pk.systems.sloshing().with_values(l_theta=theta[0], d_theta=theta[1])
    return np.asarray(pk.simulate(given.with_initial(theta=start), recording)["theta"].values
                      - recording["theta"].values)


@functools.cache
def hypothesis(free_start: bool = False, start: float = 0.0) -> Hypothesis:
    """The nominal model on a recording."""
    found = fitted(model(free_start), [], records(recorded(0, start)), [{}], 1)
    assert found is not None
    return found


def test_residuals_and_fit_are_those_of_generalised_least_squares() -> None:
    h, recording = hypothesis(), recorded(0)
    theta = np.array([0.046, 0.2])
    at = h.whitened.residual(theta)
    assert at is not None
    np.testing.assert_allclose(at[0], white(misfit(theta, recording)), atol=0.02)
    assert h.whitened.chi2(theta) == pytest.approx(float(at[0] @ at[0]))
    for k, step in enumerate((1e-5, 1e-4)):
        aside = step * np.eye(2)[k]
        slope = white((misfit(theta + aside, recording) - misfit(theta - aside, recording))
                      / (2 * step))
        np.testing.assert_allclose(at[1][:, k], slope, atol=2e-3 * np.abs(slope).max())
    best = least_squares(lambda q: white(misfit(q, recording)), theta, x_scale=[0.045, 0.1])
    std = np.sqrt(np.diag(np.linalg.inv(best.jac.T @ best.jac)))
    np.testing.assert_array_less(np.abs(h.minimum.theta - best.x), 0.1 * std)
    assert h.minimum.chi2 == pytest.approx(2 * best.cost, abs=0.1)
    assert [h.std[n] for n in ("l_theta", "d_theta")] == pytest.approx(list(std), rel=0.01)
    assert h.noise == pytest.approx(np.sqrt(2 * best.cost / 299), abs=1e-3)


def test_several_recordings_are_rows_below_each_other() -> None:
    own = model(True).per_recording("theta_0")
    both = Whitened(own, records(recorded(0, 0.02), recorded(1, -0.03)))
    theta = np.array([0.045, 0.15, 0.02, -0.03])
    assert both.choose_steps(theta)
    found = both.residual(theta)
    assert found is not None
    r, J = found
    for k, start in enumerate((0.02, -0.03)):
        rows = slice(301 * k, 301 * (k + 1))
        np.testing.assert_allclose(
            r[rows], white(misfit(theta, recorded(k, start), start)), atol=0.02)
        assert not J[rows, 3 - k].any() and J[rows, 2 + k].any()


def predicted(h: Hypothesis, free_start: bool, later: Recording) -> HeldOut:
    found = held_out(h, model(free_start), records(later), (), 14.0)
    assert found is not None
    return found


def test_held_out_is_predicted_with_the_estimates_as_they_are() -> None:
    """A pendulum 5 % longer: refitted it were explained, and proved nothing."""
    h, later = hypothesis(), recorded(5, length=0.0472)
    found = predicted(h, False, later)
    r = misfit(h.minimum.theta, later)
    assert found.rmse["theta"] == pytest.approx(np.sqrt(np.mean(r**2)), rel=1e-3)
    assert found.rmse["theta"] > 5 * SIGMA
    np.testing.assert_allclose(found.predicted - later["theta"].values, r, atol=1e-5)
    # the fit's uncertainty is forgiven: by what both together leave, and the fit alone did not
    best = least_squares(lambda q: np.concatenate([
        white(misfit(q, later)), white(misfit(q, recorded(0)))]), h.minimum.theta,
        x_scale=[0.045, 0.1])
    assert found.chi2 == pytest.approx(2 * best.cost - h.minimum.chi2, rel=5e-3)
    moved = misfit(best.x, later)
    assert found.rmse_moved["theta"] == pytest.approx(np.sqrt(np.mean(moved**2)), rel=1e-2)
    np.testing.assert_allclose(found.moved - later["theta"].values, moved, atol=0.1 * SIGMA)
    (residual,) = found.residuals
    assert residual[:2] == (0, "theta")
    np.testing.assert_allclose(residual[3], r, atol=1e-5)


def test_only_what_a_held_out_recording_has_for_itself_is_estimated_anew() -> None:
    """Its start, not the length that both share."""
    h, later = hypothesis(True, 0.05), recorded(6, -0.06, 0.0472)
    found = predicted(h, True, later)
    values = np.array([h.values["l_theta"], h.values["d_theta"]])
    best = least_squares(lambda q: white(misfit(values, later, float(q[0]))), [-0.06], x_scale=0.1)
    r = misfit(values, later, float(best.x[0]))
    assert found.rmse["theta"] == pytest.approx(np.sqrt(np.mean(r**2)), rel=1e-2)
    assert found.rmse["theta"] > 2 * SIGMA


@pytest.mark.parametrize("drag", [0.4, -0.4])
def test_a_force_that_cannot_push_promises_nothing_where_it_would_have_to(drag: float) -> None:
    h = fitted(model(), [], records(recorded(7, drag=drag)), [{}], 1)
    assert h is not None
    listed = candidates(sites(model(), (recorded(7, drag=drag),)))
    screen = Screen(h, [c for c in listed if c.key in ("quadratic_drag", "cubic_stiffness")])
    of = {c.key: k for k, c in enumerate(screen.found.candidates)}
    (k,) = np.flatnonzero(screen.found.owner == of["quadratic_drag"])
    assert screen.found.one_sided[k] and np.sign(screen.z[k]) == np.sign(drag)
    assert abs(screen.z[k]) > 3
    assert screen.gain[k] == (screen.z[k] ** 2 if drag > 0 else 0.0)
    assert screen.promised(screen.found.candidates[of["quadratic_drag"]]) == screen.gain[k]
    (other,) = np.flatnonzero(screen.found.owner == of["cubic_stiffness"])
    assert not screen.found.one_sided[other] and screen.gain[other] == screen.z[other] ** 2


def test_squares_that_overflow_are_no_residual() -> None:
    """A motion may be finite, and its derivatives in units of the noise not."""
    model = pk.Model.from_dict({
        "states": {"x": {"initial": 1.0}}, "equations": {"x": "a*x"},
        "parameters": {"a": {"guess": 1.0, "bounds": [0.0, 100.0]}},
        "outputs": {"x": {"expression": "x"}}})
    t = np.linspace(0.0, 10.0, 101)
    run = pk.Recording.from_arrays(t, {"x": np.exp(0.1 * t)})
    whitened = Whitened(model, Records((run,), ({"x": NoiseModel(1e-3, 0.0, 0.0, 0.1, "")},),
                                       DEFAULTS))
    assert whitened.choose_steps(np.array([1.0]))
    assert whitened.residual(np.array([1.0])) is not None
    assert whitened.residual(np.array([35.0])) is None


def test_a_sigma_of_each_sample_weighs_it() -> None:
    """Where σ(t) is given, whitened noise has unit variance in every part of a recording."""
    run = pk.simulate(model(), pk.excitation.two_pulse())
    t = run["theta"].time
    sigma = np.where(t < 2.5, 1e-3, 1e-2)
    noisy = run["theta"].values + sigma * np.random.default_rng(0).standard_normal(len(t))
    told = run.with_channels(Channel("theta", t, noisy, "rad", sigma))
    whitened = Whitened(model(), prepared(model(), (told,), None, [], DEFAULTS))
    theta = np.array([0.045, 0.15])
    assert whitened.choose_steps(theta)
    found = whitened.residual(theta)
    assert found is not None
    for part in (t < 2.5, t >= 2.5):
        assert np.std(found[0][part]) == pytest.approx(1, abs=0.15)  # 250 samples: 3 errors
