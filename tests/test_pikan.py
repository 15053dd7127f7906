"""PIKAN: accuracy against NLS, the network that it hands over, side effects, and how it fails."""

from __future__ import annotations

import numpy as np
import pytest
from relaxing import BOUND, DEGREE, TRUTH, guessed, slosh

import pikanid as pk
from pikanid import errors

torch = pytest.importorskip("torch", reason="needs the `kan` extra")
pytest.importorskip("kan.MultKAN", reason="needs the `kan` extra")

from pikanid.strategies.pikan import PIKAN  # noqa: E402

pytestmark = pytest.mark.kan


def std(estimate: pk.Estimate) -> np.ndarray:
    return np.sqrt(np.diag(estimate.covariance))


def versus_nls(strategy: PIKAN, stride: int, degrees: float, seeds: range
               ) -> tuple[np.ndarray, np.ndarray]:
    """RMSE over NLS's on the same seeds, and the share of 95 % intervals that hold the truth."""
    misses, nls, inside = [], [], []
    for seed in seeds:
        rec = slosh(degrees, seed, stride)
        est = strategy.fit(guessed(), rec)
        assert est.converged and not est.warnings
        misses.append(est.theta - TRUTH)
        nls.append(pk.NLS().fit(guessed(), rec).theta - TRUTH)
        inside.append(np.abs(misses[-1]) < 1.96 * std(est))
    rmse = [np.sqrt(np.mean(np.square(m), axis=0)) for m in (misses, nls)]
    return rmse[0] / rmse[1], np.mean(inside, axis=0)


@pytest.mark.parametrize(("stride", "degrees"), BOUND)
def test_as_good_as_nls(stride: int, degrees: float) -> None:
    ratio, _ = versus_nls(PIKAN(), stride, degrees, range(4))
    assert np.all(ratio <= 1.05)


@pytest.mark.slow
@pytest.mark.parametrize(("stride", "degrees"), BOUND)
def test_as_good_as_nls_over_many_seeds(stride: int, degrees: float) -> None:
    ratio, coverage = versus_nls(PIKAN(), stride, degrees, range(100))
    assert np.all(ratio <= 1.05)
    assert np.all((coverage > 0.87) & (coverage < 0.995))


@pytest.mark.parametrize("form", ["second_order", "state"])
def test_clean_data(form: str) -> None:
    est = PIKAN(form=form).fit(guessed(), slosh())  # type: ignore[arg-type]
    assert np.all(np.abs(est.theta / TRUTH - 1) < 1e-6)
    assert est.ok


def test_standard_errors_are_those_of_nls() -> None:
    rec = slosh(0.1, seed=3)
    pikan, nls = PIKAN().fit(guessed(), rec), pk.NLS().fit(guessed(), rec)
    assert np.allclose(std(pikan), std(nls), rtol=0.01)
    assert np.all(np.abs(pikan.theta - nls.theta) < 0.05 * std(nls))
    assert pikan.settings["effective_parameters"] == pytest.approx(2.0, abs=0.3)


def test_unknown_sigma_is_estimated() -> None:
    est = PIKAN().fit(guessed(), slosh(1.0, seed=5, known=False))
    given = PIKAN().fit(guessed(), slosh(1.0, seed=5))
    assert np.all(np.abs(est.theta - given.theta) < 0.05 * std(given))
    assert np.allclose(std(est), std(given), rtol=0.1)


def test_the_network_is_pykans_and_is_the_fitted_curve() -> None:
    est = PIKAN().fit(guessed(), slosh(0.1))
    curves = est.approximator
    network = curves.networks[0][0]
    t = np.linspace(0.0, 5.0, 601)
    assert type(curves.kan).__mro__[1].__module__ == "kan.MultKAN"
    own = curves.kan(torch.tensor(t[:, None])).detach().numpy()[:, 0]
    kinks = sum(kink(t)[:, 0] for kink in network.kinks)
    states = curves.states(t)
    assert np.abs(own + kinks - states[:, 0]).max() <= 1e-12 * np.abs(states[:, 0]).max()
    assert np.abs(own).max() < 2.0 * np.abs(states[:, 0]).max()  # nothing cancels
    assert {kink.time for kink in network.kinks} == {0.2, 0.6, 1.2, 1.6}
    # λ stops where it moves θ by less than 0.05 standard errors; by as much may the curve still
    # lie off the model's own trajectory, whose standard error is about σ√(2 of 501 samples).
    trajectory = est.trajectories[0]
    off = np.abs(curves.states(trajectory.t) - trajectory.x).max(axis=0)
    ranges = np.abs(trajectory.x).max(axis=0)
    assert np.all(off < 0.05 * 0.1 * DEGREE * np.sqrt(2 / 501) * ranges / ranges[0])


def test_its_own_methods_work_and_leave_nothing_open() -> None:
    import matplotlib.pyplot as plt

    kan = PIKAN(grid=40).fit(guessed(), slosh(0.1)).approximator.kan
    kan.plot()
    kan.prune()
    assert kan.refine(80).grid == 80
    assert plt.get_fignums() == []


