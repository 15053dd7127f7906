"""Play and limited rates of inputs against an independent oracle, and their sensitivities."""

from __future__ import annotations

from random import Random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from perturbed import assert_sensitivities

import pikanid as pk
from pikanid import errors
from pikanid.mismatch.catalogue.catalogue import candidates
from pikanid.mismatch.catalogue.sites import sites
from pikanid.mismatch.data.records import Records
from pikanid.mismatch.data.whitened import Whitened
from pikanid.mismatch.detect.tangent import directions
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.model.parts import Hold, Parameter
from pikanid.noise.level import NoiseModel
from pikanid.problem.held import HeldInput, acting
from pikanid.problem.problem import bind
from pikanid.simulation.simulator import Simulator
from pikanid.simulation.translated import Translated
from pikanid.validation.concealed import signals

HOLDS: tuple[Hold, ...] = ("zero", "first")
HALF, RATE, BEGUN = 0.3, 4.0, -0.4


def slow(hold: Hold = "zero", operating: bool = False) -> pk.Model:
    """Behind a play, and no faster than RATE."""
    most = Parameter("R", RATE, "m/s^3", (1e-3, 1e3))
    return loose(hold, operating).map_input("u_x", [most], rate_limit="R")


def loose(hold: Hold = "zero", operating: bool = False) -> pk.Model:
    """Behind a play, in which it begins anywhere where `operating`."""
    model = pk.systems.sloshing().map_input(
        "u_x", [Parameter("b", HALF, "m/s^2", (0.0, 10.0))], hold=hold, backlash="b")
    begun = Parameter("e", BEGUN, "", (-1.0, 1.0), scope="recording")
    return model.map_input("u_x", [begun], backlash_start="e") if operating else model


def wandering(hold: Hold = "zero", count: int = 600, about: float = 0.0) -> pk.Recording:
    u = about + 0.1 * np.cumsum(np.random.default_rng(0).normal(size=count))
    return pk.Recording.from_arrays(0.01 * np.arange(count), {"u_x": u},
                                    units={"u_x": "m/s^2"}, hold={"u_x": hold})


@settings(max_examples=100, deadline=None)
@given(st.lists(st.floats(-2.0, 2.0), min_size=2, max_size=40),
       st.one_of(st.none(), st.floats(0.0, 3.0)), st.one_of(st.just(np.inf), st.floats(0.01, 9.0)),
       st.one_of(st.just(np.nan), st.floats(-1.0, 1.0)), st.sampled_from(HOLDS),
       st.randoms(use_true_random=False))
def test_what_follows_equals_the_oracle(values: list[float], half: float | None, rate: float,
                                        start: float, hold: Hold, chance: Random) -> None:
    t, u = np.arange(len(values), dtype=float), np.array(values)
    made = signals.zero_order if hold == "zero" else signals.first_order
    begins = half is not None and np.isfinite(start)
    first = u[0] + start * (half or 0.0) if begins else 0.0  # the oracle begins at 0
    expected = made(t, u - first)
    if half is not None:
        expected = signals.played(expected, half)
    if np.isfinite(rate):
        expected = signals.slewed(expected, rate)
    carrier, side, untouched, ramp, _ = acting(HeldInput("u", t, u, hold), half, rate, start)
    probe = np.sort([chance.uniform(0.0, t[-1] - 1e-6) for _ in range(200)])
    probe = probe[np.abs(probe - np.round(probe)) > 1e-6]
    found = carrier.at(probe) + (half or 0.0) * side.at(probe) - first
    if np.isfinite(rate):
        found += rate * ramp.at(probe)
    if begins:
        found += start * (half or 0.0) * untouched.at(probe)
    assert found == pytest.approx(expected.at(probe), abs=1e-7)
    assert np.isfinite(rate) or set(side.values) <= {-1.0, 0.0, 1.0}


@pytest.mark.parametrize("hold", HOLDS)
@pytest.mark.parametrize("kind", [Simulator, Translated])
@pytest.mark.parametrize("operating", [False, True])
def test_sensitivities_are_those_of_differences(operating: bool, kind: type[Simulator],
                                                hold: Hold) -> None:
    model = slow(hold, operating)
    simulator = kind(model, bind(model, pk.simulate(model, wandering(hold), sigma=0.0)))
    p = np.array([0.045, 0.15, 0.3, 9.81, HALF, *([BEGUN] if operating else []), RATE])
    assert_sensitivities(simulator, p, np.array([0, 1, *range(4, len(p))]))


def test_simulated_motion_is_that_under_the_signal_behind_the_play() -> None:
    rec = wandering()
    acts = signals.played(signals.zero_order(rec["u_x"].time, rec["u_x"].values), HALF)
    behind = pk.Recording.from_arrays(rec["u_x"].time, {"u_x": acts.at(rec["u_x"].time + 1e-9)},
                                      units={"u_x": "m/s^2"}, hold={"u_x": "zero"})
    found = pk.simulate(loose(), rec, sigma=0.0)["theta"].values
    expected = pk.simulate(pk.systems.sloshing(), behind, sigma=0.0)["theta"].values
    rigid = pk.simulate(pk.systems.sloshing(), rec, sigma=0.0)["theta"].values
    assert found == pytest.approx(expected, abs=1e-9)
    assert np.abs(found - rigid).max() > 1e-3


