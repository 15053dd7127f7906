"""Laws of the next form: which they are, where fits begin, and that a name asks about them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp
from test_verdict import BASE, A, B, answered, effect, hypothesis

import pikanid as pk
from pikanid.formula.expressions import symbol
from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.catalogue.catalogue import candidates
from pikanid.mismatch.catalogue.sites import sites
from pikanid.recording import Recording

STILL = pk.excitation.two_pulse()


@pytest.fixture(scope="module")
def by_key() -> dict[str, Candidate]:
    return {c.key: c for c in candidates(sites(pk.systems.sloshing(), (STILL,)))}


def force(law: Candidate, **at: float) -> float:
    """What a law adds to the acceleration at these values, its size 1."""
    model = pk.systems.sloshing()
    added = law.applied(model).equations["theta_dot"] - model.equations["theta_dot"]
    size = law.parameters[-1].name if law.ids[0] == "stiffening_wall" else law.parameters[0].name
    return float(added.subs({symbol(n): v for n, v in {size: 1.0, **at}.items()}))


@pytest.mark.parametrize(("entry", "near"), [
    ("coulomb_friction", {lambda q, v: -abs(q) * np.sign(v)}),
    ("quadratic_drag", {lambda q, v: -abs(q) * abs(v) * v, lambda q, v: -v**3}),
    ("amplitude_damping", {lambda q, v: -abs(q) ** 3 * v, lambda q, v: -abs(q) * v,
                           lambda q, v: -q**2 * abs(v) * v, lambda q, v: -q**2 * np.sign(v)}),
    ("cubic_stiffness", {lambda q, v: -abs(q) * q, lambda q, v: -abs(q) * q**3}),
])
def test_one_power_more_and_one_less_in_each_state(by_key: dict[str, Candidate], entry: str,
                                                   near: set) -> None:
    """And neither viscous damping nor a linear spring, which the model has."""
    found = [c for c in by_key.values() if c.next_to == entry]
    places = [(0.3, -0.9), (-0.2, 0.4), (0.5, 1.7)]
    got = sorted([round(force(c, theta=q, theta_dot=v), 9) for q, v in places] for c in found)
    assert got == sorted([round(float(law(q, v)), 9) for q, v in places] for law in near)
    assert not any(c.known for c in found)
    assert {c.ids[0][-2:] == "v0" for c in found if "dry friction" in c.families} <= {True}


def test_a_wall_may_stiffen_on_each_side(by_key: dict[str, Candidate]) -> None:
    for entry, theta, expected in (("wall_impact", 0.5, -0.04),
                                   ("wall_impact[negative side]", -0.5, 0.04),
                                   ("wall_impact[both sides]", -0.6, 0.09)):
        [law] = [c for c in by_key.values() if c.next_to == entry]
        assert force(law, theta=theta, wall=0.3) == pytest.approx(expected)
        assert force(law, theta=0.1, wall=0.3) == 0


def test_a_contact_is_brief_that_takes_less_than_a_third_of_a_half_swing(
        by_key: dict[str, Candidate]) -> None:
    """Half a period of x'' = -k x is π/√k; within a contact that brief, a wall may stiffen."""
    wall = by_key["wall_impact"]
    stiffness, swing = wall.parameters[1].name, wall.site.rate
    assert wall.brief is not None
    assert wall.brief({stiffness: 9.1 * swing**2}) and not wall.brief({stiffness: 8.9 * swing**2})
    shapes = {c.ids[0] for c in by_key.values() if c.shape_of}
    assert shapes == {"stiffening_wall"}
    assert by_key["stiffening_wall"].shape_of == wall.ids


def test_a_loop_may_be_a_spring_that_gives_way(by_key: dict[str, Candidate]) -> None:
    [law] = [c for c in by_key.values() if c.next_to == "hysteresis[bouc_wen]"]
    assert force(law, theta=0.1, z_yield=0.05) == pytest.approx(-2 / 5)
    assert force(law, theta=-0.05, z_yield=0.05) == pytest.approx(1 / 2)
    assert law.static and law.families == ("restoring force",)


@pytest.mark.parametrize(("entry", "expected"), [
    ("sensor_gain", {1.1 * 0.3 + 0.5 * 0.3**2, 1.1 * 0.3 + 0.5 * 0.3**3}),
    ("sensor_nonlinearity", {0.3 + 0.5 * 0.3**2, 0.3 + 0.5 * 0.3**4}),
    ("sensor_saturation", {0.2 * float(np.tanh(1.5))})])
def test_a_sensor_may_bend_otherwise(by_key: dict[str, Candidate], entry: str,
                                     expected: set[float]) -> None:
    seen = set()
    for law in (c for c in by_key.values() if c.next_to == entry):
        shown = law.applied(pk.systems.sloshing()).output("theta").expression
        values = {"theta": 0.3, "k_out": 1.1, "b_2": 0.5, "b_3": 0.5, "b_4": 0.5,
                  "limit_soft": 0.2}
        seen.add(round(float(shown.subs({symbol(n): v for n, v in values.items()})), 9))
        assert law.channel == "sensor" and not law.known
    assert seen == {round(v, 9) for v in expected}


def test_an_input_may_bend_beside_its_scale(by_key: dict[str, Candidate]) -> None:
    forces = set()
    for law in (c for c in by_key.values() if c.next_to == "input_gain"):
        pushed = law.applied(pk.systems.sloshing()).equations["theta_dot"]
        at = {"u_x": 2.0, "k_in": 1.1, "b_2": 0.5, "b_3": 0.5}
        plain = pk.systems.sloshing().equations["theta_dot"].subs(symbol("u_x"), symbol("pushed"))
        same = pushed.subs({symbol(n): v for n, v in at.items()})
        forces |= {total for total in (2.2 + 0.5 * 4, 2.2 + 0.5 * 8)
                   if sp.simplify(plain.subs(symbol("pushed"), total) - same) == 0}
    assert forces == {4.2, 6.2}


def test_a_wall_does_not_stand_at_the_rest(by_key: dict[str, Candidate]) -> None:
    """What is touched there is a spring that differs between the sides."""
    distance = by_key["wall_impact"].parameters[0]
    assert distance.bounds[0] == pytest.approx(0.1 * by_key["wall_impact"].site.half_range)


def test_a_memory_fades_with_one_time(by_key: dict[str, Candidate]) -> None:
    [law] = [c for c in by_key.values() if c.next_to == "boundary_layer"]
    model, v, wake = pk.systems.sloshing(), symbol("theta_dot"), symbol("wake")
    made = law.applied(model)
    added = made.equations["theta_dot"] - model.equations["theta_dot"]
    assert (added + symbol("kappa_m") * (v - wake)).expand() == 0
    assert (made.equations["wake"] * symbol("tau_m") - v + wake).expand() == 0
    assert made.state("wake").initial == 0 and not law.static


def test_a_parameter_may_settle_instead_of_drifting(by_key: dict[str, Candidate]) -> None:
    [law] = [c for c in by_key.values() if c.next_to == "parameter_drift[d_theta]"]
    model, d = pk.systems.sloshing(), symbol("d_theta")
    settled = d * (1 + symbol("a_d_theta") * sp.exp(-symbol("t") / symbol("tau_d_theta")))
    got = law.applied(model).equations["theta_dot"]
    assert sp.simplify(got - model.equations["theta_dot"].xreplace({d: settled})) == 0


def test_a_fit_of_the_next_form_begins_as_loud_as_the_law(by_key: dict[str, Candidate]) -> None:
    t = np.linspace(0.001, 6, 601)
    states = {"theta": 0.3 * np.cos(3 * t), "theta_dot": -0.9 * np.sin(3 * t)}
    q, v = states["theta"], states["theta_dot"]
    [law] = [c for c in by_key.values() if c.next_to == "coulomb_friction"]
    assert law.starts is not None
    [start] = law.starts({"c": 0.7}, states)
    assert np.mean((start["c_10"] * q * np.sign(v)) ** 2) == pytest.approx(
        np.mean((0.7 * np.sign(v)) ** 2), rel=1e-6)
    [wall] = [c for c in by_key.values() if c.next_to == "wall_impact"]
    assert wall.starts is not None
    for start in wall.starts({"wall": 0.2, "k_wall": 50.0}, states):
        depth = np.abs(q).max() - start["wall"]
        assert start["k_cable"] * depth**2 == pytest.approx(
            50.0 * (np.abs(q).max() - 0.2))


def test_a_loss_of_free_exponent_may_saturate(by_key: dict[str, Candidate]) -> None:
    """A fit of it begins as loud as the power, and as steep at the usual speed."""
    [law] = [c for c in by_key.values() if c.next_to == "power_drag"]
    assert force(law, theta_dot=-0.6, v_half=0.2) == pytest.approx(0.75)
    v = np.sin(np.linspace(0.01, 6, 601))
    usual = float(np.sqrt(np.mean(v**2)))
    assert law.starts is not None
    [start] = law.starts({"c_n": 0.7, "n": 0.5}, {"theta": v, "theta_dot": v})
    shape = np.abs(v) / (start["v_half"] + np.abs(v))
    assert np.mean((start["c_most"] * shape) ** 2) == pytest.approx(np.mean(0.49 * np.abs(v)))
    rise = start["v_half"] / (start["v_half"] + usual)  # d ln F/d ln v
    assert rise == pytest.approx(0.5)


def test_what_bends_a_spring_belongs_to_coordinates_that_have_a_place() -> None:
    """A cart that its controller holds has one, though its own equation brings it nowhere; a cart
    by itself has none, but a spring may give it one.
    """
    def springs(fed_back: str) -> set[str]:
        model = pk.Model.from_dict({
            "name": "cart", "states": {"x": {"unit": "m"}, "v": {"unit": "m/s"}},
            "parameters": {"b": {"unit": "1/s", "value": 1.0}},
            "inputs": {"u": {"unit": "m/s^2"}},
            "equations": {"x": "v", "v": f"u - b*v {fed_back}"},
            "outputs": {"x": {"unit": "m", "expression": "x"}}})
        t = np.arange(100) * 0.01
        run = Recording.from_arrays(
            t, {"u": np.sin(t), "x": np.cos(t)}, units={"u": "m/s^2", "x": "m"})
        return {c.ids[0] for c in candidates(sites(model, (run,)))} & {
            "cubic_stiffness", "amplitude_damping", "linear_stiffness", "quintic_stiffness"}

    assert springs("") == {"linear_stiffness"}
    assert springs("+ 2.0*x") == {"cubic_stiffness", "amplitude_damping", "linear_stiffness",
                                  "quintic_stiffness"}


def test_without_a_rest_friction_has_no_next_form() -> None:
    """Where a coordinate has no origin, no force is a power of it."""
    model = pk.Model.from_dict({
        "name": "cart", "states": {"x": {"unit": "m", "initial": 0.0},
                                   "v": {"unit": "m/s", "initial": 0.0}},
        "parameters": {"b": {"unit": "1/s", "value": 1.0}},
        "inputs": {"u": {"unit": "m/s^2"}},
        "equations": {"x": "v", "v": "u - b*v"},
        "outputs": {"x": {"unit": "m", "expression": "x"}}})
    t = np.arange(100) * 0.01
    run = Recording.from_arrays(t, {"u": np.sin(t), "x": np.cos(t)}, units={"u": "m/s^2", "x": "m"})
    assert not [c for c in candidates(sites(model, (run,)))
                if c.next_to and c.channel == "dynamics"
                and c.ids[0] not in ("stiffening_wall", "saturating_loss", "swinging_force",
                                     "regional_force")]


def test_the_next_form_stands_beside_several_names_that_it_explains_no_better_than() -> None:
    """It keeps them away where it explains far better; a law that is next to none of them leaves
    them unconfirmed where it explains a little better.
    """
    near = replace(effect("near", known=False), next_to="a")
    names = [BASE, hypothesis(1000.0, A), hypothesis(1001.0, B)]
    found = answered([*names, hypothesis(998.0, near)])
    assert found.verdict == "set" and len(found.given) == 3
    assert answered([*names, hypothesis(980.0, near)]).verdict == "unnamed"
    other = effect("other", known=False)
    assert answered([*names, hypothesis(998.0, other)]).verdict == "unconfirmed"


def swings(seed: int, force: Callable[[float], float]) -> Recording:
    """A damped pendulum with a further force of its angle: SciPy's DOP853, step by step."""
    rng = np.random.default_rng(seed)
    t = np.arange(0, 12, 0.01)
    u = np.repeat(rng.normal(0, 1.2, 12), 100) * np.repeat(rng.random(12) < 0.7, 100)
    length, damping, mass = 0.05, 0.3, 0.3
    theta = np.zeros(len(t))
    state = np.zeros(2)
    for k in range(len(t) - 1):
        def rhs(_: float, x: np.ndarray, push: float = u[k]) -> list[float]:
            return [x[1], -9.81 / length * np.sin(x[0]) - damping / mass * x[1]
                    - push / length * np.cos(x[0]) + force(x[0])]
        state = solve_ivp(rhs, (0, 0.01), state, "DOP853", rtol=1e-9, atol=1e-12).y[:, -1]
        theta[k + 1] = state[0]
    noisy = theta + rng.normal(0, 0.002, len(t))
    return Recording.from_arrays(t, {"u_x": u, "theta": noisy},
                                 units={"u_x": "m/s^2", "theta": "rad"})


@pytest.mark.slow
def test_a_cable_is_not_called_a_wall() -> None:
    """Its force rises with the square beyond an angle; a wall's law explains it nearly as well."""
    def cable(q: float) -> float:
        return -900.0 * max(q - 0.08, 0.0) ** 2

    answer = pk.diagnose(pk.systems.sloshing(), swings(1, cable), swings(2, cable))
    assert answer.mismatch
    given = [[e.ids for e in h.effects] for h in answer.hypotheses]
    assert answer.verdict != "named" or given != [[("wall_impact",)]]


@pytest.mark.slow
def test_a_magnet_is_not_called_friction() -> None:
    """It acts about the rest only, where a friction with a memory holds as a spring does."""
    def magnet(q: float) -> float:
        return -20.0 * (q / 0.06) / (1 + (q / 0.06) ** 2) ** 2

    answer = pk.diagnose(pk.systems.sloshing(), swings(3, magnet), swings(4, magnet))
    assert answer.mismatch and answer.verdict not in ("named", "set")
    assert {p.family for p in answer.present} <= {"restoring force"}
