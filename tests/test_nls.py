"""NLS: exactness on clean data, weighting, joint fits, starts, bounds, failures, verdicts."""

from __future__ import annotations

import interpreted
import numpy as np
import pytest

import pikanid as pk
from pikanid import errors
from pikanid.model import Model, Parameter, systems
from pikanid.objective import shooting
from pikanid.objective.settings import AdequacySettings
from pikanid.recording import Recording, excitation
from pikanid.uncertainty.settings import UncertaintySettings

SIGMA = 0.1 * np.pi / 180
START = systems.sloshing().with_values(l_theta=0.06, d_theta=0.05)
CLEAN = pk.simulate(systems.sloshing(), excitation.two_pulse())
NOISY = pk.simulate(systems.sloshing(), excitation.two_pulse(), sigma=SIGMA, seed=0)


def test_clean_data_give_the_parameters_back() -> None:
    for recording in (CLEAN, CLEAN.decimate(10, channels=["theta"])):
        found = pk.NLS().fit(START, recording)
        assert found.value("l_theta") == pytest.approx(0.045, rel=1e-6)
        assert found.value("d_theta") == pytest.approx(0.15, rel=1e-6)
        assert found.ok


def test_whole_numbers_are_values_like_others() -> None:
    """A model whose values are all written without a point."""
    decay = Model.from_dict({
        "name": "decay", "states": {"x": {"unit": "m", "initial": 1}},
        "parameters": {"k": {"guess": 2, "bounds": [0, 10], "unit": "1/s"}, "c": {"value": 3}},
        "equations": {"x": "-k*x"}, "outputs": {"x": {"unit": "m", "expression": "x"}}})
    t = np.linspace(0.0, 3.0, 60)
    seen = Recording.from_arrays(t, {"x": np.exp(-0.7 * t)}, units={"x": "m"})
    assert pk.NLS().fit(decay, seen).value("k") == pytest.approx(0.7, rel=1e-6)


def test_reference_optimum_of_the_study() -> None:
    """N = 501, σ = 0.1°, default_rng(0): an optimum found by other software."""
    found = pk.NLS().fit(START, NOISY)
    # sub-steps are as fine as a hundredth of a standard error asks for
    difference = np.abs(found.theta - [0.04501202, 0.14891704])
    assert np.all(difference < 0.01 * np.sqrt(np.diag(found.covariance)))
    assert found.cost == pytest.approx(7.814036e-4, rel=1e-6)
    assert found.ok
    assert found.adequacy.source == "given"


def test_standard_errors_are_the_cramer_rao_bound_at_the_estimate() -> None:
    found = pk.NLS().fit(START, NOISY)
    bound = pk.uncertainty.cramer_rao(found.fitted_model, NOISY)
    for name in ("l_theta", "d_theta"):
        assert found.std(name) == pytest.approx(bound.std(name), rel=1e-3)


def test_the_same_seed_gives_the_same_bits() -> None:
    a, b = (pk.NLS(starts=3, seed=5).fit(START, NOISY) for _ in range(2))
    np.testing.assert_array_equal(a.theta, b.theta)
    np.testing.assert_array_equal(a.covariance, b.covariance)
    assert a.history == b.history


def test_noise_that_differs_from_sample_to_sample_is_weighted() -> None:
    """A stretch of wild samples with a large σ does no harm; taken for good ones it would."""
    values = NOISY["theta"].values.copy()
    values[100:200] += np.random.default_rng(1).normal(0, 1.0, 100)
    sigma = np.full(501, SIGMA)
    sigma[100:200] = 1.0
    wild = Recording.from_arrays(NOISY.t, {"u_x": NOISY["u_x"].values, "theta": values},
                                 sigma={"theta": sigma}, hold={"u_x": "zero"})
    found = pk.NLS().fit(START, wild)
    assert found.ok
    assert abs(found.value("l_theta") - 0.045) < 4 * found.std("l_theta")
    blind = pk.NLS().fit(START, wild.with_sigma(theta=None))
    assert abs(blind.value("d_theta") - 0.15) > 4 * found.std("d_theta")


