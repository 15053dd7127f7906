"""iPDA: the two presets, accuracy against the bound, joint fits, and how it fails."""

from __future__ import annotations

import numpy as np
import pytest
from relaxing import BOUND, TRUTH, guessed, slosh
from scipy.stats import chi2

import pikanid as pk
from pikanid import errors
from pikanid.problem.problem import Problem
from pikanid.strategies.ipda import IPDA, fit_relaxed
from pikanid.strategies.settings import RelaxationSettings

NEIGHBOURS = [(0.06, 0.05), (0.048, 0.04), (0.072, 0.06), (0.072, 0.04)]


def rmse_over_bound(stride: int, degrees: float, seeds: range) -> np.ndarray:
    """RMSE of (l, d) in units of the Cramér-Rao bound; starts from all neighbours in turn."""
    misses = []
    for seed in seeds:
        model = guessed(*NEIGHBOURS[seed % len(NEIGHBOURS)])
        fit = fit_relaxed(Problem(model, slosh(degrees, seed, stride, seed % 2 == 0)), IPDA())
        assert fit.converged and not fit.warnings
        misses.append((fit.theta - TRUTH) / BOUND[stride, degrees])
    return np.sqrt(np.mean(np.square(misses), axis=0))


@pytest.mark.parametrize(("stride", "degrees"), BOUND)
def test_reaches_the_bound(stride: int, degrees: float) -> None:
    count = 16
    limits = np.sqrt(chi2.ppf([5e-4, 1 - 5e-4], count) / count)
    found = rmse_over_bound(stride, degrees, range(count))
    assert np.all((limits[0] < found) & (found < limits[1])), found


@pytest.mark.slow
@pytest.mark.parametrize(("stride", "degrees"), BOUND)
def test_as_good_as_nls_over_many_seeds(stride: int, degrees: float) -> None:
    misses = {"ipda": [], "nls": []}
    inside = []
    for seed in range(100):
        rec = slosh(degrees, seed, stride)
        fit = fit_relaxed(Problem(guessed(), rec), IPDA())
        misses["ipda"].append(fit.theta - TRUTH)
        misses["nls"].append(pk.NLS().fit(guessed(), rec).theta - TRUTH)
        inside.append(np.abs(fit.theta - TRUTH) < 1.96 * fit.std)
    rmse = {k: np.sqrt(np.mean(np.square(v), axis=0)) for k, v in misses.items()}
    assert np.all(rmse["ipda"] <= 1.05 * rmse["nls"])
    coverage = np.mean(inside, axis=0)
    assert np.all((coverage > 0.87) & (coverage < 0.995))


@pytest.mark.parametrize("start", NEIGHBOURS)
@pytest.mark.parametrize("form", ["second_order", "state"])
def test_clean_data(start: tuple[float, float], form: str) -> None:
    est = IPDA(form=form).fit(guessed(*start), slosh())
    assert np.all(np.abs(est.theta / TRUTH - 1) < 1e-5)
    assert est.ok


@pytest.mark.parametrize(("options", "wanted"), [
    ({}, (0.0488, 0.174)),
    ({"knots": "uniform"}, (0.0488, 0.174)),
    ({"knots": "uniform", "physics": "integral"}, (0.0474, 0.176)),
    ({"knots": "uniform", "form": "state"}, (0.50, 0.22)),
])
def test_paper_protocol(options: dict[str, str], wanted: tuple[float, float]) -> None:
    # In the state form 1/l runs to 0: l ends at its bound.
    model = guessed().with_bounds(l_theta=(0.005, 0.5))
    est = IPDA(protocol="paper", **options).fit(model, slosh())
    assert est.theta[0] == pytest.approx(wanted[0], rel=2e-3)
    assert est.theta[1] == pytest.approx(wanted[1], rel=2e-2)
    assert est.settings["degree"] == 3 and est.settings["intervals"] == 80
    assert est.settings["lam"] == 1e-4
    assert est.adequacy.verdict == "misfit"  # a biased fit is not a success


def test_paper_protocol_doubles_lambda_where_sparse() -> None:
    est = IPDA(protocol="paper").fit(guessed(), slosh(0.1, stride=10))
    assert est.settings["lam"] == 2e-4 and est.settings["intervals"] == 25


def test_bias_of_smooth_splines_falls_as_their_spacing() -> None:
    """θ'' jumps where the input switches and a C² spline cannot: the paper's systematic bias."""
    bias = [IPDA(protocol="paper", knots="uniform", intervals=g).fit(
        guessed(), slosh()).theta[0] / TRUTH[0] - 1 for g in (40, 80, 160)]
    assert bias[0] > 1.5 * bias[1] > 2.0 * bias[2] > 0.0
    aligned = IPDA(knots="aligned", intervals=160).fit(guessed(), slosh(0.1))
    assert abs(aligned.theta[0] / TRUTH[0] - 1) < 1e-3