def test_simulated_motion_is_that_under_the_signal_of_limited_rate() -> None:
    rec = wandering()
    sloth = signals.slewed(signals.zero_order(rec["u_x"].time, rec["u_x"].values), RATE)
    t = np.linspace(0.0, rec["u_x"].time[-1], 60_000)
    behind = pk.Recording.from_arrays(t, {"u_x": sloth.at(t)}, units={"u_x": "m/s^2"},
                                      hold={"u_x": "first"})
    most = Parameter("R", RATE, "m/s^3", (1e-3, 1e3))
    limited = pk.systems.sloshing().map_input("u_x", [most], rate_limit="R")
    found = pk.simulate(limited, rec, sigma=0.0)["theta"].values
    at = rec["u_x"].time
    expected = pk.simulate(pk.systems.sloshing(), behind, sigma=0.0, t=at)["theta"].values
    free = pk.simulate(pk.systems.sloshing(), rec, sigma=0.0)["theta"].values
    assert found == pytest.approx(expected, abs=1e-5)
    assert np.abs(found - free).max() > 1e-3


def test_fit_finds_the_play() -> None:
    rec = pk.simulate(loose(), wandering(), sigma=0.002, seed=1)
    est = pk.NLS().fit(loose().with_values(b=0.1), rec)
    assert abs(est.value("b") - HALF) < 4 * est.std("b") < 0.1


def test_fit_finds_where_each_recording_begins_in_the_play() -> None:
    model = loose(operating=True)
    made = [pk.simulate(model.with_values(e=e), wandering(about=u), sigma=0.002, seed=seed)
            for seed, (e, u) in enumerate(((0.7, 2.0), (-0.2, -3.0)))]
    est = pk.NLS().fit(model.with_values(b=0.2, e=0.0), made)
    for name, of, true in (("b", None, HALF), ("e", 0, 0.7), ("e", 1, -0.2)):
        assert abs(est.value(name, of) - true) < 4 * est.std(name, of) < 0.2


def test_files_and_dicts_keep_it() -> None:
    text = slow(operating=True).to_dict()["inputs"]["u_x"]
    assert (text["backlash"], text["backlash_start"], text["rate_limit"]) == ("b", "e", "R")
    for model in (slow(), slow(operating=True)):
        assert pk.Model.from_dict(model.to_dict()) == model


def test_a_start_in_no_play_is_refused() -> None:
    with pytest.raises(errors.BadModel, match="backlash_start but no backlash"):
        pk.systems.sloshing().map_input("u_x", backlash_start=0.5)


def test_a_relaxation_sees_a_known_play_and_refuses_an_unknown_one() -> None:
    rec = pk.simulate(loose(), wandering(), sigma=0.0005, seed=1)
    with pytest.raises(errors.BadSetting, match="backlash of input 'u_x'"):
        pk.IPDA().fit(loose(), rec)
    known = pk.IPDA().fit(loose().fix("b"), rec)
    assert abs(known.value("l_theta") - 0.045) < 5 * known.std("l_theta")


def test_a_second_play_is_refused() -> None:
    with pytest.raises(errors.BadModel, match="has a backlash already"):
        loose().map_input("u_x", backlash=0.1)


def test_the_catalogue_offers_it_for_every_input() -> None:
    model, rec = pk.systems.sloshing(), pk.excitation.two_pulse()
    found = [c for c in candidates(sites(model, (rec,))) if c.variant.startswith("backlash")]
    assert [c.ids for c in found] == [("hysteresis",)]
    assert found[0].applied(model).inputs[0].backlash.free_symbols


def test_one_that_is_in_operation_begins_anywhere_in_the_play() -> None:
    model, rest, far = pk.systems.sloshing(), pk.excitation.two_pulse(), wandering(about=1.0)
    for recordings, names in (((rest,), 1), ((far,), 2), ((rest, far), 2)):
        found = [c for c in candidates(sites(model, recordings))
                 if c.variant.startswith("backlash")]
        assert [len(c.parameters) for c in found] == [names]


def test_recorded_rates_below_the_limit_change_nothing() -> None:
    rec = wandering("first")
    fast = np.abs(np.diff(rec["u_x"].values)).max() / 0.01
    limit = Parameter("R", 1.01 * fast, "m/s^3")
    model = pk.systems.sloshing().map_input("u_x", [limit], hold="first", rate_limit="R")
    plain = pk.systems.sloshing().map_input("u_x", hold="first")
    found, expected = (pk.simulate(m, rec, sigma=0.0)["theta"].values for m in (model, plain))
    assert found == pytest.approx(expected, abs=1e-9)


def test_a_play_wider_than_the_input_leaves_nothing_to_look_for_in_it() -> None:
    level = NoiseModel(0.002, 0.0, 0.0, 0.01, "given")
    records = Records((pk.simulate(loose(), wandering(), sigma=0.002, seed=1),),
                      ({"theta": level},), DEFAULTS)
    model = loose().with_values(b=9.0)
    whitened = Whitened(model, records)
    theta = whitened.problem.guess
    assert whitened.choose_steps(theta)
    found = directions(whitened, theta, candidates(sites(pk.systems.sloshing(),
                                                         records.recordings)))
    at = [k for k, c in enumerate(found.candidates) if c.ids[0] == "input_gain"]
    assert not np.any(found.D[:, np.isin(found.owner, at)])
