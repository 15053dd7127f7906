"""Concealed recordings of any model: SciPy's simulator, laws, sizes, truths."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import pikanid as pk
from pikanid import errors
from pikanid.cli import main
from pikanid.model import Effect
from pikanid.model.effects_file import read_effects
from pikanid.model.parts import Parameter
from pikanid.validation.concealed.score import judge
from pikanid.validation.own_model import case as making
from pikanid.validation.own_model.case import Order, acting, make
from pikanid.validation.own_model.generate import OwnSet, generate
from pikanid.validation.own_model.hidden import Hidden, Workbench
from pikanid.validation.own_model.law import Law
from pikanid.validation.own_model.plant import Plant
from pikanid.validation.own_model.rig import Rig
from pikanid.validation.own_model.trial import placed


def inputs(model: pk.Model, n: int = 200, dt: float = 0.02, seed: int = 0) -> pk.Recording:
    """Steps, after a tenth without any."""
    rng = np.random.default_rng(seed)
    t = np.arange(n) * dt
    piece = (t / t[-1] * 19).astype(int)
    driven = [i for i in model.inputs if i.default is None]
    steps = {i.name: np.where(piece < 2, 0.0, rng.uniform(-1, 1, 20)[piece]) for i in driven}
    return pk.Recording.from_arrays(t, steps or {"clock": t}, {i.name: i.unit for i in driven})


def effect(model: pk.Model, **change: dict) -> pk.Model:
    parameters = (Parameter("e", 0.03, ""),)
    return model.with_effect(Effect("own", "own", parameters, ("e", 0.0), **change))


MOTOR, CRANE = pk.systems.dc_motor(), pk.systems.cart_pole()


EVERY_MAP = [
    MOTOR, effect(MOTOR, inputs={"u": {"delay": "e"}}), effect(MOTOR, inputs={"u": {"lag": "e"}}),
    effect(MOTOR, inputs={"u": {"saturation": "0.5", "dead_zone": "e"}}),
    effect(MOTOR, outputs={"omega": {"delay": "e"}}),
    effect(MOTOR, add={"omega": "-e*signed_power(omega, 1.5) - e*tanh(omega/0.1)"}),
    pk.systems.two_mass_drive(), pk.systems.lotka_volterra(), CRANE,
    effect(CRANE, add={"x_dot": "-30*max(x - e, 0) - clip(x_dot, -e, e)"})]


@pytest.mark.parametrize("model", [
    effect(MOTOR, inputs={"u": {"delay": "e", "dead_zone": "e"}},
           outputs={"omega": {"lag": "e", "drift": "e", "gain": "1 + e", "delay": "2*e"}}),
    *(pytest.param(model, marks=pytest.mark.slow) for model in EVERY_MAP)])
def test_scipys_simulator_agrees_with_the_kits(model: pk.Model) -> None:
    experiment = inputs(model)
    ours = Plant(model).outputs({}, experiment)
    theirs = pk.simulate(model, experiment)
    for name, y in ours.items():
        kit = theirs[name].values
        assert np.max(np.abs(y - kit)) < 2e-5 * (np.ptp(kit) or 1.0), name


def test_a_late_sensor_shows_a_motion_that_is_under_way() -> None:
    """As if all inputs came late: not its first value until then, as no sensor of a room does."""
    room, late = pk.systems.thermal_rc(), {"delay": "2000*e"}
    experiment = inputs(room, 100, 30.0, seed=4)
    sensor = effect(room, outputs={"T": late})
    frozen, seen = (Plant(sensor, under_way=way).outputs({}, experiment)["T"]
                    for way in (False, True))
    driven = effect(room, inputs={i.name: late for i in room.inputs})
    assert seen == pytest.approx(Plant(driven).outputs({}, experiment)["T"], abs=1e-6)
    assert frozen[0] == frozen[1] != frozen[3]
    assert np.max(np.abs(frozen - seen)) > 1e-3
    # what begins at rest shows that it does
    motor = effect(MOTOR, outputs={"omega": {"delay": "e"}})
    one, other = (Plant(motor, under_way=way).outputs({}, inputs(MOTOR))["omega"]
                  for way in (True, False))
    assert np.array_equal(one, other)


@pytest.mark.parametrize("middle", [15.0, 0.0])
def test_a_law_that_is_an_entry_in_other_words_is_not_hidden(
        middle: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """What has one gain for each sign, of an input that has one sign, has a gain."""
    room = pk.systems.thermal_rc()
    heard = inputs(room, 300, 1800.0)
    shifted = heard.with_channels(*(
        replace(heard[i.name], values=10 * heard[i.name].values + middle) for i in room.inputs))
    rig = Rig(room, shifted, shifted, 0.005)
    monkeypatch.setattr(making, "ATTEMPTS", 1)
    monkeypatch.setattr(making, "_chosen", lambda kind, laws, rng: [
        next(one for one in laws if one.id == "one_way_gain")])
    if middle:
        with pytest.raises(errors.SimulationFailed):
            make(Order("001", 3, 0, "outside", rig))
    else:
        assert make(Order("001", 3, 0, "outside", rig)).truth["class"] == "outside"


def test_a_distance_is_that_of_the_lowest_minimum() -> None:
    """A scale error of a pump is the model's own scale: a fit from the truth missed that."""
    tanks = pk.systems.cascaded_tanks()
    experiment = inputs(tanks, 400, 4.0, seed=7)
    driven = experiment.with_channels(*(replace(
        experiment[i.name], values=2.6 + 1.3 * experiment[i.name].values) for i in tanks.inputs))
    rig = Rig(tanks, driven, driven, 0.005)
    values = {"k1": 0.06038, "k3": 0.04888, "k4": 0.03217, "x1_0": 4.161, "x2_0": 6.053}
    bench = Workbench(rig.nominal, values, rig.scene(values))
    drift, gain = (next(one for one in rig.laws(values) if one.id == key)
                   for key in ("sensor_drift", "input_gain"))
    hidden = [Hidden(drift, {drift.size.name: -6.5e-5}), Hidden(gain, {gain.size.name: -0.26})]
    assert bench.fitted(bench.seen(hidden), hidden[:1], sure=True).distance < 0.01


