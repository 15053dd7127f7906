"""Every entry of the catalogue and every decoy, in models of one and of two coordinates."""

from __future__ import annotations

import ast
import re
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
import sympy as sp

import pikanid as pk
from pikanid.formula.expressions import symbol
from pikanid.mismatch.catalogue.candidate import Candidate, Channel
from pikanid.mismatch.catalogue.catalogue import candidates
from pikanid.mismatch.catalogue.friction import _half_derivative
from pikanid.mismatch.catalogue.sites import sites
from pikanid.model import Model, systems
from pikanid.recording import Recording, excitation
from pikanid.simulation.vectorfield import VectorField
from pikanid.symbolic.library import LIBRARY


def made(model: Model) -> tuple[Candidate, ...]:
    recording = pk.simulate(model, excitation.two_pulse())
    return candidates(sites(model, (recording,)))


@pytest.mark.parametrize("make", [systems.sloshing, systems.sloshing_2d])
def test_candidates_are_well_formed(make: Callable[[], Model]) -> None:
    model = make()
    found = made(model)
    for candidate in found:
        assert candidate.name and candidate.expression and all(candidate.ids), candidate.key
        for p in candidate.parameters:
            low, high = p.bounds
            assert isinstance(p.unit, str), candidate.key
            assert np.isfinite(p.value) and low <= p.value <= high, (candidate.key, p.name)
            assert p.name == symbol(p.name).name and p.name not in model.parameter_names
        if candidate.fits:
            wider = candidate.applied(model)
            # beside what is estimated, numbers that have a unit
            added = {p.name for p in wider.parameters if p.free} - set(model.parameter_names)
            assert added == {p.name for p in candidate.parameters}, candidate.key
    groups = Counter(c.twin for c in found if c.twin)
    assert groups and min(groups.values()) > 1  # nothing is a twin of nothing
    assert {c.channel for c in found} == set(get_args(Channel))


@pytest.mark.parametrize("make", [systems.cart_pole, systems.sloshing_2d, systems.thermal_rc])
def test_a_channel_is_offered_once(make: Callable[[], Model]) -> None:
    """One force moves cart and pole: what happens to it on its way in is one explanation."""
    model, t = make(), 0.01 * np.arange(500)
    moved = Recording.from_arrays(t, {i.name: np.sin(t) for i in model.inputs},
                                  {i.name: i.unit for i in model.inputs})
    found = candidates(sites(model, (pk.simulate(model, moved),)))
    offered = Counter((c.ids[0], c.variant) for c in found if c.channel == "input")
    assert offered and set(offered.values()) == {1}


def test_the_boundary_layer_damps_by_the_half_derivative_of_the_rate() -> None:
    """s² + d s + b s^1.5 + ω² = 0, up to what a band that ends at three times ω leaves out."""
    model, size = systems.sloshing(), 0.3
    (layer,) = (c for c in made(model) if c.key == "boundary_layer")
    wider = layer.applied(model).with_values({"b_layer": size})
    field = VectorField(wider)
    values = np.array(list(wider.values.values()))
    by_x, _ = field.rhs_jacobians(np.zeros(1), np.zeros((1, len(wider.states))),
                                  np.zeros((1, len(wider.inputs))), values)
    found = np.linalg.eigvals(by_x[0])
    s = found[np.argmax(found.imag)]
    rate2, damping = 9.81 / wider.values["l_theta"], wider.values["d_theta"]
    left = s**2 + damping * s + size * s**1.5 + rate2
    assert abs(left) < 0.35 * size * abs(s) ** 1.5


@pytest.mark.parametrize("shift", [0.0, 5.0])
def test_the_half_derivative_of_a_line_grows_with_the_root_of_time(shift: float) -> None:
    t = np.linspace(0.0, 2.0, 41)
    found = _half_derivative(shift + t, 3.0 * t + 1.0)
    np.testing.assert_allclose(found[10:], 6.0 * np.sqrt(t[10:] / np.pi), rtol=0.015)
    assert found[-1] == pytest.approx(6.0 * np.sqrt(2.0 / np.pi), rel=0.005)


