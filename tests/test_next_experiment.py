"""Feasible profiles, distances between models, and the experiment that tells most."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares, minimize

import pikanid as pk
from pikanid import errors
from pikanid.cli import main
from pikanid.mismatch.design.next_experiment import d_optimal, next_experiment
from pikanid.mismatch.design.profiles import profiles
from pikanid.mismatch.design.response import (
    Watched,
    decay_rate,
    joined,
    natural_frequency,
    response,
)
from pikanid.mismatch.design.separation import distance, mean_precision, refitted, unexplained
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.model import Model, Parameter, systems
from pikanid.recording import excitation

SIGMA = 0.1 * np.pi / 180
POSITIVE = (0.0, np.inf)


def friction(c: float) -> Model:
    return systems.sloshing().with_term(
        "theta_dot", "-c*sign(theta_dot)", [Parameter("c", c, bounds=POSITIVE)])


def drag(q: float) -> Model:
    return systems.sloshing().with_term(
        "theta_dot", "-q*abs(theta_dot)*theta_dot", [Parameter("q", q, bounds=POSITIVE)])


# --- distances ---------------------------------------------------------------------------------


def pendulum(length: float, damping: float) -> np.ndarray:
    """Eq. (6) under the two pulses by SciPy, restarted at each switch, in σ."""
    t, theta, x = excitation.two_pulse().t, np.zeros(501), np.zeros(2)
    cuts = [(0.0, 0.2, 0.0), (0.2, 0.6, 1.0), (0.6, 1.2, 0.0), (1.2, 1.6, -1.0), (1.6, 5.0, 0.0)]
    for start, stop, u in cuts:
        inside = (t >= start - 1e-9) & (t <= stop + 1e-9)

        def rhs(_: float, x: np.ndarray, u: float = u) -> list[float]:
            return [x[1], (u * np.cos(x[0]) - 9.81 * np.sin(x[0])) / length
                    - damping / 0.3 * x[1] * np.cos(x[0]) ** 2]

        done = solve_ivp(rhs, (start, stop), x, t_eval=np.clip(t[inside], start, stop),
                         method="DOP853", rtol=1e-11, atol=1e-13)
        theta[inside], x = done.y[0], done.y[:, -1]
    return theta / SIGMA


def test_response_agrees_with_scipy_and_its_differences() -> None:
    found = response(systems.sloshing(), excitation.two_pulse(), SIGMA)
    assert found.y == pytest.approx(pendulum(0.045, 0.15), abs=0.02)
    for k, (dl, dd) in enumerate(((1e-6, 0.0), (0.0, 1e-5))):
        up, down = pendulum(0.045 + dl, 0.15 + dd), pendulum(0.045 - dl, 0.15 - dd)
        slope = (up - down) / 2 / (dl + dd)
        assert found.jacobian[:, k] == pytest.approx(slope, abs=2e-3 * np.max(np.abs(slope)))


def test_unexplained_agrees_with_bounded_least_squares() -> None:
    rng = np.random.default_rng(0)
    for _ in range(20):
        J, r = rng.normal(size=(40, 3)) * [1.0, 100.0, 1e-3], rng.normal(size=40)
        low, high = np.array([-np.inf, 0.0, -50.0]), np.array([0.02, np.inf, 50.0])
        wanted = least_squares(lambda d, J=J, r=r: r - J @ d, np.full(3, 1e-9),
                               bounds=(low, high), x_scale=[1.0, 0.01, 1e3], xtol=1e-14,
                               ftol=1e-14)
        assert np.sum(unexplained(r, J, low, high) ** 2) == pytest.approx(2 * wanted.cost, rel=1e-5)


def test_parameter_without_influence_explains_nothing() -> None:
    r, free = np.arange(4.0), np.full(2, np.inf)
    J = np.array([np.zeros(4), np.ones(4)]).T
    assert unexplained(r, J, -free, free) == pytest.approx(r - 1.5)


def closest(rival: Watched, truth: np.ndarray, starts: np.ndarray) -> float:
    """Distance after a search that knows no derivatives, in units of the starts."""
    def misfit(q: np.ndarray) -> float:
        return float(np.sum((rival.at(np.abs(q) * unit).y - truth) ** 2))

    unit = starts[0]
    best = minimize(misfit, np.ones(len(unit)), method="Nelder-Mead", options={
        "initial_simplex": starts / unit, "maxfev": 300, "xatol": 1e-7, "fatol": 1e-6})
    return float(np.sqrt(best.fun))


def test_distance_is_that_of_a_refit() -> None:
    """For a small effect the first order is what refitting the rival's simulation finds."""
    e, nominal = excitation.two_pulse(), systems.sloshing()
    truth = response(drag(0.01), e, SIGMA)
    searched = closest(Watched(nominal, e, SIGMA), truth.y,
                       np.array([[0.045, 0.15], [0.04501, 0.15], [0.045, 0.16]]))
    assert distance([truth], [response(nominal, e, SIGMA)]) == pytest.approx(searched, rel=0.02)
    assert refitted([truth], nominal, [e], SIGMA) == pytest.approx(searched, rel=1e-3)


