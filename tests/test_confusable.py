"""What an experiment can reveal: against closed forms and against a refit by SciPy."""

from __future__ import annotations

import json
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from scipy.optimize import minimize

import pikanid as pk
from pikanid import errors
from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.design.confusable import Confusable, _visible, confusable
from pikanid.mismatch.design.response import Watched, response
from pikanid.mismatch.design.sizing import Sized
from pikanid.mismatch.settings.settings import DEFAULTS, Settings
from pikanid.model import Parameter, systems
from pikanid.recording import excitation

SIGMA = 0.1 * np.pi / 180
ASKED = ("coulomb_friction", "quadratic_drag", "power_drag", "input_saturation", "input_dead_zone",
         "sensor_offset", "sensor_drift", "sensor_saturation", "sensor_lag", "input_gain",
         "input_delay")


@pytest.fixture(scope="module")
def pulses() -> Confusable:
    return confusable(systems.sloshing(), excitation.two_pulse(), SIGMA, only=ASKED, refit=False)


def rivals(found: Confusable, key: str) -> dict[str, float]:
    return {r.key: r.distance for e in found.effects if e.key == key for r in e.rivals}


def test_smallest_offset_is_that_of_a_mean(pulses: Confusable) -> None:
    """An offset b in N samples is √N b/σ away, less the little that l and d make of it."""
    assert pulses.smallest("sensor_offset") == pytest.approx(5 * SIGMA / np.sqrt(501), rel=0.1)


def test_smallest_drift_is_that_of_a_line(pulses: Confusable) -> None:
    t = excitation.two_pulse().t
    assert pulses.smallest("sensor_drift") == pytest.approx(
        5 * SIGMA / np.sqrt(np.sum(t**2)), rel=0.1)


def test_smallest_friction_is_five_sigma_from_a_refitted_pendulum(pulses: Confusable) -> None:
    c = pulses.smallest("coulomb_friction")
    e, nominal = excitation.two_pulse(), systems.sloshing()
    rubbed = nominal.with_term("theta_dot", "-c*sign(theta_dot)", [Parameter("c", c)])
    truth = response(rubbed, e, SIGMA)
    rival = Watched(nominal, e, SIGMA)

    def misfit(q: np.ndarray) -> float:
        return float(np.sum((rival.at(q * [0.045, 0.15]).y - truth.y) ** 2))

    best = minimize(misfit, [1.0, 1.0], method="Nelder-Mead", options={
        "initial_simplex": [[1.0, 1.0], [1.0005, 1.0], [1.0, 1.1]], "maxfev": 150})
    assert np.sqrt(best.fun) == pytest.approx(5.0, rel=0.15)


def test_limits_are_met_just_below_the_peak(pulses: Confusable) -> None:
    peak = np.max(np.abs(response(systems.sloshing(), excitation.two_pulse(), SIGMA).y)) * SIGMA
    assert 0.9 * peak < pulses.smallest("sensor_saturation") < peak
    assert 0.9 < pulses.smallest("input_saturation") < 1.0
    told = pulses.to_dict()
    assert "sensor_saturation" in told["undetectable_above"]
    assert "sensor_offset" in told["undetectable_below"]
    assert "sensor_saturation <" not in json.dumps(told)


def test_equal_pulses_cannot_tell_static_inputs_apart(pulses: Confusable) -> None:
    """On ±1 m/s² any static law of the input is a gain; a dead zone is one as well."""
    for key in ("input_saturation", "input_dead_zone"):
        assert rivals(pulses, key)["input_gain"] < 0.5
    levels = excitation.pulses([(0.2, 0.6, 1.0), (1.2, 1.6, -0.4), (2.5, 2.8, 0.7)], 5.0)
    found = confusable(systems.sloshing(), levels, SIGMA, only=["input_saturation"], refit=False)
    assert rivals(found, "input_saturation")["input_gain"] > 4