def test_a_fast_decay_is_simulated() -> None:
    """A lag of a millionth of a second: the explicit method alone takes too many steps."""
    experiment = inputs(MOTOR)
    quick = effect(MOTOR, inputs={"u": {"lag": "e"}})
    without, lagging = Plant(MOTOR).outputs({}, experiment), Plant(quick)
    for lag in (1e-6, 1e-5):
        found = lagging.outputs({"e": lag}, experiment)["omega"]
        rise = np.gradient(without["omega"], 0.02)
        assert np.abs(found - without["omega"] + lag * rise).max() < 3 * lag * np.abs(rise).max()



def test_what_scipys_simulator_does_not_do_is_refused() -> None:
    with pytest.raises(errors.BadModel, match="play"):
        Plant(MOTOR.map_input("u", backlash="0.1"))


def test_a_motion_that_diverges_is_said() -> None:
    bad = effect(MOTOR, add={"omega": "1e3*omega*abs(omega)"})
    with pytest.raises(errors.SimulationFailed):
        Plant(bad).outputs({"e": 1.0}, inputs(MOTOR))


@pytest.fixture(scope="module")
def motor_rig() -> Rig:
    return Rig(MOTOR, inputs(MOTOR, seed=1), inputs(MOTOR, seed=2), 0.005)


def law(rig: Rig, key: str) -> Law:
    return next(one for one in rig.laws(rig.nominal.values) if one.id == key)


def test_a_law_stands_where_it_acts(motor_rig: Rig) -> None:
    found = {(one.id, one.channel, one.where) for one in motor_rig.laws(MOTOR.values)}
    assert ("coulomb_friction", "dynamics", "omega") in found
    assert ("input_saturation", "input", "u") in found
    assert ("sensor_lag", "sensor", "omega") in found
    assert ("parameter_drift", "dynamics", "omega") in found
    drift = {one.effect.variant: one.places for one in motor_rig.laws(MOTOR.values)
             if one.id == "parameter_drift"}
    assert drift["i,k"] == drift["omega,k"] == ("i", "omega")  # torque and counter-voltage
    assert drift["omega,J"] == ("omega",)
    assert law(motor_rig, "input_delay").twins == ("sensor_delay",)
    assert not [one for one in found if one[0] == "cubic_stiffness"]  # there is no coordinate


@pytest.mark.parametrize("seed", [0, 2, 3])
def test_a_law_is_as_far_as_is_wanted(motor_rig: Rig, seed: int) -> None:
    values = {n: MOTOR.values[n] for n in MOTOR.free_names}
    bench = Workbench(motor_rig.nominal, values, motor_rig.scene(values))
    friction = next(one for one in motor_rig.laws(values)
                    if (one.id, one.where) == ("coulomb_friction", "omega"))
    hidden = bench.sized(friction, np.random.default_rng(seed))
    first, refitted = bench.missed([hidden]), bench.fitted(bench.seen([hidden]), []).distance
    assert 2.5 < first < 620
    assert refitted == pytest.approx(first, rel=0.25)
    assert bench.fitted(bench.seen([hidden]), [hidden]).distance < 0.5