def test_refit_goes_where_the_first_order_does_not() -> None:
    """Another length is no other physics, however far away it is."""
    e, nominal = excitation.two_pulse(), systems.sloshing()
    truth = response(nominal.with_values(l_theta=0.047, d_theta=0.3), e, SIGMA)
    assert distance([truth], [response(nominal, e, SIGMA)]) > 20
    assert refitted([truth], nominal, [e], SIGMA) < 0.5


def test_signs_separate_what_a_line_could_not() -> None:
    """Drag looks like friction with the other sign: at q >= 0 it explains none of it."""
    e = excitation.two_pulse(20.0)
    bounded = distance([response(friction(0.1), e, SIGMA)], [response(drag(0.0), e, SIGMA)])
    nominal = distance([response(friction(0.1), e, SIGMA)],
                       [response(systems.sloshing(), e, SIGMA)])
    loose = systems.sloshing().with_term(
        "theta_dot", "-q*abs(theta_dot)*theta_dot", [Parameter("q", 0.0)])
    free = distance([response(friction(0.1), e, SIGMA)], [response(loose, e, SIGMA)])
    assert bounded == pytest.approx(nominal, rel=1e-6)
    assert free < 0.9 * bounded


def test_free_initial_states_belong_to_their_recording() -> None:
    model = systems.sloshing().with_initial(theta="free")
    one = response(model, excitation.two_pulse(), SIGMA)
    both = joined([one, one])
    assert both.jacobian.shape == (2 * 501, 4)
    assert np.all(both.jacobian[501:, 2] == 0)
    assert np.all(both.jacobian[:501, 3] == 0)
    assert both.jacobian[501:, 3] == pytest.approx(one.jacobian[:, 2])


def test_natural_frequency() -> None:
    assert natural_frequency(systems.sloshing()) == pytest.approx(
        np.sqrt(9.81 / 0.045 - 0.25**2) / 2 / np.pi)
    decay = Model.from_dict({
        "name": "decay", "states": {"x": {"initial": 1.0}}, "parameters": {"k": {"guess": 0.5}},
        "equations": {"x": "-k*x"}, "outputs": {"x": {"expression": "x"}}})
    assert natural_frequency(decay) is None
    assert decay_rate(decay) == pytest.approx(0.5)


# --- the next experiment -----------------------------------------------------------------------


@pytest.mark.slow
def test_best_profile_is_the_one_that_a_refit_would_choose() -> None:
    offered = profiles(2.35, duration=10.0, draws=1)[:6]
    models = {"friction": friction(0.3), "drag": drag(0.3)}
    chosen = next_experiment(models, sigma=SIGMA, candidates=offered)
    values = [value for _, value in chosen.ranking]
    assert values == sorted(values, reverse=True)
    assert (chosen.profile.name, chosen.value) == chosen.ranking[0]
    truth = response(models["drag"], chosen.profile, SIGMA).y
    starts = np.array([0.045, 0.2, 0.01]) + np.vstack([np.zeros(3), np.diag([2e-4, 0.1, 0.05])])
    rival = Watched(models["friction"], chosen.profile, SIGMA)
    # The other way round may be closer, but this one is not.
    assert chosen.value <= 1.01 * closest(rival, truth, starts)


