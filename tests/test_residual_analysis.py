"""Residual analysis: numbers against statsmodels and SciPy, rates over many clean recordings."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.signal import lfilter
from scipy.stats import binomtest

import pikanid as pk
from pikanid import errors
from pikanid.comparison.correlations import _moments, autocorrelation, jointly, with_columns
from pikanid.comparison.spectrum import spectrum
from pikanid.comparison.whitened import White, whitened
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.mismatch.steps.opening import open_case

N, SIGMA = 300, 2e-3
NONE = np.empty((N, 0))


def plain(r: np.ndarray, J: np.ndarray = NONE, rho: float | None = 0.0) -> White:
    t = 0.01 * np.arange(len(r))
    return whitened(t, r, np.ones(len(r)), J, np.empty((len(r), 0)), np.empty((0, 0)), rho)


def test_of_white_noise_without_parameters_it_is_ljung_and_box() -> None:
    diagnostic = pytest.importorskip("statsmodels.stats.diagnostic")
    tools = pytest.importorskip("statsmodels.tsa.stattools")
    r = np.random.default_rng(0).standard_normal(N)
    r -= r.mean()
    found, joint = autocorrelation(plain(r), 20)
    assert np.allclose(found.values, tools.acf(r, nlags=20)[1:], atol=1e-12)
    oracle = diagnostic.acorr_ljungbox(r, lags=[20])
    assert joint.statistic == pytest.approx(float(oracle["lb_stat"].iloc[0]), rel=1e-9)
    assert joint.p_value == pytest.approx(float(oracle["lb_pvalue"].iloc[0]), rel=1e-9)
    fitted = autocorrelation(replace(plain(r), rho=0.4, estimated=True), 20)[1]
    assert fitted.dof == 19


def test_moments_are_those_of_the_quadratic_forms() -> None:
    """Against the matrices themselves, on a grid with gaps, fitted and carried directions."""
    rng = np.random.default_rng(1)
    size, lags = 60, 4
    there = np.ones(size)
    there[[5, 6, 20]] = 0.0
    M = np.diag(there)
    Q, _ = np.linalg.qr(M @ rng.standard_normal((size, 2)))
    W = np.concatenate([Q, 0.3 * M @ rng.standard_normal((size, 1))], axis=1)
    D = np.array([-1.0, -1.0, 1.0])
    S = M + W @ np.diag(D) @ W.T
    shifts = [0.5 * (np.eye(size, k=k) + np.eye(size, k=-k)) for k in range(1, lags + 1)]
    power = np.trace(S)
    mean = [np.trace(A @ S) / power for A in shifts]
    covariance = np.array([[2 * np.trace(A @ S @ B @ S) for B in shifts] for A in shifts])
    covariance /= power**2 + 2 * np.trace(S @ S)
    found = _moments(there, W, D, lags)
    assert np.allclose(found[0], mean, atol=1e-12)
    assert np.allclose(found[1], covariance, atol=1e-12)


def test_independence_is_the_partial_f_test() -> None:
    """Of regressors that come on top of those that were fitted."""
    sm = pytest.importorskip("statsmodels.api")
    rng = np.random.default_rng(2)
    J, X, y = (rng.standard_normal(shape) for shape in ((N, 2), (N, 3), N))
    y += 0.1 * X[:, 0]
    small, large = sm.OLS(y, J).fit(), sm.OLS(y, np.hstack([J, X])).fit()
    f, p, dof = large.compare_f_test(small)
    found = jointly(plain(y, J), X, "independence", "u")
    assert found is not None and found.dof == dof
    assert found.statistic == pytest.approx(f, rel=1e-9)
    assert found.p_value == pytest.approx(p, rel=1e-9)


def test_what_the_fit_takes_up_has_no_band_and_no_test() -> None:
    rng = np.random.default_rng(3)
    J, y = rng.standard_normal((N, 1)), rng.standard_normal(N)
    white = plain(y, J)
    values, std = with_columns(white, np.hstack([J, rng.standard_normal((N, 1))]))
    assert abs(values[0]) < 1e-12 and std[0] < 1e-7
    assert std[1] == pytest.approx(1 / np.sqrt(N), rel=0.05)
    assert jointly(white, 2 * J, "independence", "u") is None


def test_spectrum_and_coherence_are_those_of_scipy() -> None:
    signal = pytest.importorskip("scipy.signal")
    rng = np.random.default_rng(4)
    u = rng.standard_normal(1600)
    r = lfilter([0.3], [1.0, -0.5], u) + rng.standard_normal(1600)
    found = spectrum(r, 0.01, 0.0, {"u": u}, 0.01)
    assert found is not None
    how = {"fs": 100.0, "window": "hann", "nperseg": 100, "noverlap": 0}
    f, power = signal.welch(r, **how)
    gamma = signal.coherence(u, r, **how)[1]
    assert np.allclose(found.frequency, f[1:])
    assert np.allclose(found.power[:-1], power[1:-1])  # the last line, SciPy counts once
    assert np.allclose(found.coherence["u"], gamma[1:], atol=1e-12)
    assert found.limit == pytest.approx(1 - 0.01 ** (1 / 15))


def coloured(rho: float, n: int, rng: np.random.Generator) -> np.ndarray:
    e = rng.standard_normal(n + 200)
    return lfilter([np.sqrt(1 - rho**2)], [1.0, -rho], e)[200:]


def with_noise(clean: pk.Recording, rho: float, rng: np.random.Generator) -> pk.Recording:
    y = clean["theta"]
    return clean.with_channels(replace(
        y, values=y.values + SIGMA * coloured(rho, len(y.values), rng), sigma=SIGMA))


def rejections(count: int, rho: float, held_out: bool) -> dict[tuple[str, str], np.ndarray]:
    """p-values of every joint test on so many clean recordings of the slosh model."""
    model = pk.systems.sloshing()
    clean = pk.simulate(model, pk.excitation.multisine(duration=5.0))
    other = pk.simulate(model, pk.excitation.chirp(duration=5.0))
    found = defaultdict(list)
    for k in range(count):
        rng = np.random.default_rng([k, int(10 * rho), held_out])
        seen = with_noise(clean, rho, rng)
        est = pk.NLS(starts=1).fit(model, seen)
        (one,) = est.resid(with_noise(other, rho, rng) if held_out else seen)
        for t in one.tests:
            found[t.kind, t.of].append(t.p_value)
    return {key: np.array(values) for key, values in found.items()}


def at_their_rates(found: dict[tuple[str, str], np.ndarray], confidence: float) -> list[object]:
    """Tests whose rate of rejection lies outside of its Wilson interval, at three levels."""
    wrong: list[object] = []
    for key, p in found.items():
        for level in (0.01, 0.05, 0.2):
            count = int(np.sum(p < level))
            low, high = binomtest(count, len(p)).proportion_ci(confidence, "wilson")
            if not low <= level <= high:
                wrong.append((key, level, count, len(p)))
    return wrong


@pytest.mark.parametrize(("rho", "held_out"), [(0.0, False), (0.6, True)])
def test_right_models_are_rejected_at_the_stated_rates(rho: float, held_out: bool) -> None:
    assert at_their_rates(rejections(60, rho, held_out), 0.999) == []


@pytest.mark.slow
@pytest.mark.parametrize("held_out", [False, True])
@pytest.mark.parametrize("rho", [0.0, 0.6])
def test_400_right_models_are_rejected_at_the_stated_rates(rho: float, held_out: bool) -> None:
    """24 rates are looked at: together they hold at 99 %."""
    found = rejections(400, rho, held_out)
    assert len(found) == 8
    assert at_their_rates(found, 1 - 0.01 / 24) == []


def test_rates_need_the_noise_model() -> None:
    """Negative control: AR(1) noise taken for white, and the tests reject a right model."""
    model = pk.systems.sloshing()
    clean = pk.simulate(model, pk.excitation.multisine(duration=5.0))
    rec = with_noise(clean, 0.6, np.random.default_rng(0))
    est = pk.NLS(starts=1).fit(model, rec)
    assert pk.resid(est, rec)[0].ok
    (wrong,) = pk.resid(est, rec, rho=0.0)
    assert not wrong.ok and wrong.test("whiteness").p_value < 1e-9


@pytest.mark.parametrize("rho", [0.0, 0.6])
def test_a_missing_effect_is_seen(rho: float) -> None:
    """Drag left out: what is left is correlated, and the sentence says so."""
    model = pk.systems.sloshing()
    true = model.with_term("theta_dot", "-1.0*theta_dot*abs(theta_dot)")
    drive = pk.excitation.multisine(duration=10.0)
    seen = 0
    for seed in range(5):
        rec = with_noise(pk.simulate(true, drive), rho, np.random.default_rng(seed))
        (found,) = pk.NLS(starts=1).fit(model, rec).resid(rec)
        seen += not found.ok
    assert seen == 5
    assert "no noise" in found.sentence() and found.feedback == ()


@pytest.mark.parametrize("term", ["0.0", "-1.0*theta_dot*abs(theta_dot)", "-1.0*sign(theta_dot)",
                                  "-400.0*theta**3"])
def test_it_rejects_where_a_diagnosis_does(term: str) -> None:
    """At the same 1 %: both see what is left out, and neither sees what is not there."""
    model = pk.systems.sloshing()
    true = model.with_term("theta_dot", term)
    rec = with_noise(pk.simulate(true, pk.excitation.multisine(duration=10.0)), 0.0,
                     np.random.default_rng(1))
    (left,) = pk.NLS(starts=1).fit(model, rec).resid(rec)
    case = open_case(model, (rec,), None, None, lambda text: None, DEFAULTS)
    diagnosed = case.detected().p_value < DEFAULTS.alpha
    assert diagnosed == (not left.ok) == (term != "0.0")


@pytest.mark.parametrize("gain", [0.0, 20.0])
def test_feedback_is_seen_and_not_read_into_open_loops(gain: float) -> None:
    """A controller that pushes against what it measured in the sample before, noise and all."""
    model = pk.Model.from_dict({
        "name": "mass", "states": {"x": {"unit": "m"}, "v": {"unit": "m/s"}},
        "inputs": {"u": {"unit": "m/s^2", "hold": "zero"}},
        "parameters": {"k": {"guess": 40.0, "unit": "1/s^2", "bounds": [1, 200]}},
        "equations": {"x": "v", "v": "-k*x - 0.8*v + u"},
        "outputs": {"x": {"expression": "x", "unit": "m"}}})
    rng, n, dt = np.random.default_rng(5), 1000, 0.02
    whole = expm(dt * np.array([[0.0, 1.0, 0.0], [-40.0, -0.8, 1.0], [0.0, 0.0, 0.0]]))
    dither = np.repeat(rng.normal(0.0, 2.0, n // 10), 10)
    x, u, y = np.zeros(2), np.zeros(n), np.zeros(n)
    for k in range(n):
        y[k] = x[0] + 0.01 * rng.standard_normal()
        u[k] = dither[k] - gain * y[k - 1]
        x = whole[:2, :2] @ x + whole[:2, 2] * u[k]
    rec = pk.Recording.from_arrays(dt * np.arange(n), {"u": u, "x": y}, {"u": "m/s^2", "x": "m"},
                                   {"x": 0.01}, {"u": "zero"})
    (found,) = pk.resid(model, rec)
    assert found.ok
    assert found.feedback == (("u",) if gain else ())
    cross = found.crosscorrelation["u"]
    assert (cross.lags[np.argmax(np.abs(cross.values / cross.std))] == -1) == bool(gain)
    assert any("feedback" in note for note in pk.validate(model, rec).notes) == bool(gain)


def test_gaps_uneven_times_and_an_input_at_rest() -> None:
    model = pk.systems.sloshing()
    rec = pk.simulate(model, pk.excitation.multisine(duration=6.0), sigma=SIGMA, seed=1)
    y = rec["theta"].values.copy()
    y[np.random.default_rng(0).random(len(y)) < 0.2] = np.nan
    (found,) = pk.resid(model, rec.with_channels(replace(rec["theta"], values=y)))
    assert found.ok and len(found.residual) == np.isfinite(y).sum()
    t = np.sort(np.random.default_rng(1).uniform(0, 6, 400))
    uneven = pk.simulate(model, pk.excitation.multisine(duration=6.0), sigma=SIGMA, seed=2, t=t)
    assert pk.resid(model, uneven)[0].ok
    still = pk.simulate(model.with_initial(theta=0.2), pk.Recording.from_arrays(
        rec.t, {"u_x": 0 * rec.t}, {"u_x": "m/s^2"}), sigma=SIGMA, seed=3)
    (free,) = pk.resid(model.with_initial(theta=0.2), still)
    assert not free.crosscorrelation
    with pytest.raises(KeyError):
        free.test("independence", "u_x")
    assert len(free.plot().axes) == 5


def test_the_figure_has_a_panel_a_question_and_units() -> None:
    model = pk.systems.sloshing()
    rec = pk.simulate(model, pk.excitation.multisine(duration=6.0), sigma=SIGMA, seed=1)
    axes = pk.resid(model, rec)[0].plot().axes
    assert [a.get_ylabel() for a in axes] == [
        "autocorrelation", "correlation with u_x", "residual [s.d.]", "power density [rad²/Hz]",
        "coherence γ² with u_x", *["residual [s.d.]"] * 3]
    assert [a.get_xlabel() for a in axes[-3:]] == ["theta [rad]", "theta_dot [rad/s]",
                                                  "u_x [m/s²]"]


@pytest.mark.parametrize("options", [{"lags": 0}, {"rho": 1.0}, {"alpha": 0.0}])
def test_what_cannot_be_is_refused(options: dict[str, float]) -> None:
    model = pk.systems.sloshing()
    rec = pk.simulate(model, pk.excitation.two_pulse(), sigma=SIGMA)
    with pytest.raises(errors.BadSetting):
        pk.resid(model, rec, **options)  # type: ignore[arg-type]