def test_no_entry_is_known_by_name_outside_the_catalogue() -> None:
    run = pk.simulate(systems.sloshing(), excitation.two_pulse())
    run = run.with_channels(replace(run["u_x"], name="u_y"))  # what could act across the axis
    known = {i for c in candidates(sites(systems.sloshing(), (run,))) for i in c.ids}
    root = Path(pk.__file__).parent
    elsewhere = [path for path in root.rglob("*.py")
                 if not path.is_relative_to(root / "mismatch" / "catalogue")
                 and not path.is_relative_to(root / "validation")]  # has effects of its own
    assert len(known) > 35 and len(elsewhere) > 100
    assert not {str(path.relative_to(root)): found for path in elsewhere
                if (found := known & words(path))}


def words(path: Path) -> set[str]:
    """The words in texts of a module, docstrings left out."""
    tree = ast.parse(path.read_text())
    told = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    texts = [node.value for node in ast.walk(tree) if isinstance(node, ast.Constant)
             and isinstance(node.value, str) and id(node) not in told]
    return {word for text in texts for word in re.findall(r"\w+", text)}


@pytest.mark.parametrize("model", [systems.sloshing(), systems.sloshing_2d()],
                         ids=lambda m: m.name)
def test_entries_name_entries_of_their_own_coordinate(model: Model) -> None:
    found = made(model)
    sited = {c.key: c.site.q for c in found}
    assert all(sited[key] == c.site.q for c in found for key in c.covers)
    keys, ids = {c.key for c in found}, {i for c in found for i in c.ids}
    named = {key for c in found for key in c.covers}
    assert named and named <= keys
    limits = {i for c in found if c.limit for i in c.limit.ids}
    assert limits and limits <= ids
    for c in found:
        own = {p.name for p in c.parameters}
        assert all(set(begun) < own for begun in c.covers.values()), c.key
        assert c.limit is None or c.limit.parameter in own, c.key


def test_forms_are_those_of_the_library() -> None:
    site = sites(systems.sloshing(), (pk.simulate(systems.sloshing(), excitation.two_pulse()),))[0]
    forms = {f.name: f for f in LIBRARY}
    formed = [c for c in candidates((site,)) if c.form]
    assert {c.argument for c in formed} == {"", "theta", "theta_dot"}
    for c in formed:
        size, *more = c.parameters
        force = c.applied(site.model).equations[site.v] - site.acceleration
        law = sp.Integer(1)
        if c.argument:
            form = forms[c.form]
            (column,), (x, *knobs) = form.columns, form.symbols
            law = column.subs({x: symbol(c.argument), **{
                k: symbol(p.name) for k, p in zip(knobs, more, strict=True)}})
        assert sp.Abs(sp.simplify(force / law)) == sp.Abs(symbol(size.name)), c.key


@pytest.mark.parametrize("identifier", [
    "coulomb_friction", "quadratic_drag", "power_drag", "stribeck_friction"])
def test_resistance_is_the_force_against_the_motion(identifier: str) -> None:
    (law,) = (c for c in made(systems.sloshing()) if c.key == identifier)
    size, *more = law.parameters
    at = {p.name: 0.7 for p in more}
    speed = np.array([0.1, 0.6, 2.3])
    assert law.resistance is not None
    force = law.applied(law.site.model).equations[law.site.v] - law.site.acceleration
    at_one = force.subs({symbol(n): v for n, v in {size.name: 1.0, **at}.items()})
    seen = [float(-at_one.subs(symbol(law.site.v), v)) for v in speed]
    np.testing.assert_allclose(law.resistance(speed, *at.values()), seen, rtol=1e-12)
    exponent = law.exponent.name if isinstance(law.exponent, pk.Parameter) else law.exponent
    assert exponent == {"coulomb_friction": 0.0, "quadratic_drag": 2.0,
                        "power_drag": "n"}.get(identifier)


@pytest.mark.parametrize("variant, sign", [("forth", 1), ("back", -1)])
def test_friction_in_one_direction_is_half_of_it_and_a_constant_force(variant: str, sign: int
                                                                      ) -> None:
    """The same law, written as a sum of entries; in one that starts at rest friction holds it."""
    by_key = {c.key: c for c in made(systems.sloshing())}
    sums = by_key[f"one_way_friction[{variant}]"].parts
    assert sums is not None
    free, held = sums([0.6])
    assert [*free] == ["coulomb_friction", "static_bias"]
    assert [*held] == ["coulomb_friction", "static_bias[held]"] and set(held) <= set(by_key)
    for parts in (free, held):
        (c,), (bias,) = parts.values()
        for v in (-1.3, 0.7):
            assert -c * np.sign(v) + bias == pytest.approx(-0.6 * (np.sign(v) + sign) / 2)