def test_missing_samples_change_nothing_but_the_information() -> None:
    values = NOISY["theta"].values.copy()
    values[[0, 3, 50, 51, 52, 500]] = np.nan
    gappy = NOISY.with_channels(NOISY["theta"].__class__(
        "theta", NOISY.t, values, "rad", SIGMA))
    found = pk.NLS().fit(START, gappy)
    assert found.n == 495
    assert found.ok
    np.testing.assert_allclose(found.theta, pk.NLS().fit(START, NOISY).theta, rtol=0.02)


def test_recordings_fitted_jointly_share_what_is_shared() -> None:
    true = systems.sloshing()
    second = pk.simulate(true.with_values(d_theta=0.3), excitation.two_pulse(amplitude=0.6),
                         sigma=SIGMA, seed=1)
    found = pk.NLS().fit(START.per_recording("d_theta"), [NOISY, second])
    assert [f.label for f in found.free] == ["l_theta", "d_theta[0]", "d_theta[1]"]
    for value, std, expected in ((found.value("l_theta"), found.std("l_theta"), 0.045),
                                 (found.value("d_theta", 0), found.std("d_theta", 0), 0.15),
                                 (found.value("d_theta", 1), found.std("d_theta", 1), 0.30)):
        assert abs(value - expected) < 4 * std
    alone = pk.NLS().fit(START, NOISY)
    assert found.std("l_theta") < alone.std("l_theta")
    tied = pk.NLS().fit(START, [NOISY, second])
    assert not tied.ok  # one damping cannot explain both


def test_all_parameters_fixed_is_a_mere_verdict() -> None:
    found = pk.NLS().fit(systems.sloshing().fix("l_theta", "d_theta"), NOISY)
    assert found.ok
    assert found.theta.shape == (0,)
    wrong = pk.NLS().fit(systems.sloshing().fix("d_theta", l_theta=0.05), NOISY)
    assert not wrong.ok


def test_optimum_at_a_bound_is_named() -> None:
    found = pk.NLS(starts=1).fit(
        START.with_bounds(d_theta=(0.0, 0.1)), NOISY)
    assert found.value("d_theta") == pytest.approx(0.1)
    assert any("bound" in w and "d_theta" in w for w in found.warnings)
    assert np.isnan(found.std("d_theta"))
    assert found.std("l_theta") > 0


def test_a_parameter_without_influence_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    interpreted.instead_of_compiled(monkeypatch)
    found = pk.NLS(starts=1).fit(START.with_parameters(Parameter("idle", 1.0)), NOISY)
    assert any("idle" in w and "no influence" in w for w in found.warnings)
    assert found.value("idle") == 1.0
    assert found.value("l_theta") == pytest.approx(0.04501202, abs=1e-7)


def test_parameters_that_only_act_together_are_named() -> None:
    """d_theta/m: freeing m as well leaves only the ratio determined."""
    found = pk.NLS(starts=1).fit(START.free("m"), NOISY)
    assert any("d_theta" in w and "m" in w and "combination" in w for w in found.warnings)
    assert found.value("d_theta") / found.value("m") == pytest.approx(0.14891704 / 0.3, rel=1e-4)


def test_misfit_is_reported_never_as_success() -> None:
    """Dry friction left out of the model."""
    truth = systems.sloshing().with_term("theta_dot", "-mu*sign(theta_dot)", [Parameter("mu", 2.0)])
    recording = pk.simulate(truth, excitation.two_pulse(), sigma=SIGMA, seed=0)
    found = pk.NLS(starts=1).fit(START, recording)
    assert found.adequacy.verdict == "misfit"
    assert not found.ok
    assert any("does not explain" in w for w in found.warnings)
    right = pk.NLS(starts=1).fit(truth.with_values(mu=1.6), recording)
    assert right.ok
    assert abs(right.value("mu") - 2.0) < 4 * right.std("mu")


