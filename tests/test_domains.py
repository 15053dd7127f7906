"""Catalogues of effects that a model takes without being asked: its domain's, or its units'."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import pikanid as pk
from pikanid import errors
from pikanid.mismatch.catalogue.bound_effects import bound_to
from pikanid.mismatch.catalogue.sites import sites
from pikanid.model.domains import candidates_of, catalogues_of, not_taken, taken
from pikanid.model.effect_form import EffectForm
from pikanid.model.effects_file import read_effects

NAMES = {"thermal_rc": ("thermal",), "cascaded_tanks": ("hydraulics",),
         "batch_reactor": ("kinetics",), "one_compartment": ("kinetics",),
         "sir": ("populations",), "lotka_volterra": ("populations",),
         "dc_motor": ("electrical",), "two_mass_drive": (), "double_pendulum": (), "cart_pole": (),
         "sloshing": (), "sloshing_2d": (), "pendulum": (), "linear_oscillator": (),
         "duffing_oscillator": ()}


def content(unit: str, **more: Any) -> dict[str, Any]:
    return {"name": "decay", **more, "states": {"x": {"unit": unit, "initial": "free"}},
            "parameters": {"k": {"unit": "1/s", "guess": 0.5, "bounds": [0.0, 10.0]}},
            "equations": {"x": "-k*x"}, "outputs": {"x": {"unit": unit, "expression": "x"}}}


def decay(unit: str, **more: Any) -> pk.Model:
    return pk.Model.from_dict(content(unit, **more))


def test_every_ready_made_model_takes_what_suits_it() -> None:
    assert {n: catalogues_of(make()) for n, make in pk.systems.SYSTEMS.items()} == NAMES


@pytest.mark.parametrize(("unit", "names"), [
    ("degC", ("thermal",)), ("K", ("thermal",)), ("mg/l", ("kinetics",)),
    ("mol/m^3", ("kinetics",)), ("mA", ("electrical",)), ("V", ()),
    ("bar", ("hydraulics",)), ("m", ()), ("rad", ()), ("", ())])
def test_units_of_all_states_tell(unit: str, names: tuple[str, ...]) -> None:
    assert catalogues_of(decay(unit)) == names
    assert bool(taken(decay(unit))) == bool(names)


@pytest.mark.parametrize(("first", "second", "names"), [
    ("A", "V", ("electrical",)), ("V", "A", ("electrical",)), ("V", "V", ()),
    ("g/l", "l", ("kinetics",)), ("l", "l", ()), ("bar", "m^3", ("hydraulics",)),
    ("A", "m", ("electrical",)), ("bar", "degC", ("hydraulics", "thermal")),
    ("rad", "V", ())])
def test_one_unit_tells_whatever_stands_beside_it(
        first: str, second: str, names: tuple[str, ...]) -> None:
    table = content(first)
    table["states"] |= {"y": {"unit": second, "initial": "free"}}
    table["equations"] |= {"y": "-k*y"}
    assert catalogues_of(pk.Model.from_dict(table)) == names


@pytest.mark.parametrize(("unit", "names"), [("l/min", ("hydraulics",)), ("V", ())])
def test_a_length_is_a_level_where_something_flows(unit: str, names: tuple[str, ...]) -> None:
    table = content("cm")
    table["inputs"] = {"q": {"unit": unit}}
    table["parameters"] |= {"b": {"guess": 1.0, "unit": f"cm/s/({unit})"}}
    table["equations"] = {"x": "b*q - k*x"}
    assert catalogues_of(pk.Model.from_dict(table)) == names


def test_what_an_input_alone_fills_is_a_level() -> None:
    vessel = pk.Model.from_dict({
        "states": {"V": {"unit": "l"}}, "inputs": {"q": {"unit": "l/s"}},
        "parameters": {"b": {"guess": 1.0, "unit": "V/l"}}, "equations": {"V": "q"},
        "outputs": {"y": {"expression": "b*V"}}})
    assert catalogues_of(vessel) == ("hydraulics",)


def test_a_length_whose_rate_is_a_state_is_a_place() -> None:
    cylinder = pk.Model.from_dict({
        "states": {"x": {"unit": "m"}, "v": {"unit": "m/s"}, "p": {"unit": "bar"}},
        "inputs": {"q": {"unit": "l/min"}},
        "parameters": {n: {"guess": 1.0, "unit": unit} for n, unit in (
            ("a", "m/s^2/bar"), ("b", "bar/l"), ("c", "bar/m"), ("k", "1/s"))},
        "equations": {"x": "v", "v": "a*p - k*v", "p": "b*q - c*v"},
        "outputs": {"x": {"expression": "x"}}})
    assert {e.within for e in candidates_of(cylinder) if isinstance(e, EffectForm)} == {("p",)}


def test_what_was_not_looked_for_is_said() -> None:
    said = not_taken(decay("V"), ())
    assert "thermal" in said and "mechanics" not in said and "--catalogue" in said
    known = [e.key for e in read_effects("thermal")]
    assert "thermal" not in not_taken(decay("V"), known)
    assert "catalogue mechanics " in not_taken(pk.systems.sloshing(), ())
    assert not_taken(decay("V", domain=["hydraulics"]), ()) == ""


def test_a_domain_comes_before_units_and_stays_in_the_file(tmp_path: Path) -> None:
    model = decay("degC", domain=["kinetics", "hydraulics"])
    assert catalogues_of(model) == ("kinetics", "hydraulics")
    assert "catalogues kinetics and hydraulics" in taken(model) and "domain" in taken(model)
    model.save(tmp_path / "model.toml")
    again = pk.Model.load(tmp_path / "model.toml")
    assert again.domain == model.domain and again.to_dict() == model.to_dict()
    assert again.with_values(k=1.0).fix(k=1.0).domain == model.domain
    assert pk.Model.from_dict({**content("K"), "domain": "mechanics"}).domain == ("mechanics",)


@pytest.mark.parametrize("domain", [
    "plumbing", ["thermal", 3], 3, {"thermal": 1}, ["thermal"] * 999, [["thermal"]]])
def test_an_unknown_domain_is_refused(domain: object) -> None:
    with pytest.raises(errors.BadModel, match=r"domain.*thermal"):
        decay("K", domain=domain)
    with pytest.raises(errors.BadModel, match=r"domain.*thermal"):
        decay("K").replace(domain=domain)


def test_an_empty_domain_takes_none(tmp_path: Path) -> None:
    model = decay("degC", domain=[])
    assert not catalogues_of(model) and not taken(model)
    model.save(tmp_path / "model.toml")
    assert pk.Model.load(tmp_path / "model.toml").domain == ()


def test_of_states_of_several_kinds_each_takes_what_its_unit_tells() -> None:
    one = decay("degC")
    assert catalogues_of(one.with_state(pk.State("wall", "K", 0), "-wall")) == ("thermal",)
    reactor = one.with_state(pk.State("c", "mol/l", 0), "-c")
    assert catalogues_of(reactor) == ("kinetics", "thermal") and not not_taken(reactor, ())
    assert {e.within for e in candidates_of(reactor) if isinstance(e, EffectForm)} == {
        ("x",), ("c",)}
    tank = one.with_state(pk.State("h", "m", 0), "-h")
    assert "by the units of x." in taken(tank)
    assert "hydraulics" in not_taken(tank, ()) and "thermal" not in not_taken(tank, ())


def test_the_unit_of_an_input_tells_as_well() -> None:
    cell = content("V", inputs={"i": {"unit": "A"}}) | {"equations": {"x": "-k*x"}}
    assert catalogues_of(pk.Model.from_dict(cell)) == ("electrical",)
    motor = content("rad/s", inputs={"i": {"unit": "A"}})
    assert catalogues_of(pk.Model.from_dict(motor)) == ()


def test_of_several_domains_one_is_not_for_states_of_another() -> None:
    tank = decay("degC", domain=["hydraulics", "thermal"]).with_state(pk.State("h", "m", 0), "-h")
    assert {(e.key, e.within) for e in candidates_of(tank) if isinstance(e, EffectForm)} >= {
        ("overflow", ("h",)), ("hidden_storage", ("x", "h"))}


def test_an_effect_of_a_catalogue_is_looked_for_where_its_unit_tells() -> None:
    reactor = decay("degC").with_state(pk.State("c", "mol/l", 1.0), "-c")
    reactor = reactor.replace(outputs=(*reactor.outputs, pk.Output("c", "c", "mol/l")))
    t = np.linspace(0.0, 5.0, 50)
    recording = pk.Recording.from_arrays(t, {"x": np.exp(-t), "c": np.exp(-t)},
                                         {"x": "degC", "c": "mol/l"})
    motion = {n: np.exp(-t) for n in ("x", "c")}
    made = bound_to(candidates_of(reactor), sites(reactor, [recording]), [recording],
                    lambda: motion)
    where = {(e.key, v) for e in made for v in e.add}
    assert ("hidden_storage", "x") in where and ("hidden_storage", "c") not in where
    assert ("saturating_rate", "c") in where or any(k == "removal" and v == "c" for k, v in where)
    assert not any(k == "removal" and v == "x" for k, v in where)


def test_catalogues_that_share_a_key_can_both_be_taken() -> None:
    both = decay("", domain=["kinetics", "populations", "kinetics"])
    assert both.domain == ("kinetics", "populations")
    keys = [e.key for e in candidates_of(both)]
    assert len(keys) == len({*keys}) and {"removal", "depot", "crowding"} <= {*keys}


def effects_of(model: pk.Model, *names: str, **channels: tuple[str, float]) -> list[str]:
    """Key and variant of what is bound to a model, with further columns recorded."""
    t = np.linspace(0.0, 4.0, 50)
    drive = pk.Recording.from_arrays(
        t, {n: size * np.sin(t) for n, (_, size) in channels.items()} or {"u": 0 * t},
        {n: unit for n, (unit, _) in channels.items()})
    run = pk.simulate(model, drive, seed=0).with_channels(*(drive[n] for n in channels))
    found = bound_to([e for n in names for e in read_effects(n)], sites(model, (run,)), [run],
                     lambda: dict.fromkeys(model.state_names, np.array([0.0, 2.0])))
    return [f"{e.key}[{e.variant}]" for e in found]


def test_heat_is_lost_to_temperatures_and_only_angles_hang() -> None:
    room = decay("degC").with_values(k=0.5)
    lost = [e for e in effects_of(room, "thermal", outside=("degC", 8.0), sun=("W/m^2", 500.0))
            if e.startswith("loss_to[")]
    assert lost == ["loss_to[]"]  # of which it names no column, as there is one only
    assert not any("gravity" in e for e in effects_of(pk.systems.linear_oscillator(), "mechanics"))
    assert any("gravity" in e for e in effects_of(pk.systems.pendulum(), "mechanics"))


def test_surroundings_may_be_a_fixed_parameter() -> None:
    around = pk.Parameter("T_a", 20.0, "degC", free=False)
    room = decay("degC").with_values(k=0.5)
    lost = ("radiation[]", "convection[]", "loss_to[]")
    assert not {*lost} & {*effects_of(room, "thermal")}
    fixed, free, other = (effects_of(room.with_parameters(p), "thermal") for p in (
        around, replace(around, free=True), replace(around, unit="W")))
    assert {*lost} <= {*fixed} and not {*lost} & {*free, *other}


@pytest.mark.parametrize("lost", [4.0, 0.0])
def test_heat_may_be_lost_to_surroundings_that_nobody_records(lost: float) -> None:
    """An oven in a room of 12 degC that its model does not know; exact from sample to sample."""
    oven = pk.Model.from_dict({
        "name": "oven", "states": {"T": {"unit": "degC", "initial": 20.0}},
        "inputs": {"P": {"unit": "W", "hold": "zero"}},
        "parameters": {"C": {"unit": "J/K", "guess": 800.0, "bounds": [10.0, 1e5]}},
        "equations": {"T": "P/C"}, "outputs": {"T": {"unit": "degC", "expression": "T"}}})

    def run(seed: int) -> pk.Recording:
        rng = np.random.default_rng(seed)
        power, warm = np.repeat(rng.uniform(0.0, 500.0, 20), 20), [20.0]
        for p in power[:-1]:
            steady = 12.0 + p / (lost or 1.0)
            warm.append(steady + (warm[-1] - steady) * np.exp(-lost / 1000.0 * 5.0) if lost
                        else warm[-1] + p / 1000.0 * 5.0)
        return pk.Recording.from_arrays(
            np.arange(400) * 5.0, {"P": power, "T": warm + 0.1 * rng.standard_normal(400)},
            {"P": "W", "T": "degC"})

    dx = pk.diagnose(oven, run(1), run(2))
    if not lost:
        assert dx.verdict == "none"
        return
    assert dx.verdict == "named" and dx.hypotheses[0].effects[0].ids == ("ambient_loss",)
    k, around = dx.hypotheses[0].effects[0].parameters.values()
    assert abs(k.value - 0.004) < 4 * k.std and abs(around.value - 12.0) < 4 * around.std
    assert abs(dx.model.values["C"] - 1000.0) < 1.0


@pytest.mark.parametrize(("unit", "zero"), [("degC", -273.15), ("K", 0.0)])
def test_a_hot_plate_radiates_on_any_scale(unit: str, zero: float) -> None:
    """Simulated by SciPy in kelvins, with as much lost by radiation as by conduction."""
    table = content(unit, inputs={"P": {"unit": "W"}, "T_a": {"unit": unit}})
    table["parameters"] = {"C": {"unit": "J/K", "guess": 900.0, "bounds": [100.0, 9000.0]},
                           "k": {"unit": "1/s", "guess": 1e-3, "bounds": [0.0, 1.0]}}
    table["equations"] = {"x": "P/C - k*(x - T_a)"}
    model, run = pk.Model.from_dict(table), partial(plate, unit=unit, zero=zero)
    dx = pk.diagnose(model, run(1), run(2), workers=1)
    assert dx.verdict in ("named", "set")
    found = {i: e for h in dx.hypotheses for e in h.effects for i in e.ids}
    (value,) = [v for n, v in found["radiation"].parameters.items()]
    assert abs(value.value - 2e-12) < 4 * value.std < 4e-13


def plate(seed: int, unit: str, zero: float) -> pk.Recording:
    rng, step, n = np.random.default_rng(seed), 5.0, 400
    t, x = step * np.arange(n), np.full(n, 330.0)
    power, around = np.repeat(rng.uniform(0, 900, n // 40), 40), 295.0 + 4 * np.sin(t / 300 + seed)
    for k in range(n - 1):
        x[k + 1] = solve_ivp(
            lambda _, y, k=k: power[k] / 1000 - 5e-4 * (y - around[k])
            - 2e-12 * (y**4 - around[k] ** 4), (0, step), x[k : k + 1], rtol=1e-9).y[0, -1]
    seen = x + zero + 0.1 * rng.standard_normal(n)
    return pk.Recording.from_arrays(
        t, {"P": power, "T_a": around + zero, "x": seen}, {"P": "W", "T_a": unit, "x": unit})


def test_a_parameter_of_two_equations_is_changed_once() -> None:
    """β of an epidemic stands in those of S and of I."""
    found = effects_of(pk.systems.sir(), "populations")
    assert "satiation[S,beta]" in found and "interference[I,beta,S]" not in found
    assert len(found) == len({*found})


@pytest.mark.parametrize("at", [0.0, 0.3])
def test_a_coordinate_that_stays_has_no_pitch(at: float) -> None:
    model = pk.systems.pendulum()
    run = pk.simulate(model, pk.excitation.free_decay(4.0), seed=0)
    found = bound_to(read_effects("mechanics"), sites(model, (run,)), [run],
                     lambda: dict.fromkeys(model.state_names, np.array([at, at])))
    assert [e.key for e in found] == ["gravity", "damping_one_way"]


def test_a_state_that_stays_at_zero_has_no_guesses() -> None:
    model = pk.Model.from_dict({
        "name": "two substances", "domain": "kinetics",
        "states": {"a": {"unit": "mol/l", "initial": 1.0}, "b": {"unit": "mol/l", "initial": 0.0}},
        "parameters": {"k": {"unit": "1/s", "guess": 0.5, "bounds": [0.0, 10.0]},
                       "j": {"unit": "1/s", "value": 1.0}},
        "equations": {"a": "-k*a", "b": "-j*b"},
        "outputs": {"a": {"unit": "mol/l", "expression": "a"}}})
    t = np.linspace(0.0, 4.0, 80)
    run, other = (pk.simulate(model, pk.Recording.from_arrays(t, {"u": 0 * t}), seed=s,
                              sigma={"a": 0.01}) for s in (1, 2))
    assert pk.diagnose(model, run, other, workers=1).verdict == "none"


def test_what_is_listed_already_is_not_listed_twice() -> None:
    model = decay("degC").with_candidates(*read_effects("thermal"))
    keys = [e.key for e in candidates_of(model)]
    assert keys == [e.key for e in read_effects("thermal")]


def test_a_diagnosis_takes_them_and_says_so() -> None:
    """A room with a second wall mass; only the model of one capacity is given."""
    house = pk.systems.thermal_rc().with_values(R=0.005, C=1e7, T_0=20.0)
    truth = house.with_state(pk.State("wall", "degC", 20), "(T - wall)/3000").with_term(
        "T", "(wall - T)/4000")
    t = np.arange(0.0, 2e5, 600.0)

    def run(seed: int) -> pk.Recording:
        rng = np.random.default_rng(seed)
        drive = pk.Recording.from_arrays(
            t, {"T_a": 5 + 5 * np.sin(t / 2e4), "P": 4000.0 * rng.integers(0, 2, len(t) // 8 + 1)
                [np.arange(len(t)) // 8]}, {"T_a": "degC", "P": "W"},
            hold={"T_a": "zero", "P": "zero"})
        return pk.simulate(truth, drive, sigma={"T": 0.02}, seed=seed)

    dx = pk.diagnose(house, run(1), run(2), workers=1)
    assert dx.verdict in ("named", "set")
    assert "hidden_storage" in dx.hypotheses[0].effects[0].ids
    assert any("catalogue thermal" in note for note in dx.notes)
