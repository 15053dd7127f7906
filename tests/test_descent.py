"""Where fits begin, and that they end where an exact simulation would."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import pikanid as pk
from pikanid.mismatch.case import Case
from pikanid.mismatch.data.whitened import Whitened
from pikanid.mismatch.fitting.closest import Closest
from pikanid.mismatch.fitting.descent import descended
from pikanid.mismatch.fitting.extended import extended
from pikanid.mismatch.fitting.fit import fitted, read_otherwise, turned
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.search.screen import Screen, law
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.mismatch.steps.opening import open_case


def opened(truth: pk.Model, train: pk.Recording, sigma: float) -> Case:
    recording = pk.simulate(truth, train, sigma=sigma, seed=3)
    return open_case(pk.systems.sloshing(), (recording,), None, None, lambda text: None, DEFAULTS)


@pytest.mark.parametrize("stiff", [3000.0, 20000.0, 70000.0])
def test_a_fit_simulates_finely_enough_where_it_ends(stiff: float) -> None:
    """A fit that begins at a soft wall and ends at a stiff one is as exact as one begun there."""
    truth = pk.systems.sloshing().with_term("theta_dot", f"-{stiff}*max(theta - 0.15, 0)")
    case = opened(truth, pk.excitation.two_pulse(), 0.002)
    wall = next(c for c in case.candidates if c.key == "wall_impact")
    begin = {"wall": 0.14, "k_wall": 1500.0, "l_theta": 0.045, "d_theta": 0.15}
    found = fitted(case.model, [wall], case.records, [begin], 30)
    assert found is not None
    exact = Whitened(found.model, case.records)
    assert exact.choose_steps(found.minimum.theta, share=0.002)
    assert found.minimum.chi2 == pytest.approx(exact.chi2(found.minimum.theta), rel=0.02)


def test_a_fit_that_comes_far_closer_than_all_before_is_simulated_finely() -> None:
    """Its steps were chosen while thousands of times the noise were left, by the closest so far."""
    truth = pk.systems.sloshing().with_term("theta_dot", "-3000.0*max(theta - 0.15, 0)")
    case = opened(truth, pk.excitation.two_pulse(), 0.002)
    wall = next(c for c in case.candidates if c.key == "wall_impact")
    whitened = Whitened(extended(case.model, [wall]), case.records)
    begin = {"wall": 0.14, "k_wall": 1e4, "l_theta": 0.045, "d_theta": 0.15}
    found = descended(whitened, [begin], Closest(1e4 * whitened.rows), 30, lambda chi2: False)
    assert found is not None and found.chi2 < 1.1 * whitened.rows
    assert max(whitened.step_errors(found.theta)) <= 1


def test_settings_say_how_much_closer_that_is(monkeypatch: pytest.MonkeyPatch) -> None:
    truth = pk.systems.sloshing().with_term("theta_dot", "-3000.0*max(theta - 0.15, 0)")
    case = opened(truth, pk.excitation.two_pulse(), 0.002)
    begin = case.base.point

    def chosen(share: float) -> int:
        """How often steps are chosen."""
        settings = DEFAULTS.with_values({"fits.closer": share})
        whitened = Whitened(case.model, replace(case.records, settings=settings))
        calls: list[object] = []
        choose = Whitened.choose_steps
        monkeypatch.setattr(Whitened, "choose_steps", lambda self, *args, **named: (
            calls.append(args), choose(self, *args, **named))[1])
        descended(whitened, [begin], Closest(1e6 * whitened.rows), 30, lambda chi2: False)
        monkeypatch.undo()
        return len(calls)

    assert chosen(1.0) > chosen(0.0)


def test_steps_that_are_too_long_elsewhere_are_seen() -> None:
    truth = pk.systems.sloshing().with_term("theta_dot", "-70000*max(theta - 0.15, 0)")
    case = opened(truth, pk.excitation.two_pulse(), 0.002)
    wall = next(c for c in case.candidates if c.key == "wall_impact")
    whitened = Whitened(extended(case.model, [wall]), case.records)
    soft, stiff = (np.array([{"wall": 0.15, "k_wall": k}.get(f.name, f.guess)
                             for f in whitened.problem.free]) for k in (1500.0, 70000.0))
    assert whitened.choose_steps(soft)
    assert max(whitened.step_errors(soft)) <= 1 and max(whitened.step_errors(stiff)) > 2
    assert whitened.choose_steps(stiff)
    assert max(whitened.step_errors(stiff)) <= 1


@pytest.mark.parametrize("count", [14, 0])
@pytest.mark.parametrize(("friction", "damping", "length"),
                         [(3.15, 0.16, 0.058), (2.4, 0.24, 0.039), (5.0, 0.28, 0.05)])
def test_strong_friction_is_found_beside_damping_that_stands_for_it(
        friction: float, damping: float, length: float, count: int) -> None:
    """The nominal fit has made all of it viscous: from there small steps lead nowhere, whether the
    first of them promises something (`count`) or not.
    """
    model = pk.systems.sloshing().with_values({"d_theta": damping, "l_theta": length})
    case = opened(model.with_term("theta_dot", f"-{friction}*sign(theta_dot)"),
                  pk.excitation.two_pulse(), 0.0017)
    assert case.base.far and case.base.values["d_theta"] > 3 * damping
    listed = Screen(case.base, [c for c in case.candidates if c.fits and c.suits()]).singles(
        count, always=law)
    fits = [fitted(case.model, [c], case.records, starts, 30) for c, starts in listed
            if c.key == "coulomb_friction"]
    found = min((h for h in fits if h), key=lambda h: h.minimum.chi2)
    assert not found.far and found.values["c"] == pytest.approx(friction, rel=0.05)


@pytest.mark.parametrize("periods", [-0.5, 0.5, -1.0])
def test_a_force_local_in_time_is_found_from_another_half_period(periods: float) -> None:
    """It rings alike there, the other way round: a descent ends beside the right moment."""
    model = pk.systems.sloshing()
    truth = model.with_term("theta_dot", "8*exp(-((t - 9)/0.1)**2)")
    case = opened(truth, pk.excitation.planar_moves(6, 20.0, seed=2), 0.002)
    once = next(c for c in case.candidates if c.key == "disturbance")
    later = periods * 2 * np.pi / case.rate
    begin = {"peak": 8.0 * (-1) ** int(2 * periods), "t_peak": 9.0 + later, "width": 0.4}
    found = fitted(case.model, [once], case.records, [{**case.base.point, **begin}], 30)
    assert found is not None and found.values["t_peak"] == pytest.approx(9.0, abs=0.02)
    assert found.minimum.chi2 < 1.2 * found.whitened.rows
    # what is settled is left where it is
    left = fitted(case.model, [once], case.records, [{**case.base.point, **begin}], 30,
                  settled=frozenset({"disturbance"}))
    assert left is not None and left.minimum.chi2 > found.minimum.chi2 + 20


@pytest.mark.parametrize("bent_first", [True, False])
def test_what_a_sensor_does_is_put_in_the_order_that_the_recording_shows(bent_first: bool) -> None:
    """A sensor that bends and drifts: what drifts is bent, or what is bent drifts."""
    maps: list[dict[str, str]] = [{"function": "theta + 6.0*theta**3"}, {"drift": "0.004"}]
    truth = pk.systems.sloshing()
    for change in maps if bent_first else maps[::-1]:
        truth = truth.map_output("theta", **change)  # type: ignore[arg-type]  # all text
    case = opened(truth, pk.excitation.two_pulse(), 0.0004)
    effects = [next(c for c in case.candidates if c.key == key)
               for key in ("sensor_drift", "sensor_nonlinearity")]
    found = fitted(case.model, effects, case.records, [case.base.values], 30)
    assert found is not None
    assert found.effects == (tuple(effects) if not bent_first else turned(tuple(effects)))
    assert found.minimum.chi2 < 1.3 * found.whitened.rows
    assert found.values["k_y3"] == pytest.approx(6.0, rel=0.05)
    # the other order does not do
    other = Whitened(extended(case.model, turned(found.effects)), case.records)
    theta = [found.values[f.name] for f in other.problem.free]
    assert other.choose_steps(np.array(theta)) and other.chi2(np.array(theta)) > (
        found.minimum.chi2 + 20)


def test_the_order_is_turned_within_inputs_and_within_outputs() -> None:
    case = opened(pk.systems.sloshing(), pk.excitation.two_pulse(), 0.002)
    by_key = {c.key: c for c in case.candidates}
    keys = ["sensor_drift", "coulomb_friction", "input_saturation", "sensor_nonlinearity",
            "input_gain", "sensor_saturation"]
    there = tuple(by_key[k] for k in keys)
    assert [e.key for e in turned(there)] == [
        "sensor_saturation", "coulomb_friction", "input_gain", "sensor_nonlinearity",
        "input_saturation", "sensor_drift"]
    assert turned(turned(there)) == there
    assert turned(there[:3]) == there[:3]


@pytest.mark.parametrize("directly", [True, False])
def test_a_leak_reaches_a_second_mode_or_not_as_the_recording_shows(directly: bool) -> None:
    rng = np.random.default_rng(4)
    recording = pk.excitation.planar_moves(6, 10.0, seed=2)
    t = recording["u_x"].time
    knots = np.arange(0.0, t[-1] + 1.0, 0.25)
    leaking = np.interp(t, knots, rng.normal(size=len(knots)))
    recording = recording.with_channels(replace(recording["u_x"], name="u_y", values=leaking))
    case = opened(pk.systems.sloshing(), recording, 0.002)
    mode, leak = (next(c for c in case.candidates if c.key == key)
                  for key in ("second_mode", "cross_axis[u_y]"))
    pair, true = (mode, leak), {"a_2": -60.0, "omega_2": 46.0, "zeta_2": 0.03, "l_theta": 0.045,
                                "d_theta": 0.15, "kappa_u_y": 0.6}
    truth = extended(case.model, read_otherwise(pair) if directly else pair).with_values(true)
    case = opened(truth, recording, 0.001)
    begin = {**true, "a_2": -50.0, "omega_2": 44.0, "kappa_u_y": 0.4}
    found = fitted(pk.systems.sloshing(), pair, case.records, [begin], 30)
    assert found is not None
    assert found.effects[1].extend is (leak.other if directly else leak.extend)
    assert found.minimum.chi2 < 1.2 * found.whitened.rows
    assert found.values["kappa_u_y"] == pytest.approx(0.6, abs=0.01)
    assert found.values["omega_2"] == pytest.approx(46.0, abs=0.5)
    assert read_otherwise((leak,)) == (leak,)


def test_a_fit_is_no_better_by_less_than_fits_stop_at() -> None:
    def left(chi2: float) -> SimpleNamespace:
        return SimpleNamespace(minimum=SimpleNamespace(chi2=chi2), whitened=SimpleNamespace(
            rows=500, settings=DEFAULTS))

    def improves(chi2: float, known: float) -> bool:
        return Hypothesis.improves_on(left(chi2), left(known))  # type: ignore[arg-type]

    assert improves(499.8, 500.0) and not improves(499.96, 500.0)
    assert improves(4998.9, 5000.0) and not improves(4999.1, 5000.0)
