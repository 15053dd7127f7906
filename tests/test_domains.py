"""Catalogues of effects that a model takes without being asked: its domain's, or its units'."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pikanid as pk
from pikanid import errors
from pikanid.model.domains import candidates_of, catalogues_of, taken
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
    ("mol/m^3", ("kinetics",)), ("mA", ("electrical",)), ("V", ()), ("m", ()), ("rad", ()),
    ("", ())])
def test_units_of_all_states_tell(unit: str, names: tuple[str, ...]) -> None:
    assert catalogues_of(decay(unit)) == names
    assert bool(taken(decay(unit))) == bool(names)


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
    "plumbing", ["thermal", 3], 3, {"thermal": 1}, ["thermal"] * 99])
def test_an_unknown_domain_is_refused(domain: object) -> None:
    with pytest.raises(errors.BadModel, match=r"domain.*thermal"):
        decay("K", domain=domain)


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