def test_a_constant_force_beside_friction_need_not_be_in_balance() -> None:
    """What starts at rest starts in balance, unless dry friction holds it where it is."""
    by_key = {c.key: c for c in made(systems.sloshing())}
    free, held = by_key["static_bias"], by_key["static_bias[held]"]
    assert held.ids == free.ids and free.suits() and not held.suits()
    assert held.suits([by_key["coulomb_friction"]])
    model = systems.sloshing()
    assert held.applied(model).state("theta").initial == 0
    assert free.applied(model).state("theta").initial != 0
    assert held.applied(model).equations == free.applied(model).equations


def test_a_constant_force_is_in_balance_when_the_recording_begins_though_parameters_drift() -> None:
    """The initial value is no formula of time; at its first instant nothing moves."""
    model = systems.sloshing()
    by_key = {c.key: c for c in made(model)}
    wider = by_key["static_bias"].applied(by_key["parameter_drift[l_theta]"].applied(model))
    values = {**wider.values, "bias": 0.02, "r_l_theta": 0.1}
    start = wider.state("theta").initial.subs({symbol(n): v for n, v in values.items()})
    assert start.is_number
    p, x = np.array([values[n] for n in wider.parameter_names]), np.array([[float(start), 0.0]])
    force = VectorField(wider).rhs(np.zeros(1), x, np.zeros((1, 2)), p)[0, 1]
    assert abs(force) < 1e-6 * abs(values["bias"])


@pytest.mark.parametrize("x, force", [(0.3, -2.0), (-0.3, 2.0), (0.1, 0.0), (-0.05, 0.0)])
def test_walls_on_both_sides_push_back_from_either(x: float, force: float) -> None:
    wall = {c.key: c for c in made(systems.sloshing())}["wall_impact[both sides]"]
    model = systems.sloshing()
    values = {**model.values, "wall": 0.1, "k_wall": 10.0}
    at = [np.zeros(1), np.array([[x, 0.0]]), np.zeros((1, len(model.input_names)))]

    def acceleration(m: Model) -> float:
        p = np.array([values[n] for n in m.parameter_names])
        return float(VectorField(m).rhs(*at, p)[0, 1])

    assert acceleration(wall.applied(model)) - acceleration(model) == pytest.approx(force)


def test_a_stiffness_of_its_own_is_an_explanation_beside_another_only() -> None:
    """Alone it is the model's stiffness, and a gain."""
    by_key = {c.key: c for c in made(systems.sloshing())}
    stiffness = by_key["linear_stiffness"]
    assert not stiffness.suits() and not stiffness.suits([by_key["coulomb_friction"]])
    assert stiffness.suits([by_key["wall_impact"]]) and not stiffness.known


def test_a_coordinate_beside_another_is_not_in_balance_by_itself() -> None:
    """A constant torque on one of two masses on a shaft moves both; liquid in two directions rests
    in either.
    """
    apart = systems.sloshing_2d()
    leaning = {c.key: c for c in made(apart)}["static_bias_theta"].applied(apart)
    assert leaning.state("theta").initial != 0
    drive = systems.two_mass_drive()
    moved = pk.Recording.from_arrays(np.arange(9.0), {"tau": np.arange(9.0)}, {"tau": "N*m"})
    found = candidates(sites(drive, (pk.simulate(drive, moved),)))
    pushed = {c.key: c for c in found}["static_bias_phi_m"].applied(drive)
    assert pushed.state("phi_m").initial == 0
    assert pushed.equations["omega_m"] == drive.equations["omega_m"] + symbol("bias_phi_m")


TWO_VALVES = {
    "name": "vessel", "states": {"p": {"unit": "bar"}, "q": {"unit": "bar"}, "T": {"unit": "K"}},
    "inputs": {"a": {"unit": "l/min"}, "b": {"unit": "V"}},
    "parameters": {"k": {"unit": "bar/l", "guess": 0.1}, "c": {"unit": "1/s", "guess": 0.3},
                   "d": {"unit": "1/(V*s)", "guess": 0.2}, "e": {"unit": "K/bar", "guess": 1.0}},
    "equations": {"p": "k*a - d*b*p - c*(p - q)", "q": "c*(p - q)", "T": "c*(e*q - T)"},
    "outputs": {"p": {"unit": "bar", "expression": "p"}, "T": {"unit": "K", "expression": "T"}},
}