def test_settings_say_what_explains_and_what_is_determined() -> None:
    model, rec = pk.systems.sloshing(), pk.simulate(
        pk.systems.sloshing(), pk.excitation.two_pulse(), sigma=0.002, seed=0)
    usual = pk.NLS().fit(model, rec)
    strict = pk.NLS(adequacy=AdequacySettings(alpha=0.999),
                    uncertainty=UncertaintySettings(far=1e-6)).fit(model, rec)
    assert (usual.adequacy.verdict, strict.adequacy.verdict) == ("fits", "misfit")
    assert usual.settings["tried"] == 1 < strict.settings["tried"]
    assert not usual.warnings and any("l_theta" in w for w in strict.warnings)
    assert strict.settings["adequacy"] == {"alpha": 0.999}
    assert "adequacy" not in usual.settings


def test_starts_that_cannot_be_simulated_are_passed_over(monkeypatch: pytest.MonkeyPatch) -> None:
    """x' = k x² explodes for k > 1/2; the fit starts there all the same."""
    monkeypatch.setattr("pikanid.simulation.simulator.FINEST", 8)  # give up sooner
    interpreted.instead_of_compiled(monkeypatch)
    model = Model.from_dict({
        "states": {"x": {"initial": 1.0}}, "parameters": {"k": {"guess": 0.2, "bounds": [-5, 5]}},
        "equations": {"x": "k*x**2"}, "outputs": {"x": {"expression": "x"}}})
    t = np.linspace(0, 2, 41)
    recording = Recording.from_arrays(t, {"x": 1 / (1 - 0.3 * t)})
    found = pk.NLS(starts=1).fit(model, recording)
    assert found.value("k") == pytest.approx(0.3, rel=1e-6)
    far = pk.NLS(starts=6).fit(model.with_values(k=4.0), recording)
    assert far.value("k") == pytest.approx(0.3, rel=1e-6)
    with pytest.raises(errors.SimulationFailed, match="starting point"):
        pk.NLS(starts=1).fit(model.with_values(k=4.0), recording)


def test_unknown_noise_is_estimated_from_the_residual() -> None:
    found = pk.NLS().fit(START, NOISY.with_sigma(theta=None))
    assert found.adequacy.source == "differences"
    assert found.ok
    known = pk.NLS().fit(START, NOISY)
    for name in ("l_theta", "d_theta"):
        assert found.std(name) == pytest.approx(known.std(name), rel=0.15)
        assert found.value(name) == pytest.approx(known.value(name), rel=1e-6)


def test_outputs_of_different_size_are_weighted_by_their_own_noise() -> None:
    """Without σ, an angle in rad and one in thousandths must not count a million to one."""
    model = Model.from_dict({**systems.sloshing().to_dict(), "outputs": {
        "theta": {"expression": "theta"}, "rate": {"expression": "1000*theta_dot"}}})
    recording = pk.simulate(model, excitation.two_pulse(2.0, 0.02), seed=2,
                            sigma={"theta": 1e-3, "rate": 100.0})
    blind = Recording.from_arrays(
        recording.t, {n: recording[n].values for n in ("u_x", "theta", "rate")},
        hold={"u_x": "zero"})
    a = pk.NLS().fit(model.with_values(l_theta=0.06), recording)
    b = pk.NLS().fit(model.with_values(l_theta=0.06), blind)
    assert np.all(np.abs(a.theta - b.theta) < 0.3 * np.sqrt(np.diag(a.covariance)))


def test_paper_protocol_is_best_of_five_within_a_fifth() -> None:
    found = pk.NLS(protocol="paper").fit(START, NOISY)
    assert found.settings["tried"] == 5
    assert found.ok