def test_a_temperature_in_degc_has_neither_power_nor_sign() -> None:
    house = pk.systems.thermal_rc()
    rig = Rig(house, inputs(house), inputs(house, seed=1), 0.01, ())
    hidden = {one.id for one in rig.laws(house.values)}
    assert "static_bias" in hidden
    assert not hidden & {"coulomb_friction", "quadratic_drag", "power_drag"}


def test_what_another_laws_own_parameters_take_up_is_not_seen() -> None:
    """A constant source beside a loss to surroundings that nobody records: they may be colder."""
    house = pk.systems.thermal_rc()
    driven = inputs(house, dt=1800.0)
    rig = Rig(house, driven, driven, 0.01, tuple(read_effects("thermal")))
    values = {n: house.values[n] for n in house.free_names}
    bench = Workbench(rig.nominal, values, rig.scene(values))
    loss, source = (law(rig, key) for key in ("ambient_loss", "static_bias"))
    surroundings = loss.effect.parameters[1].name
    lost = Hidden(loss, {loss.size.name: 3e-7, surroundings: 15.0})
    hidden = [lost, Hidden(source, {source.size.name: -3e-5})]
    truth = bench.seen(hidden)
    assert bench.fitted(truth, [], sure=True).distance > 5.0
    found = bench.fitted(truth, [lost], sure=True)
    assert found.distance < 1.0 and found.values[surroundings] < 0.0


def test_laws_that_cannot_be_put_together_are_no_pair() -> None:
    """A scale error of a temperature in degC, and what needs that in K."""
    house = pk.systems.thermal_rc()
    rig = Rig(house, inputs(house), inputs(house, seed=1), 0.01, tuple(read_effects("thermal")))
    values = {n: house.values[n] for n in house.free_names}
    bench = Workbench(rig.nominal, values, rig.scene(values))
    both = [Hidden(law(rig, key), {}) for key in ("radiation", "input_gain")]
    assert [bench.extended([one]) for one in both]
    with pytest.raises(errors.SimulationFailed, match="degC"):
        bench.extended(both)


def test_what_cannot_be_seen_is_not_hidden(motor_rig: Rig) -> None:
    values = {n: MOTOR.values[n] for n in MOTOR.free_names}
    bench = Workbench(motor_rig.nominal, values, motor_rig.scene(values))
    scale = law(motor_rig, "input_gain")  # k, J and b take it up
    with pytest.raises(errors.SimulationFailed, match="visible"):
        bench.sized(scale, np.random.default_rng(0))


def test_a_case_is_a_function_of_its_order_and_its_truth_is_judged(motor_rig: Rig) -> None:
    order = Order("001", 3, 0, "single", motor_rig)
    case = make(order)
    assert case.recordings == make(order).recordings
    hidden, = case.truth["effects"]  # type: ignore[misc]
    answer = {"verdict": "named", "mismatch": True, "hypotheses": [
        {"effects": [{"ids": [hidden["id"]]}], "probability": 0.9}]}
    assert judge(dict(case.truth), answer).outcome == "right"
    answer["hypotheses"][0]["effects"][0]["ids"] = ["another"]  # type: ignore[index]
    assert judge(dict(case.truth), answer).outcome == "wrong"


FORCE = {"id": "static_bias", "twins": [],
         "where": {"channel": "dynamics", "places": ["omega"]}}


@pytest.mark.parametrize(("given", "right"), [
    ([("static_bias", "dynamics", "omega")], True),
    ([("static_bias", "dynamics", "i")], False),
    ([("sensor_offset", "sensor", "omega")], False),
    ([("sensor_offset", "sensor", "omega"), ("static_bias", "dynamics", "omega")], True),
    ([("sensor_offset/static_bias", "sensor", "omega")], True)])
def test_the_place_of_the_answer_that_is_right_counts(given: list[tuple[str, str, str]],
                                                      right: bool) -> None:
    answer = {"hypotheses": [{"effects": [
        {"ids": ids.split("/"), "channel": channel, "equation": equation}]}
        for ids, channel, equation in given]}
    assert placed({"effects": [FORCE]}, answer) == right