def test_twins_are_found(pulses: Confusable) -> None:
    pairs = {(a, b) for a, b, _ in pulses.pairs}
    assert ("sensor_offset", "static_bias") in pairs
    assert ("sensor_lag", "actuator_lag") in pairs
    assert ("input_gain", "sensor_gain") in pairs
    assert ("coulomb_friction", "sensor_offset") not in pairs
    assert all(a != b and d < pulses.separated for a, b, d in pulses.pairs)
    # The two delays are one effect from the start.
    assert next(e.ids for e in pulses.effects if e.key == "input_delay") == (
        "input_delay", "sensor_delay")


def test_special_cases_are_no_rivals_of_their_own_family(pulses: Confusable) -> None:
    assert "power_drag" not in rivals(pulses, "quadratic_drag")
    assert "quadratic_drag" in rivals(pulses, "power_drag")


def test_more_noise_hides_more(pulses: Confusable) -> None:
    few = ("sensor_offset", "input_gain")
    noisy = confusable(systems.sloshing(), excitation.two_pulse(), 10 * SIGMA, only=few,
                       refit=False)
    for key in few:
        ratio = abs(noisy.smallest(key)) / abs(pulses.smallest(key))
        assert ratio == pytest.approx(10.0, rel=0.3)


def test_text_names_every_effect(pulses: Confusable) -> None:
    lines = str(pulses).splitlines()
    assert len(lines) == 1 + len(pulses.effects)
    assert any(line.startswith("sensor_offset") and "static_bias" in line for line in lines)


@pytest.mark.slow
def test_refits_come_no_further_than_the_first_order_by_much(pulses: Confusable) -> None:
    """And never worse than the nominal model, which every rival contains."""
    found = confusable(systems.sloshing(), excitation.two_pulse(), SIGMA)
    for effect in found.effects:
        for rival in effect.rivals[:1]:
            assert rival.distance <= 1.05 * effect.strength
    assert rivals(found, "sensor_lag")["actuator_lag"] < 0.1


def test_what_cannot_be_asked() -> None:
    model, e = systems.sloshing(), excitation.two_pulse()
    with pytest.raises(errors.BadSetting, match="noise"):
        confusable(model, e)
    with pytest.raises(errors.BadSetting, match="magic"):
        confusable(model, e, SIGMA, only=["magic"])
    with pytest.raises(errors.BadSetting, match="strength"):
        confusable(model, e, SIGMA, strength=3.0)
    with pytest.raises(errors.BadSetting, match="could not show"):
        Confusable((), 4.0).smallest("coulomb_friction")
    decay = pk.Model.from_dict({
        "name": "decay", "states": {"x": {"initial": 1.0}}, "parameters": {"k": {"guess": 0.5}},
        "equations": {"x": "-k*x"}, "outputs": {"clock": {"expression": "k*t"}}})
    with pytest.raises(errors.BadModel, match="no state"):
        confusable(decay, excitation.free_decay(1.0), 0.1)


def test_an_effect_that_nothing_shows_has_no_size() -> None:
    one = SimpleNamespace(key="shy", ids=("shy",), name="a shy effect", parameters=())
    shown = _visible(cast(Candidate, one), None, None, (), DEFAULTS)
    assert (shown.parameter, shown.smallest, shown.falling) == ("", np.inf, False)
    assert (shown.value, shown.strength, shown.rivals) == (0.0, 0.0, ())
    assert "not at all" in str(Confusable((shown,), 4.0))


def test_a_setting_decides_how_near_to_detectable_is_near_enough() -> None:
    one = SimpleNamespace(key="shy", ids=("shy",), name="a shy effect", parameters=())
    form = cast(Sized, SimpleNamespace(distance=4.0, departure=0.7, falling=False))
    sizes = [_visible(cast(Candidate, one), form, None, (), Settings(reached=share)).smallest
             for share in (0.79, 0.8, 0.81)]  # of a detectable distance of 5
    assert sizes == [0.7, 0.7, np.inf]