@pytest.mark.parametrize("knots", ["uniform", "curvature", "aligned"])
@pytest.mark.parametrize("degrees", [0.1, 1.0])
def test_too_large_a_lambda_is_stepped_back_from(knots: str, degrees: float) -> None:
    """At a large λ coarse smooth splines lock to 1/l -> 0; λ must stop before that."""
    model = guessed()
    locked = fit_relaxed(Problem(model, slosh(degrees)),
                         IPDA(knots=knots, intervals=40, lam=1e8))
    assert locked.theta[0] > 0.06
    fit = fit_relaxed(Problem(model, slosh(degrees)), IPDA(knots=knots, intervals=40))
    assert 0.044 < fit.theta[0] < 0.055
    assert any("λ stays at" in note for note in fit.warnings)


def test_default_agrees_with_nls_on_other_systems() -> None:
    square = 20 * np.sign(np.sin(1.3 * np.arange(0, 20, 0.01)) + 0.3)
    duffing = pk.systems.duffing_oscillator()
    drive = pk.Recording.from_arrays(np.arange(0, 20, 0.01), {"u": square}, units={"u": "N"},
                                     hold={"u": "zero"})
    rec = pk.simulate(duffing, drive, sigma=0.01, seed=1)
    far = duffing.with_values(k=30.0, k3=5.0, c=1.0, b=0.8)
    nls, ipda = pk.NLS().fit(far, rec), IPDA().fit(far, rec)
    std = np.sqrt(np.diag(nls.covariance))
    assert np.all(np.abs(nls.theta - ipda.theta) < 0.1 * std)
    assert np.allclose(np.sqrt(np.diag(ipda.covariance)), std, rtol=0.02)


def test_estimated_start_joint_recordings_and_a_parameter_each() -> None:
    model = guessed().with_initial(theta="free", theta_dot="free").per_recording("d_theta")
    recs = [slosh(0.1, seed) for seed in range(3)]
    nls, ipda = pk.NLS().fit(model, recs), IPDA().fit(model, recs)
    std = np.sqrt(np.diag(nls.covariance))
    assert [f.label for f in ipda.free] == [f.label for f in nls.free]
    assert np.all(np.abs(nls.theta - ipda.theta) < 0.1 * std)
    assert np.allclose(np.sqrt(np.diag(ipda.covariance)), std, rtol=0.02)


def test_unmeasured_states_and_a_nonlinear_output() -> None:
    """Weak physics leads astray here; the second path, from the simulated guess, does not."""
    model = pk.Model.from_dict({
        "name": "reaction",
        "states": {"a": {"initial": 1.0}, "b": {"initial": 0.0}, "c": {"initial": 0.0}},
        "parameters": {"k1": {"guess": 2.0, "bounds": [0, 100]},
                       "k2": {"guess": 200.0, "bounds": [0, 1e5]},
                       "k3": {"guess": 1.0, "bounds": [0, 50]}},
        "equations": {"a": "-k1*a + k3*b", "b": "k1*a - k2*b**2 - k3*b", "c": "k2*b**2"},
        "outputs": {"c": {"expression": "c"}, "y": {"expression": "a**2 + b"}}})
    t = np.arange(0, 3, 0.02)
    quiet = pk.Recording.from_arrays(t, {"nothing": np.zeros(t.size)})
    rec = pk.simulate(model, quiet, sigma=0.002, seed=3)
    far = model.with_values(k1=1.0, k2=100.0, k3=2.0)
    est = IPDA().fit(far, rec)
    assert np.all(np.abs(est.theta - [2.0, 200.0, 1.0]) < 3.5 * np.sqrt(np.diag(est.covariance)))
    assert est.ok


def test_inputs_that_change_at_every_sample() -> None:
    t = np.arange(0, 10, 0.01)
    noise = np.random.default_rng(99).normal(size=t.size)
    drive = pk.Recording.from_arrays(t, {"u_x": noise}, units={"u_x": "m/s^2"},
                                     hold={"u_x": "zero"})
    rec = pk.simulate(pk.systems.sloshing(), drive, sigma=0.002, seed=0)
    est = IPDA().fit(guessed(), rec)
    assert np.all(np.abs(est.theta - TRUTH) < 3.5 * np.sqrt(np.diag(est.covariance)))
    assert est.settings["degree"] == 3 and est.ok


def test_missing_samples_and_sigma_a_sample() -> None:
    whole = slosh(0.1, seed=4)
    values = whole["theta"].values.copy()
    values[100:140] = np.nan
    sigma = np.where(np.arange(501) < 250, 0.1, 1.0) * np.pi / 180
    holed = pk.Recording({"u_x": whole["u_x"], "theta": pk.Channel(
        "theta", whole["theta"].time, values, "rad", sigma)})
    nls, ipda = pk.NLS().fit(guessed(), holed), IPDA().fit(guessed(), holed)
    std = np.sqrt(np.diag(nls.covariance))
    assert np.all(np.abs(nls.theta - ipda.theta) < 0.05 * std)