def test_same_result_every_time_whatever_the_global_generators() -> None:
    fits = []
    for state in (0, 1):
        torch.manual_seed(state)
        fits.append(PIKAN().fit(guessed(), slosh(1.0)))
    assert np.array_equal(fits[0].theta, fits[1].theta)
    assert np.array_equal(fits[0].covariance, fits[1].covariance)


def test_settings_and_progress_say_how_lambda_moved() -> None:
    told: list[dict[str, float]] = []
    est = PIKAN(progress=told.append).fit(guessed(), slosh(0.1))
    assert [row["lam"] for row in told] == [row["lam"] for row in est.history]
    assert set(told[0]) == {"grid", "lam", "data", "physics"}
    assert [row["grid"] for row in told] == sorted(row["grid"] for row in told)
    assert est.settings["lam"] == told[-1]["lam"]
    assert "0.05 standard errors" in est.settings["lam_rule"]
    fixed = PIKAN(lam=1e4, grid=160).fit(guessed(), slosh(0.1))
    assert fixed.settings["lam_rule"] == "given" and fixed.settings["lam"] == 1e4


@pytest.mark.parametrize("width", [(1, 1), (1, 3, 1)])
def test_several_recordings_a_parameter_each_and_a_free_start(width: tuple[int, ...]) -> None:
    model = guessed().with_initial(theta="free", theta_dot="free").per_recording("d_theta")
    recs = [slosh(0.1, seed) for seed in range(2)]
    nls, pikan = pk.NLS().fit(model, recs), PIKAN(width=width).fit(model, recs)
    assert [f.label for f in pikan.free] == [f.label for f in nls.free]
    assert np.all(np.abs(nls.theta - pikan.theta) < 0.1 * std(nls))
    assert np.allclose(std(pikan), std(nls), rtol=0.02)


def test_switches_that_come_close_and_inputs_that_are_held_linearly() -> None:
    """Two switches a sample apart in 20 s: the first grid that counts tells them apart."""
    t = np.arange(0.0, 20.0, 0.01)
    smooth = np.sin(3.0 * t) + 0.5 * np.cos(11.0 * t)
    linear = pk.Recording.from_arrays(t, {"u_x": smooth}, units={"u_x": "m/s^2"},
                                      hold={"u_x": "first"})
    for drive in (pk.excitation.planar_moves(seed=0), linear):
        rec = pk.simulate(pk.systems.sloshing(), drive, sigma=0.1 * DEGREE, seed=0)
        nls, pikan = pk.NLS().fit(guessed(), rec), PIKAN().fit(guessed(), rec)
        assert np.all(np.abs(nls.theta - pikan.theta) < 0.1 * std(nls))
        assert np.allclose(std(pikan), std(nls), rtol=0.02)
        assert pikan.ok and not pikan.warnings


def rich(seconds: float) -> pk.Recording:
    """An input that is held between samples and changes at every one of them."""
    t = np.arange(0, seconds, 0.01)
    drive = pk.Recording.from_arrays(
        t, {"u_x": np.random.default_rng(99).normal(size=t.size)}, units={"u_x": "m/s^2"},
        hold={"u_x": "zero"})
    return pk.simulate(pk.systems.sloshing(), drive, sigma=0.002, seed=0)


def test_inputs_that_change_at_every_sample() -> None:
    """The cells then follow the switches, every one of which has its kink."""
    rec = rich(4.0)
    nls, pikan = pk.NLS().fit(guessed(), rec), PIKAN().fit(guessed(), rec)
    assert np.all(np.abs(nls.theta - pikan.theta) < 0.1 * std(nls))
    assert np.allclose(std(pikan), std(nls), rtol=0.02)
    assert pikan.ok and pikan.settings["degree"] == 3
    with pytest.raises(errors.BadSetting, match="kinks"):
        PIKAN(width=(1, 3, 1)).fit(guessed(), rich(10.0))


@pytest.mark.slow
def test_a_grid_that_cannot_follow_the_switches_is_owned_up_to() -> None:
    est = PIKAN(grid=160).fit(guessed(), rich(4.0))
    assert est.adequacy.verdict == "misfit" and est.warnings


def test_without_kinks_the_bias_of_the_paper_comes_back() -> None:
    est = PIKAN(exact_switches=False, max_grid=80).fit(guessed(), slosh(0.1))
    assert abs(est.theta[0] / TRUTH[0] - 1) > 0.005
    assert any("discretisation bias" in note for note in est.warnings)


TANK = {"name": "tank", "states": {"h": {"initial": 1.0}},
        "parameters": {"k": {"guess": 0.5, "bounds": [0.01, 5]}},
        "equations": {"h": "-k*sqrt(h)"}, "outputs": {"h": {"expression": "h"}}}
BLAST = {"name": "blast", "states": {"x": {"initial": 1.0}},
         "parameters": {"k": {"guess": 0.5, "bounds": [0.01, 1000]}},
         "equations": {"x": "k*exp(300*x**2)"}, "outputs": {"x": {"expression": "x"}}}


