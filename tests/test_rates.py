"""Models whose coordinates move with momenta, in terms of rates."""

from __future__ import annotations

import numpy as np
import pytest

import pikanid as pk
from pikanid.mismatch.catalogue.sites import sites
from pikanid.model.rates import in_rates

T = np.arange(0.0, 6.0, 0.01)
PUSH = pk.Recording.from_arrays(T, {"F": 4.0 * np.sign(np.sin(2.1 * T + 0.3 * T**2))}, {"F": "N"})


def hamiltonian() -> pk.Model:
    """Two masses in momenta, seen in centimetres; one begins to move."""
    return pk.Model.from_dict({
        "states": {"q": {"unit": "cm", "initial": 1.0}, "p": {"unit": "kg*m/s", "initial": 0.2},
                   "r": {"unit": "m", "initial": 0.0}, "s": {"unit": "kg*m/s", "initial": "free",
                                                               "guess": 0.1}},
        "inputs": {"F": {"unit": "N"}},
        "parameters": {"m": {"unit": "kg", "guess": 1.5, "bounds": [0.1, 9.0]},
                       "k": {"unit": "N/m", "guess": 40.0, "bounds": [1.0, 500.0]},
                       "d": {"unit": "N*s/m", "guess": 0.3, "bounds": [0.0, 9.0]}},
        "equations": {"q": "p/m", "p": "F - k*q - d*(p/m - s/(2*m))", "r": "s/(2*m)",
                      "s": "-k*(r - q) - d*(s/(2*m) - p/m)"},
        "outputs": {"y": {"unit": "cm", "expression": "q"},
                    "z": {"unit": "m", "expression": "r"},
                    "v": {"unit": "m/s", "expression": "s/(2*m)"}}})


def test_the_same_system_in_rates() -> None:
    model, said = in_rates(hamiltonian())
    assert model.state_names == ("q", "q_dot", "r", "r_dot") and len(said) == 2
    assert model.free_names == hamiltonian().free_names
    assert [s.unit for s in model.states] == ["cm", "cm/s", "m", "m/s"]
    for values in ({}, {"m": 3.0, "k": 90.0, "s_0": -0.4}):
        one, other = (pk.simulate(m.with_values(values), PUSH) for m in (hamiltonian(), model))
        for name in ("y", "v"):
            np.testing.assert_allclose(one[name].values, other[name].values, atol=1e-6)
    assert in_rates(model) == (model, [])
    found = sites(model, (pk.simulate(model, PUSH, sigma=0.01, seed=1),))
    assert [(s.q, s.v) for s in found if not s.lever] == [("q", "q_dot"), ("r", "r_dot")]


@pytest.mark.parametrize("right", ["p*cos(q)", "p/m + 0.1*F", "p/m - 0.1*r", "p"])
def test_what_is_no_constant_factor_stays(right: str) -> None:
    model = pk.Model.from_dict({
        "states": {"q": {"initial": 0.1}, "p": {"initial": 0.0}, "r": {"initial": 0.0}},
        "inputs": {"F": {}}, "parameters": {"m": {"guess": 2.0}},
        "equations": {"q": right, "p": "F - q", "r": "-r"}, "outputs": {"y": {"expression": "q"}}})
    assert in_rates(model) == (model, [])


@pytest.mark.parametrize("name", sorted(pk.systems.SYSTEMS))
def test_ready_made_systems_keep_their_states(name: str) -> None:
    """Some products of reactions, and removed individuals, only add up what a state does."""
    model = pk.systems.SYSTEMS[name]()
    assert in_rates(model) == (model, [])


def test_a_voltage_is_no_coordinate() -> None:
    circuit = pk.Model.from_dict({
        "states": {"v": {"unit": "V", "initial": 0.0}, "i": {"unit": "A", "initial": 0.0}},
        "inputs": {"u": {"unit": "V"}},
        "parameters": {"C": {"unit": "F", "guess": 1e-3}, "L": {"unit": "H", "guess": 0.1}},
        "equations": {"v": "i/C", "i": "(u - v)/L"},
        "outputs": {"y": {"unit": "V", "expression": "v"}}})
    assert in_rates(circuit) == (circuit, [])


def test_effects_in_the_models_own_states_keep_these() -> None:
    drag = pk.Effect("drag", "drag", (pk.Parameter("c", 0.1, "1/s"),), ("c", 0.0),
                     add={"p": "-c*p"})
    model = hamiltonian().with_candidates(drag)
    assert in_rates(model) == (model, [])


def test_friction_of_a_momentum_is_named() -> None:
    nominal = pk.Model.from_dict({
        "states": {"q": {"unit": "m", "initial": 0.0}, "p": {"unit": "kg*m/s", "initial": 0.0}},
        "inputs": {"F": {"unit": "N"}},
        "parameters": {"m": {"unit": "kg", "guess": 1.5, "bounds": [0.1, 9.0]},
                       "k": {"unit": "N/m", "guess": 40.0, "bounds": [1.0, 500.0]}},
        "equations": {"q": "p/m", "p": "F - k*q"},
        "outputs": {"y": {"unit": "m", "expression": "q"}}})
    truth = nominal.with_values({"m": 2.0, "k": 50.0}).with_term(
        "p", "-c*sign(p)", [pk.Parameter("c", 1.2, "N")])
    t = np.arange(0.0, 8.0, 0.01)
    train, later = (pk.simulate(truth, pk.Recording.from_arrays(t, {"F": np.repeat(
        np.random.default_rng(s).uniform(-9.0, 9.0, 16), 50)}, {"F": "N"}), sigma=1e-3, seed=s)
        for s in (1, 2))
    found = pk.diagnose(nominal, train, later, workers=1)
    assert found.verdict == "named"
    (effect,) = found.hypotheses[0].effects
    assert effect.ids == ("coulomb_friction",)
    (c,) = effect.parameters.values()
    assert abs(c.value - 0.6) < 4 * c.std and c.unit == "m/s^2"  # of the rate, 1.2 N by 2 kg
    assert any("'q_dot' = p/m" in note for note in found.notes)