def test_what_was_recorded_before_counts() -> None:
    models = {"friction": friction(0.3), "drag": drag(0.3)}
    e = excitation.two_pulse()
    chosen = next_experiment(models, recorded=e, sigma=SIGMA, candidates=[e])
    # The same again: √2 times as far apart, and no better than a repetition.
    assert chosen.value == pytest.approx(np.sqrt(2) * chosen.before, rel=1e-6)
    assert chosen.gain == pytest.approx(1.0)


@pytest.mark.parametrize(("length", "made"), [(8.0, 8.0), (0.6, 5.0 / 2.35), (None, 20.0)])
def test_profiles_are_as_long_as_what_was_recorded(length: float | None, made: float) -> None:
    """But for a recording in which nothing could swing."""
    model = systems.sloshing()
    before = [] if length is None else [pk.simulate(
        model, excitation.two_pulse(duration=8.0), sigma=SIGMA).window(0.0, length)]
    chosen = d_optimal(model, recorded=before, sigma=SIGMA)
    assert chosen.profile.stop == pytest.approx(made, rel=0.02)
    asked = d_optimal(model, recorded=before, sigma=SIGMA, duration=5.0)
    assert asked.profile.stop == pytest.approx(5.0, rel=0.01)


@pytest.mark.parametrize("stiffness", [0.0, 4e5])
def test_a_short_recording_of_what_no_sampling_follows_gets_a_profile(stiffness: float) -> None:
    model = Model.from_dict({
        "states": {"x": {"unit": "m"}, "v": {"unit": "m/s"}},
        "inputs": {"u": {"unit": "m/s^2"}},
        "parameters": {"c": {"guess": 2.0, "unit": "1/s"},
                       "k": {"value": stiffness, "unit": "1/s^2"}},
        "equations": {"x": "v", "v": "u - c*v - k*x"},
        "outputs": {"v": {"unit": "m/s", "expression": "v"}}})
    t = np.arange(58) * 0.01
    before = pk.Recording.from_arrays(t, {"u": np.sign(np.sin(20 * t)), "v": 1e-3 * np.cos(9 * t)})
    assert d_optimal(model, recorded=[before], sigma=0.01, ranges={"u": (-1.0, 1.0)}).profile


def test_more_noise_separates_less() -> None:
    models = {"friction": friction(0.3), "drag": drag(0.3)}
    e = [excitation.two_pulse(20.0)]
    near, far = (next_experiment(models, sigma=s, candidates=e).value for s in (10 * SIGMA, SIGMA))
    assert far == pytest.approx(10 * near, rel=1e-2)


def test_limits_make_profiles_smaller() -> None:
    chosen = d_optimal(systems.sloshing(), sigma=SIGMA, limits={"theta": 0.05},
                       candidates=[excitation.two_pulse()])
    reached = np.max(np.abs(pk.simulate(systems.sloshing(), chosen.profile)["theta"].values))
    assert 0.04 < reached <= 0.05
    assert np.max(np.abs(chosen.reach["theta"])) == pytest.approx(reached, rel=1e-3)
    low, high = chosen.reach["theta"]
    assert f"It takes theta from {low:.3g} to {high:.3g} rad." in str(chosen)
    with pytest.raises(errors.SimulationFailed):
        d_optimal(systems.sloshing(), sigma=SIGMA, limits={"theta": 0.05},
                  candidates=[excitation.two_pulse()],
                  settings=DEFAULTS.with_values({"budget.smaller": 1}))


def test_d_optimal_agrees_with_the_cramer_rao_bound() -> None:
    offered = [excitation.two_pulse(), excitation.two_pulse(amplitude=0.3), excitation.move(0.1)]
    chosen = d_optimal(systems.sloshing(), sigma=SIGMA, candidates=offered)
    bounds = [pk.uncertainty.cramer_rao(systems.sloshing(), e, SIGMA) for e in offered]
    volumes = [np.linalg.det(bound.fisher) for bound in bounds]
    assert chosen.profile.name == offered[int(np.argmax(volumes))].name
    assert chosen.value == pytest.approx(max(volumes) ** 0.25, rel=1e-4)
    assert chosen.std["d_theta"] == pytest.approx(
        bounds[int(np.argmax(volumes))].std("d_theta"), rel=1e-4)