@pytest.mark.parametrize(("name", "options"), [
    ("tank", {}), ("tank", {"width": (1, 3, 1)}), ("tank", {"protocol": "paper"}),
    pytest.param("blast", {}, marks=pytest.mark.slow),
    pytest.param("blast", {"width": (1, 3, 1)}, marks=pytest.mark.slow),
    pytest.param("blast", {"protocol": "paper"}, marks=pytest.mark.slow)])
def test_a_model_that_is_not_finite_on_the_way(name: str, options: dict[str, object]) -> None:
    """Noise around an empty tank asks for the root of a negative number; exp overflows."""
    t = np.arange(0, 2.2, 0.02)
    noise = 0.02 * np.random.default_rng(0).normal(size=t.size)
    y, form = (np.maximum(1 - 0.5 * t, 0) ** 2, TANK) if name == "tank" else (1 + 3 * t, BLAST)
    output = "h" if name == "tank" else "x"
    rec = pk.Recording.from_arrays(t, {output: y + noise}, sigma={output: 0.02})
    est = PIKAN(**options).fit(pk.Model.from_dict(form), rec)  # type: ignore[arg-type]
    assert est.warnings and est.adequacy.verdict == "misfit"
    assert np.all(np.isfinite(est.theta))
    assert np.all(np.isfinite(est.approximator.states(t)))
    if "protocol" not in options:
        assert not est.converged and "broke down" in est.warnings[0]


def test_broken_down_on_a_finer_grid_the_last_good_one_is_kept(monkeypatch) -> None:  # type: ignore[no-untyped-def]
    from scipy.linalg import LinAlgError

    from pikanid.strategies import kan_shallow

    follow, calls = kan_shallow.follow, []

    def failing(system, point, plan):  # type: ignore[no-untyped-def]
        calls.append(system)
        if len(calls) > 1:
            raise LinAlgError("not positive definite")
        return follow(system, point, plan)

    monkeypatch.setattr(kan_shallow, "follow", failing)
    est = PIKAN().fit(guessed(), slosh(0.1))
    assert len(calls) == 2 and est.settings["intervals"] == 80
    assert abs(est.theta[0] / TRUTH[0] - 1) < 0.01
    assert "broke down on a grid of 160 cells" in est.warnings[0]


def test_base_function() -> None:
    est = PIKAN(base="silu", grid=160).fit(guessed(), slosh(0.1))
    assert np.all(np.abs(est.theta - TRUTH) < 4 * np.array(BOUND[1, 0.1]))
    assert est.approximator.kan.base_fun_name == "silu"


def test_missing_physics_is_a_misfit() -> None:
    rec = pk.simulate(
        pk.systems.sloshing().with_term("theta_dot", "-80*theta**3"), pk.excitation.two_pulse(),
        sigma=0.1 * DEGREE, seed=0)
    est, nls = PIKAN().fit(guessed(), rec), pk.NLS().fit(guessed(), rec)
    assert est.adequacy.verdict == "misfit"
    assert np.all(np.abs(est.theta - nls.theta) < 0.2 * std(nls))


def test_a_curve_that_follows_the_data_of_a_wrong_model_is_owned_up_to() -> None:
    rec = pk.simulate(
        pk.systems.sloshing().with_term("theta_dot", "-80*theta**3"), pk.excitation.two_pulse(),
        sigma=0.01 * DEGREE, seed=0)
    est = PIKAN(lam=1.0, grid=160).fit(guessed(), rec)
    assert est.adequacy.verdict == "misfit"
    assert any("follows the data" in note for note in est.warnings)


def test_device() -> None:
    with pytest.raises(errors.BadSetting, match="abacus"):
        PIKAN(device="abacus").fit(guessed(), slosh(0.1))
    if torch.cuda.is_available():
        est = PIKAN(device="cuda").fit(guessed(), slosh(0.1))
        assert next(est.approximator.kan.parameters()).is_cuda
        t = np.linspace(0.0, 5.0, 50)
        assert np.allclose(est.approximator.networks[0][0].forward(t)[:, 0],
                           est.approximator.states(t)[:, 0], atol=1e-9)
    else:
        with pytest.raises(errors.PikanidError, match="0 CUDA devices"):
            PIKAN(device="cuda").fit(guessed(), slosh(0.1))


@pytest.mark.parametrize("options", [
    {"degree": 1}, {"degree": 2}, {"grid": 0}, {"lam": -1.0}, {"protocol": "peper"},
    {"form": "third"}, {"base": "relu"}, {"width": (2, 1)}, {"width": (1,)}, {"width": (1, 0, 1)},
    {"hidden_grid": 0}, {"protocol": "paper", "width": (1, 5, 1)}])
def test_bad_options(options: dict[str, object]) -> None:
    with pytest.raises(errors.BadSetting):
        PIKAN(**options).fit(guessed(), slosh(0.1))  # type: ignore[arg-type]