def test_free_initial_state_and_delay_are_estimated(monkeypatch: pytest.MonkeyPatch) -> None:
    interpreted.instead_of_compiled(monkeypatch)
    truth = systems.sloshing().with_initial(theta="free").map_input(
        "u_x", [Parameter("tau", 0.0137, "s", (0.0, 0.1))], delay="tau").with_values(theta_0=0.05)
    recording = pk.simulate(truth, excitation.two_pulse(2.0, 0.02), sigma=SIGMA, seed=4)
    found = pk.NLS().fit(truth.with_values(theta_0=0.0, tau=0.03, l_theta=0.05), recording)
    assert found.ok
    for name, value in truth.values.items():
        if name in found.model.free_names:
            assert abs(found.value(name) - value) < 4 * found.std(name)


@pytest.mark.slow
def test_multiple_shooting_finds_a_long_chaotic_record() -> None:
    """A driven Duffing oscillator past the horizon of single shooting from a distant guess."""
    truth = systems.duffing_oscillator().with_bounds(k=(-50.0, 50.0)).with_values(
        k=-1.0, k3=1.0, c=0.3).fix("b")
    t = np.arange(0, 60, 0.05)
    drive = Recording.from_arrays(t, {"u": 0.5 * np.cos(1.2 * t)}, hold={"u": "first"})
    recording = pk.simulate(truth, drive, sigma=0.01, seed=0)
    guess = truth.with_values(k=-0.6, k3=0.7, c=0.5)
    found = pk.NLS(segments=30, starts=1).fit(guess, recording)
    assert found.ok
    for name, value in (("k", -1.0), ("k3", 1.0), ("c", 0.3)):
        assert abs(found.value(name) - value) < 4 * found.std(name)


def oscillator(**values: float) -> Model:
    """Rings freely from 1: χ² has a minimum near every frequency that fits a few periods less."""
    return Model.from_dict({
        "name": "oscillator", "states": {"x": {"unit": "m", "initial": 1.0}, "v": {"unit": "m/s"}},
        "parameters": {"w": {"unit": "rad/s", "guess": 5.0, "bounds": [1, 10]}},
        "equations": {"x": "v", "v": "-w**2*x"},
        "outputs": {"x": {"unit": "m", "expression": "x"}}}).with_values(**values)


def test_of_several_minima_the_lowest_is_kept() -> None:
    t = np.linspace(0.0, 8.0, 161)
    nothing = Recording.from_arrays(t, {"x": np.zeros(161)}, units={"x": "m"})
    truth = pk.simulate(oscillator(), nothing, sigma=0.01, seed=2)
    found = pk.NLS(starts=20, seed=1).fit(oscillator(w=1.5), truth)
    costs = [h["cost"] for h in found.history]
    assert abs(found.value("w") - 5.0) < 4 * found.std("w")
    assert max(costs) > 100 * min(costs)  # starts do end elsewhere


def test_simulations_of_a_start_are_limited() -> None:
    free, few = (pk.NLS(starts=1, max_evaluations=n).fit(START, NOISY) for n in (100, 3))
    assert free.converged and free.history[0]["evaluations"] > 8
    assert not few.converged and few.history[0]["evaluations"] <= 2 * (3 + 3)


def test_the_best_start_gets_the_steps_that_it_needs(monkeypatch: pytest.MonkeyPatch) -> None:
    """The limit that other starts keep to is not for it."""
    model = systems.pendulum().with_values(theta_0=1.2)
    swing = excitation.free_decay(8.0, channels=["u"])
    recording = pk.simulate(model, swing, sigma=0.01, seed=0).without("u")
    chosen: list[tuple[bool, np.ndarray]] = []
    choose = shooting.Shooting.choose_steps

    def noted(self: shooting.Shooting, theta: np.ndarray, accuracy: shooting.Accuracy) -> bool:
        changed = choose(self, theta, accuracy)
        chosen.append((not self.limits, theta))
        return changed

    monkeypatch.setattr(shooting.Shooting, "choose_steps", noted)
    found = pk.NLS(starts=4).fit(model, recording)
    free, theta = chosen[-1]
    assert free and not all(other for other, _ in chosen)
    np.testing.assert_array_equal(theta, found.theta)