def test_sigma_is_in_the_models_unit_whatever_the_recordings() -> None:
    recorded = pk.simulate(systems.sloshing(), excitation.two_pulse())
    degrees = recorded.with_channels(recorded["theta"].converted("deg"))
    in_radians, in_degrees = (d_optimal(systems.sloshing(), sigma=SIGMA, candidates=[r]).std
                              for r in (recorded, degrees))
    assert in_degrees == pytest.approx(in_radians, rel=1e-9)
    assert pk.uncertainty.cramer_rao(systems.sloshing(), degrees, SIGMA).std(
        "l_theta") == pytest.approx(in_radians["l_theta"], rel=1e-3)


def test_precision_of_a_blind_experiment_is_zero() -> None:
    assert mean_precision(np.zeros((5, 2))) == 0.0
    assert mean_precision(np.ones((5, 2))) == 0.0
    assert mean_precision(np.diag([4.0, 9.0])) == pytest.approx(6.0)


def test_profile_is_ready_to_run(tmp_path: Path) -> None:
    chosen = d_optimal(systems.sloshing(), sigma=SIGMA, duration=6.0)
    chosen.save(tmp_path / "next.csv")
    again = pk.Recording.read(tmp_path / "next.csv")
    assert again["u_x"].unit == "m/s^2"
    assert np.array_equal(again["u_x"].values, chosen.profile["u_x"].values)
    figure = chosen.plot()
    assert [a.get_ylabel() for a in figure.axes] == ["u_x [m/s^2]", "theta [rad]"]
    assert "l_theta" in str(chosen)
    assert chosen.to_dict()["profile"] == chosen.profile.name


def test_what_cannot_be_designed() -> None:
    with pytest.raises(errors.BadSetting, match="hypotheses"):
        next_experiment({"only": friction(0.3)}, sigma=SIGMA)
    with pytest.raises(errors.BadSetting, match="free parameter"):
        d_optimal(systems.sloshing().fix("l_theta", "d_theta"), sigma=SIGMA)
    with pytest.raises(errors.BadSetting, match="noise"):
        d_optimal(systems.sloshing(), candidates=[excitation.two_pulse()])
    with pytest.raises(errors.SimulationFailed, match=r"profiles .* with the model within"):
        d_optimal(systems.sloshing(), sigma=SIGMA, limits={"theta": 1e-9},
                  candidates=[])
    with pytest.raises(errors.SimulationFailed, match=r"profiles .* with every hypothesis"):
        next_experiment({"friction": friction(0.3), "drag": drag(0.3)}, sigma=SIGMA, candidates=[])
    still = Model.from_dict({
        "name": "still", "states": {"x": {"initial": 1.0}}, "parameters": {"k": {"guess": 0.5}},
        "equations": {"x": "-k*x"}, "outputs": {"x": {"expression": "x"}}})
    with pytest.raises(errors.BadSetting, match="drive"):
        d_optimal(still, sigma=0.1)


def test_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out, plot = tmp_path / "next.csv", tmp_path / "next.png"
    words = ["design", "sloshing", "--sigma", "0.1deg", "--limit", "theta=10deg", "--duration", "5"]
    assert main([*words, "--out", str(out), "--plot", str(plot)]) == 0
    said = capsys.readouterr().out
    assert "Standard errors" in said and "--limit" not in said
    assert main(["design", "sloshing", "--sigma", "0.1deg", "--duration", "5", "--out", str(out)]
                ) == 0
    assert " rad. --limit NAME=VALUE keeps an output nearer." in capsys.readouterr().out
    assert main([*words, "--out", str(out)]) == 0
    profile = pk.Recording.read(out)
    reached = response(systems.sloshing(), profile.with_hold(u_x="zero"), SIGMA).reached("theta")
    assert reached <= np.radians(10)
    assert plot.stat().st_size > 1000
    assert main([*words, "--out", str(out), "--velocity", "0"]) == 2
    assert "velocity" in capsys.readouterr().err