def test_unknown_sigma_is_estimated() -> None:
    est = IPDA().fit(guessed(), slosh(1.0, seed=5, known=False))
    given = IPDA().fit(guessed(), slosh(1.0, seed=5))
    assert np.allclose(est.theta, given.theta, rtol=1e-3)
    assert np.allclose(np.sqrt(np.diag(est.covariance)), np.sqrt(np.diag(given.covariance)),
                       rtol=0.1)


def test_bounds_hold() -> None:
    est = IPDA().fit(guessed().with_bounds(l_theta=(0.05, 0.5)), slosh(0.1))
    assert est.value("l_theta") == pytest.approx(0.05)
    assert np.isnan(est.std("l_theta")) and np.isfinite(est.std("d_theta"))
    assert est.adequacy.verdict == "misfit"


def test_missing_physics_is_a_misfit_where_nls_ends_too() -> None:
    rec = pk.simulate(
        pk.systems.sloshing().with_term("theta_dot", "-80*theta**3"), pk.excitation.two_pulse(),
        sigma=0.1 * np.pi / 180, seed=0)
    nls, ipda = pk.NLS().fit(guessed(), rec), IPDA().fit(guessed(), rec)
    assert nls.adequacy.verdict == ipda.adequacy.verdict == "misfit"
    assert np.allclose(nls.theta, ipda.theta, rtol=1e-3)


def test_unsmooth_model_is_named() -> None:
    model = pk.systems.sloshing().with_term(
        "theta_dot", "-mu*sign(theta_dot)", [pk.Parameter("mu", 0.3, bounds=(0.0, 10.0))])
    rec = pk.simulate(model, pk.excitation.two_pulse(), sigma=0.1 * np.pi / 180, seed=0)
    est = IPDA().fit(model, rec)
    assert any("not smooth" in note for note in est.warnings)


def test_parameter_without_influence() -> None:
    model = guessed().with_parameters(pk.Parameter("idle", 3.0))
    est = IPDA().fit(model, slosh(0.1))
    assert est.value("idle") == 3.0 and np.isinf(est.std("idle"))
    assert est.value("l_theta") == pytest.approx(TRUTH[0], rel=2e-3)


def test_estimate_keeps_the_splines(tmp_path) -> None:  # type: ignore[no-untyped-def]
    est = IPDA().fit(guessed(), slosh(0.1))
    t = est.trajectories[0].t
    # a grid is kept once θ has settled, the rate's error is then an order larger than the angle's
    gap = np.abs(est.approximator.states(t) - est.trajectories[0].x).max(axis=0)
    assert gap[0] < 1e-6 and gap[1] < 4e-5
    finer = IPDA(settings=RelaxationSettings(settled=0.0, refinements=1)).fit(guessed(), slosh(0.1))
    assert np.allclose(finer.approximator.states(t), finer.trajectories[0].x, atol=1e-5)
    assert est.settings["naive_std"][0] == pytest.approx(est.std("l_theta"), rel=0.05)
    assert [h["lam"] for h in est.history][:2] == [1.0, 1e4]
    est.save(tmp_path / "estimate.json")
    back = pk.Estimate.load(tmp_path / "estimate.json")
    assert np.array_equal(back.theta, est.theta) and back.settings == est.settings


def test_same_result_every_time() -> None:
    first, second = (IPDA().fit(guessed(), slosh(1.0, known=False)) for _ in range(2))
    assert np.array_equal(first.theta, second.theta)
    assert np.array_equal(first.covariance, second.covariance)


@pytest.mark.parametrize("options", [
    {"degree": 1}, {"degree": 0}, {"intervals": 0}, {"lam": -1.0}, {"warmup": -1},
    {"protocol": "peper"}, {"knots": "random"}, {"physics": "guess"}, {"form": "third"}])
def test_bad_options(options: dict[str, object]) -> None:
    with pytest.raises(errors.BadSetting):
        IPDA(**options).fit(guessed(), slosh(0.1))  # type: ignore[arg-type]


def test_cost_grows_linearly() -> None:
    """Coefficients, band and border of a record ten times as long are ten times as many."""
    sizes = []
    for repeats in (1, 10):
        t = np.arange(0, 5.0 * repeats, 0.01)
        drive = pk.Recording.from_arrays(
            t, {"u_x": np.where(t % 2.0 < 0.4, 1.0, 0.0)}, units={"u_x": "m/s^2"},
            hold={"u_x": "zero"})
        rec = pk.simulate(pk.systems.sloshing(), drive, sigma=0.002, seed=0)
        fit = fit_relaxed(Problem(guessed(), rec), IPDA())
        sizes.append((fit.coefficients[0].size, fit.iterations))
    assert sizes[1][0] < 11 * sizes[0][0]
    assert sizes[1][1] < 2 * sizes[0][1]