def test_noise_is_what_was_asked_for(motor_rig: Rig, tmp_path: Path) -> None:
    case = make(Order("001", 4, 0, "nothing", motor_rig))
    (tmp_path / "a.csv").write_bytes(case.recordings["001_train.csv"])
    seen = pk.Recording.read(tmp_path / "a.csv")
    values = {n: v["value"] for n, v in case.truth["base"].items()}  # type: ignore[attr-defined]
    clean = Plant(MOTOR).outputs(values, motor_rig.train)["omega"]
    sigma = case.truth["noise"]["omega"]  # type: ignore[index]
    assert sigma == pytest.approx(0.005 * np.ptp(clean), rel=1e-3)
    assert np.std(seen["omega"].values - clean) == pytest.approx(sigma, rel=0.2)
    assert seen["omega"].unit == "rad/s"


def test_inputs_count_in_the_models_units(motor_rig: Rig) -> None:
    train = motor_rig.train
    in_mV = pk.Recording.from_arrays(train.t, {"u": 1e3 * train["u"].values}, {"u": "mV"})
    rig = Rig(MOTOR, in_mV, train, 0.005)
    np.testing.assert_allclose(rig.train["u"].values, train["u"].values)
    assert rig.train["u"].unit == "V"
    with pytest.raises(errors.BadUnit):
        Rig(MOTOR, pk.Recording.from_arrays([0, 1], {"u": [0, 1]}, {"u": "kg"}), train, 0.005)


def test_what_happens_once_is_in_one_recording(motor_rig: Rig) -> None:
    once, lasting = (Hidden(law(motor_rig, key), {}) for key in ("disturbance", "coulomb_friction"))
    assert acting([once, lasting], "train") == [once, lasting]
    assert acting([once, lasting], "held_out") == [lasting]


def test_a_set_of_ones_own(motor_rig: Rig, tmp_path: Path) -> None:
    wanted = OwnSet(motor_rig, 3, {"nothing": 1.0})
    made = generate(tmp_path / "r", tmp_path / "t.json", wanted, seed=1, workers=1)
    assert made.made == 3
    truth = json.loads((tmp_path / "t.json").read_bytes())
    assert [c["class"] for c in truth["cases"]] == ["nothing"] * 3
    again = generate(tmp_path / "r", tmp_path / "t.json", wanted, seed=1)
    assert (again.made, again.kept) == (0, 3)
    with pytest.raises(errors.BadSetting):
        generate(tmp_path / "r", tmp_path / "t.json", OwnSet(motor_rig, 4), seed=1)


def test_from_a_model_file_to_a_score(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    MOTOR.save(tmp_path / "m.toml")
    for k, name in enumerate(("a.csv", "b.csv")):
        inputs(MOTOR, seed=k).write(tmp_path / name)
    common = ["--model", str(tmp_path / "m.toml")]
    made = ["conceal", *common, "--inputs", str(tmp_path / "a.csv"), "--held-out-inputs",
            str(tmp_path / "b.csv"), "--out", str(tmp_path / "r"), "--truth",
            str(tmp_path / "t.json"), "--cases", "2", "--mix", "nothing=1", "--seed", "5",
            "--workers", "1", "-q"]
    assert main(made) == 0
    scored = ["score", str(tmp_path / "r"), *common, "--truth", str(tmp_path / "t.json"),
              "--json", str(tmp_path / "s.json"), "--workers", "1", "-q"]
    assert main(scored) == 0
    kept = sorted((tmp_path / "r.answers").iterdir())
    assert len(kept) == 2
    shares = json.loads((tmp_path / "s.json").read_bytes())["shares"]
    assert (shares["false_alarm"]["count"], shares["false_alarm"]["of"]) == (0, 2)
    before = [p.stat().st_mtime_ns for p in kept]
    assert main(scored) == 0  # what is answered is not asked again
    assert before == [p.stat().st_mtime_ns for p in kept]
    (tmp_path / "r" / "001_train.csv").write_text("t,x\n0,1\n")
    assert main(scored) == 2 and "was changed" in capsys.readouterr().err


def test_a_model_needs_two_files_of_inputs(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["conceal", "--model", "dc_motor", "--out", str(tmp_path / "r"), "--truth",
                 str(tmp_path / "t.json")]) == 2
    assert "--held-out-inputs" in capsys.readouterr().err


@pytest.mark.parametrize("wrong", [0.0, 0.9, float("nan")])
def test_bad_noise_is_refused(wrong: float) -> None:
    with pytest.raises(errors.BadSetting, match="noise"):
        Rig(MOTOR, inputs(MOTOR), inputs(MOTOR), wrong)


def test_an_unknown_class_is_refused(motor_rig: Rig) -> None:
    with pytest.raises(errors.BadSetting, match="classes"):
        OwnSet(motor_rig, 3, {"many": 1.0})