def test_one_name_is_one_quantity() -> None:
    """Two effects that may be added together never share a parameter by accident."""
    model = Model.from_dict(TWO_VALVES)
    t = 0.1 * np.arange(100)
    recording = Recording({c.name: pk.Channel(c.name, t, 2 + np.sin(t), c.unit)
                           for c in [*model.outputs, *model.inputs]})
    found = [c for c in candidates(sites(model, (recording,))) if c.fits]
    dead = [c for c in found if c.ids == ("input_dead_zone",)]
    assert [p.name for c in dead for p in c.parameters] == ["u_dead_a_p", "u_dead_b_p"]
    assert ["the input a" in c.name for c in dead] == [True, False]
    assert {c.name for c in found if c.ids == ("sensor_offset",)} == {
        "an offset of the sensor of p", "an offset of the sensor of T"}
    declared: dict[str, set[str]] = {}
    for c in found:
        for p in c.parameters:
            declared.setdefault(p.name, set()).add(p.unit)
    assert {name: units for name, units in declared.items() if len(units) > 1} == {}
    stored = [c for c in found if c.ids == ("coupled_state",) and c.site.v == "T"]
    for first, second in (dead, stored):
        both = second.applied(first.applied(model))  # refused where units do not fit
        assert len(both.parameters) == len(model.parameters) + 2
    other = replace(dead[1], parameters=(replace(dead[1].parameters[0],
                                                 name=dead[0].parameters[0].name),))
    assert dead[0].suits((dead[1],)) and not dead[0].suits((other,))


WHEEL = {
    "name": "wheel", "states": {"q": {"unit": "rad"}, "v": {"unit": "rad/s"},
                                "w": {"unit": "rad/s"}},
    "inputs": {"i": {"unit": "A"}},
    "parameters": {"k": {"unit": "1/s^2", "guess": 30.0}, "b": {"unit": "1/s", "guess": 0.1},
                   "m": {"unit": "rad/(A*s^2)", "guess": 2.0}, "r": {"value": 0.03}},
    "equations": {"q": "v", "v": "-k*sin(q) - r*(m*i - b*w)", "w": "m*i - b*w"},
    "outputs": {"q": {"unit": "rad", "expression": "q"}},
}


def test_a_state_beside_a_coordinate_has_an_equation_of_its_own() -> None:
    """What resists a wheel acts back on what carries it, as the model's own resistance does."""
    model = Model.from_dict(WHEEL)
    recording = pk.simulate(model, pk.Recording.from_arrays(
        0.01 * np.arange(200), {"i": np.sin(0.1 * np.arange(200))}, units={"i": "A"}))
    found = {c.key: c for c in candidates(sites(model, (recording,)))}
    plain, along = found["coulomb_friction_w"], found["coulomb_friction_w_b"]
    assert plain.applied(model).equations["v"] == model.equations["v"]
    more = {s: along.applied(model).equations[s] - model.equations[s] for s in "vw"}
    assert sp.simplify(more["v"] + symbol("r") * more["w"]) == 0 and more["w"] != 0
    # what the model has is offered once: viscous damping where there is none
    assert "linear_drag" in found and "linear_drag_w" not in found
    assert "linear_drag" not in {c.key for c in made(systems.sloshing())}


def test_limits_are_out_of_reach_in_any_unit() -> None:
    """An encoder counts to 1e9, and an amplifier takes 1e9 V."""
    counts = Model.from_dict({
        "name": "axis", "states": {"x": {"initial": 0.0}, "v": {"unit": "1/s", "initial": 0.0}},
        "inputs": {"u": {"unit": "V"}}, "outputs": {"x": {"expression": "x"}},
        "parameters": {"k": {"unit": "1/s^2", "guess": 40.0}, "b": {"unit": "1/(V*s^2)",
                                                                   "guess": 40.0}},
        "equations": {"x": "v", "v": "b*u - k*x"}})
    t = np.arange(400) / 100
    recording = Recording.from_arrays(t, {"u": 1e9 * np.sin(3 * t), "x": 1e9 * np.sin(3 * t)},
                                      {"u": "V"})
    for c in candidates(sites(counts, (recording,))):
        assert all(p.bounds[0] <= p.value <= p.bounds[1] for p in c.parameters), c.key
        if {"sensor_saturation", "wall_impact"} & {*c.ids}:
            assert c.parameters[0].value > 1e9, c.key
        if c.fits:
            c.applied(counts)
