"""The clock of a sensor that loses or gains: fitted, relaxed, written to files, diagnosed."""

from __future__ import annotations

import numpy as np
import pytest

import pikanid as pk

CLOCK = pk.Parameter("clock", 0.006, "", (-0.1, 0.1))


def losing(start: float = 0.0) -> pk.Model:
    since = f"(t - {start!r})" if start else "t"
    return pk.systems.sloshing().map_output("theta", [CLOCK], delay=f"-clock*{since}")


def moves(seed: int, start: float = 0.0) -> pk.Recording:
    found = pk.excitation.planar_moves(5, 10.0, seed=seed)
    return pk.Recording.from_arrays(found.t + start, {"u_x": found["u_x"].values},
                                    units={"u_x": "m/s^2"})


def test_least_squares_finds_it_within_its_error() -> None:
    found = pk.NLS(starts=1).fit(losing(), pk.simulate(losing(), moves(1), sigma=0.002, seed=1))
    assert found.std("clock") < 5e-5
    assert abs(found["clock"] - 0.006) < 4 * found.std("clock")


def test_a_known_one_is_seen_by_what_relaxes_the_equations() -> None:
    recording = pk.simulate(losing(), moves(2), sigma=0.0005, seed=2)
    known, none = (pk.IPDA().fit(model, recording)
                   for model in (losing().fix("clock"), pk.systems.sloshing()))
    assert abs(known["l_theta"] - 0.045) < 1e-4 < abs(none["l_theta"] - 0.045)


def test_a_free_one_is_refused_there() -> None:
    with pytest.raises(pk.errors.BadSetting, match="clock"):
        pk.IPDA().fit(losing(), pk.simulate(losing(), moves(2), sigma=0.001, seed=2))


def test_the_model_file_holds_it() -> None:
    again = pk.Model.from_dict(losing().to_dict())
    assert again.outputs == losing().outputs
    with pytest.raises(pk.errors.BadModel, match="delay of output 'theta'"):
        pk.systems.sloshing().map_output("theta", delay="0.1*theta_dot")


def test_a_delay_may_use_what_formulas_have() -> None:
    recording = pk.excitation.two_pulse()
    late, known = (pk.simulate(pk.systems.sloshing().map_output("theta", delay=delay), recording)
                   for delay in ("0.1*signed_power(t, 2)/5**2", "0.1*t**2/5**2"))
    assert late["theta"].values == pytest.approx(known["theta"].values, abs=1e-9)


def test_units_of_a_delay_that_changes() -> None:
    [said] = pk.systems.sloshing().map_output(
        "theta", [pk.Parameter("slow", 0.1, "s")], delay="slow*t").unit_disagreements
    assert "delay of output 'theta'" in said and "'s^2' where 's' is needed" in said
    assert not losing().unit_disagreements


@pytest.mark.parametrize("start", [0.0, 250.0])
def test_it_is_diagnosed(start: float) -> None:
    train, other = (pk.simulate(losing(start), moves(seed, start), sigma=0.002, seed=seed)
                    for seed in (3, 4))
    dx = pk.diagnose(pk.systems.sloshing(), train, other)
    assert dx.verdict == "named" and dx.hypotheses[0].effects[0].ids == ("clock_error",)
    effect = dx.hypotheses[0].effects[0].parameters["clock"]
    assert abs(effect.value - 0.006) < 4 * effect.std < 4e-4


def test_without_inputs_no_clock_is_wrong() -> None:
    """All that a clock does is then done by parameters: time is what the sensor says."""
    decay = pk.Model.from_dict({
        "name": "decay", "states": {"x": {"initial": 1.0}}, "parameters": {"a": {"guess": 0.5}},
        "equations": {"x": "-a*x"}, "outputs": {"x": {"expression": "x", "sigma": 0.01}}})
    still = pk.Recording.from_arrays(np.arange(0, 8, 0.02), {"x": np.exp(
        -0.5 * np.arange(0, 8, 0.02)) + 0.01 * np.random.default_rng(0).normal(size=400)})
    dx = pk.diagnose(decay, still)
    assert not any("clock" in name for name in dx.undetectable_below)
