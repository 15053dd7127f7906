"""Models without a coordinate: physics is looked for in the equations of their states."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import pikanid as pk
from pikanid.errors import BadModel
from pikanid.formula.expressions import TIME, symbol
from pikanid.mismatch.catalogue.catalogue import OF_QUANTITY, candidates
from pikanid.mismatch.catalogue.sites import sites
from pikanid.model.parts import Output

STILL = pk.Recording.from_arrays(np.arange(100) * 0.01, {"u": np.sin(np.arange(100))},
                                 units={"u": "V"})
Seen = Callable[[np.ndarray], np.ndarray]


def motor() -> pk.Model:
    return pk.Model.from_dict({
        "name": "motor", "states": {"w": {"unit": "rad/s", "initial": 0.0}},
        "inputs": {"u": {"unit": "V", "hold": "zero"}},
        "parameters": {"k": {"unit": "rad/(s^2*V)", "guess": 8.0, "bounds": [0.0, 100.0]},
                       "b": {"unit": "1/s", "guess": 1.5, "bounds": [0.0, 50.0]}},
        "equations": {"w": "k*u - b*w"},
        "outputs": {"w": {"unit": "rad/s", "expression": "w"}}})


def tanks(unit: str = "cm") -> pk.Model:
    return pk.Model.from_dict({
        "name": "tanks", "inputs": {"u": {"unit": "V"}},
        "states": {"x1": {"unit": unit}, "x2": {"unit": unit}},
        "parameters": {"k": {"unit": f"({unit})/(s*V)", "value": 1.0},
                       "a": {"unit": "1/s", "guess": 0.1, "bounds": [0.001, 10.0]},
                       "b": {"unit": "1/s", "guess": 0.1, "bounds": [0.001, 10.0]}},
        "equations": {"x1": "k*u - a*x1", "x2": "a*x1 - b*x2"},
        "outputs": {"y": {"unit": unit, "expression": "x2"}}})


def test_every_state_that_reaches_an_output_is_a_site() -> None:
    [one] = sites(motor(), (STILL,))
    assert (one.q, one.v, one.moving, one.inputs, one.suffix) == ("", "w", ("w",), ("u",), "")
    assert (one.speed_unit, one.force_unit, one.rate) == ("rad/s", "rad/s^2", 0.0)
    seen, behind = sites(tanks(), (STILL,))
    assert (seen.v, seen.inputs, seen.suffix) == ("x2", (), "_x2")
    assert (behind.v, behind.inputs, behind.output.name) == ("x1", ("u",), "y")


def test_a_late_input_is_a_late_output_only_out_of_rest() -> None:
    """What moves at first has been moved by an input whose delay no output would show."""
    pushed = pk.Recording.from_arrays(np.arange(100) * 0.01, {"u": np.cos(np.arange(100))},
                                      units={"u": "V"})
    for recorded, still in (((STILL,), True), ((pushed,), False), ((STILL, pushed), False)):
        [one] = sites(motor(), recorded)
        assert one.still == still
        late = {c.ids for c in candidates((one,)) if c.twin == "delay" and not c.beside}
        assert late == ({("input_delay", "sensor_delay")} if still
                        else {("sensor_delay",), ("input_delay",)})
    free = motor().replace(states=(replace(motor().states[0], initial=symbol("b")),))
    assert not sites(free, (STILL,))[0].still


def test_what_nothing_shows_is_refused() -> None:
    clock = motor().replace(outputs=(Output("clock", TIME, "s"),))
    with pytest.raises(BadModel, match="no state that reaches an output"):
        sites(clock, (STILL,))


def test_nothing_that_needs_a_position_is_looked_for() -> None:
    found = {i for c in candidates(sites(motor(), (STILL,))) for i in c.ids}
    assert not found & {"cubic_stiffness", "wall_impact", "second_mode", "boundary_layer",
                        "amplitude_damping"}
    assert {"coulomb_friction", "quadratic_drag", "input_dead_zone", "sensor_lag", "static_bias",
            "parameter_drift", "initial_state"} <= found
    # the sensor is one, whatever states lie before it
    keys = [c.key for c in candidates(sites(tanks(), (STILL,)))]
    assert sum(k.startswith("sensor_drift") for k in keys) == 1
    assert {"quadratic_drag_x1", "quadratic_drag_x2"} <= set(keys)


def driven(seed: int, rate: Callable[[float, float], float], seen: Seen = np.asarray
           ) -> pk.Recording:
    """A motor in steps of voltage: SciPy's DOP853 from one to the next."""
    rng = np.random.default_rng(seed)
    n, h = 1000, 0.01
    u = np.repeat(rng.uniform(-6, 6, n // 40), 40)
    w = np.zeros(n)
    for k in range(n - 1):
        w[k + 1] = solve_ivp(lambda t, x, push=u[k]: [rate(x[0], push)], (0, h), [w[k]], "DOP853",
                             rtol=1e-8, atol=1e-10, max_step=h / 2).y[0, -1]
    return pk.Recording.from_arrays(
        np.arange(n) * h, {"u": u, "w": seen(w) + rng.normal(0, 0.1, n)},
        units={"u": "V", "w": "rad/s"})


@pytest.mark.slow
@pytest.mark.parametrize(("rate", "ids"), [
    (lambda w, u: 10 * u - 2 * w, None),
    (lambda w, u: 10 * u - 2 * w - 8 * np.tanh(w / 0.01), "coulomb_friction"),
    (lambda w, u: 10 * u - 2 * w - 0.15 * abs(w) * w, "quadratic_drag"),
    (lambda w, u: 10 * max(u, -3.5) - 2 * w, "input_saturation"),
    (lambda w, u: 10 * np.sign(u) * max(abs(u) - 0.8, 0.0) - 2 * w, "input_dead_zone")])
def test_a_motor_whose_speed_is_measured(rate: Callable[[float, float], float], ids: str | None
                                         ) -> None:
    answer = pk.diagnose(motor(), driven(1, rate), driven(2, rate))
    assert answer.mismatch is (ids is not None)
    if ids is not None:
        assert answer.verdict == "named" and [
            e.ids[0] for h in answer.hypotheses for e in h.effects] == [ids]


@pytest.mark.slow
@pytest.mark.parametrize(("seen", "law"), [
    (lambda w: np.minimum(w, 14.0), "min(w, limit)"),
    (lambda w: np.maximum(w, -14.0), "max(w, -limit)"),
    (lambda w: np.clip(w, -14.0, 14.0), "clip(w, -limit, limit)")])
def test_a_sensor_whose_range_ends_on_one_side(seen: Seen, law: str) -> None:
    train, other = (driven(seed, lambda w, u: 10 * u - 2 * w, seen) for seed in (1, 2))
    answer = pk.diagnose(motor(), train, other)
    (found,) = [e for h in answer.hypotheses for e in h.effects]
    assert answer.verdict == "named" and found.ids == ("sensor_saturation",)
    assert found.expression == law
    (limit,) = found.parameters.values()
    assert abs(limit.value - 14.0) < 4 * limit.std < 0.5


def run_tanks(seed: int, more: Callable[[np.ndarray], np.ndarray]) -> pk.Recording:
    """Of `tanks`, a = 0.1 and b = 0.08, with `more` [cm/s] in the equations."""
    rng = np.random.default_rng(seed)
    n, h = 1000, 1.0
    u, x = np.repeat(rng.uniform(0.2, 1.0, n // 50), 50), np.zeros((n, 2))
    for k in range(n - 1):
        def rates(t: float, y: np.ndarray, push: float = u[k]) -> np.ndarray:
            return np.array([push - 0.1 * y[0], 0.1 * y[0] - 0.08 * y[1]]) + more(y)
        x[k + 1] = solve_ivp(rates, (0, h), x[k], "DOP853", rtol=1e-8, atol=1e-10).y[:, -1]
    return pk.Recording.from_arrays(np.arange(n) * h, {"u": u, "y": x[:, 1] + rng.normal(
        0, 0.03, n)}, units={"u": "V", "y": "cm"})


@pytest.mark.slow
def test_a_leak_of_the_tank_that_is_not_seen_is_found_there() -> None:
    train, other = (run_tanks(seed, lambda y: np.array([-0.01 * y[0] ** 2, 0.0]))
                    for seed in (1, 2))
    answer = pk.diagnose(tanks(), train, other)
    assert answer.verdict in ("named", "set") and answer.where.equation == "x1"
    assert any("quadratic_drag" in e.ids for h in answer.hypotheses for e in h.effects)


def test_what_flows_back_into_a_linear_tank_is_a_coupling_or_a_gain() -> None:
    """Their transfer function tells poles and a gain: one number more than the model has."""
    train, other = (run_tanks(seed, lambda y: np.array([0.02 * y[1], 0.0])) for seed in (1, 2))
    answer = pk.diagnose(tanks(), train, other)
    found = {(e.ids, e.equation): e for h in answer.hypotheses for e in h.effects}
    assert answer.verdict == "set" and {i for ids, _ in found for i in ids} == {
        "coupled_state", "input_gain", "sensor_gain"}
    (k,) = found[("coupled_state",), "x1"].parameters.values()
    assert abs(k.value - 0.02) < 4 * k.std < 0.005


def test_no_law_is_looked_for_that_units_forbid() -> None:
    """In degC a temperature has no square and no sign; in K it has both."""
    def offered(unit: str) -> set[str]:
        room = pk.Model.from_dict({
            "name": "room", "states": {"T": {"unit": unit, "initial": 20.0}},
            "inputs": {"T_a": {"unit": unit}},
            "parameters": {"a": {"unit": "1/s", "guess": 1e-3, "bounds": [0.0, 1.0]}},
            "equations": {"T": "a*(T_a - T)"},
            "outputs": {"T": {"unit": unit, "expression": "T"}}})
        t = np.arange(100) * 10.0
        run = pk.Recording.from_arrays(t, {"T_a": 5 + np.sin(t)}, units={"T_a": unit})
        found = candidates(sites(room, (run,)))
        for c in found:
            c.applied(room)
        return {c.ids[0] for c in found}

    forbidden = offered("K") - offered("degC")
    assert {"coulomb_friction", "quadratic_drag", "stribeck_friction"} <= forbidden
    assert {"static_bias", "sensor_offset", "parameter_drift"} <= offered("degC")


def test_a_parameter_drifts_in_every_equation_that_it_stands_in() -> None:
    motor = pk.systems.dc_motor()
    t = np.arange(200) * 0.01
    recording = pk.Recording.from_arrays(
        t, {"u": np.where(t > 0.2, 1.0, 0.0), "omega": np.sin(t)}, {"u": "V", "omega": "rad/s"})
    drifts = [c for c in candidates(sites(motor, (recording,))) if c.ids == ("parameter_drift",)]
    assert sorted(c.variant for c in drifts) == ["J", "b", "k"]
    k = next(c for c in drifts if c.variant == "k")
    extended = k.applied(motor)
    for state in ("i", "omega"):
        assert extended.equations[state].has(symbol(k.parameters[0].name))


@pytest.mark.slow
@pytest.mark.parametrize("course", ["exp(-((t - 1.5)/0.11)**2)",
                                    "exp(-max(t - 1.5, 0)/0.15 - max(1.5 - t, 0)/0.02)"])
def test_what_happens_once_may_take_any_course(course: str) -> None:
    """A raised cosine leaves 10 sigma of such a Gaussian, two of them fit and are none."""
    motor = pk.systems.dc_motor()
    truth = motor.with_term("omega", f"A*{course}", [pk.Parameter("A", 6000.0, "rad/s^2")])

    def run(model: pk.Model, seed: int) -> pk.Recording:
        u = np.repeat(np.random.default_rng(seed).uniform(-6.0, 6.0, 32), 25)
        drive = pk.Recording.from_arrays(0.005 * np.arange(800), {"u": u}, {"u": "V"})
        return pk.simulate(model, drive, sigma=2.0, seed=seed)

    dx = pk.diagnose(motor, run(truth, 1), run(motor, 2), workers=1)
    assert dx.verdict in ("named", "set")
    assert all(("disturbance",) in [e.ids for e in h.effects] for h in dx.hypotheses)
    # that there is something else besides is a possibility at most
    assert sum(h.probability or 0.0 for h in dx.hypotheses if len(h.effects) == 1) > 0.95


@pytest.mark.slow
def test_a_motor_that_its_voltage_reaches_late() -> None:
    """It turns from the first instant on, as no sensor that is late would show."""
    def recorded(seed: int) -> pk.Recording:
        rng = np.random.default_rng(seed)
        t, tau = np.arange(801) * 0.01, 0.034
        u = np.repeat(rng.uniform(2.0, 6.0, 41), 20)[:801]

        def rate(s: float, w: np.ndarray) -> np.ndarray:
            return 8.0 * u[max(int(np.floor((s - tau) / 0.01 + 1e-9)), 0)] - 1.5 * w

        switches = np.unique(np.round(np.r_[0.0, t + tau, 8.0], 9))
        switches = switches[switches <= 8.0]
        seen, at = np.zeros(len(t)), np.zeros(1)
        for a, b in pairwise(switches):
            inside = (t > a + 1e-9) & (t <= b + 1e-9)
            found = solve_ivp(lambda s, w, a=a: rate(a + 1e-6, w), (a, b), at, "DOP853",
                              dense_output=True, rtol=1e-9, atol=1e-9)
            seen[inside], at = found.sol(t[inside])[0], found.y[:, -1]
        noisy = seen + rng.normal(0, 0.2, len(t))
        return pk.Recording.from_arrays(t, {"u": u, "w": noisy}, {"u": "V", "w": "rad/s"})

    dx = pk.diagnose(motor(), recorded(1), recorded(2))
    [best] = dx.hypotheses
    assert dx.verdict == "named" and dx.where.channel == "input"
    assert [e.ids for e in best.effects] == [("input_delay",)]
    tau = next(iter(best.effects[0].parameters.values()))
    assert tau.value == pytest.approx(0.034, abs=5 * tau.std)


def test_what_is_no_speed_is_lost_and_has_no_friction() -> None:
    made = {unit: {c.name for c in candidates(sites(tanks(unit), (STILL,)))}
            for unit in ("cm", "rad/s")}
    said = {unit: {name for name in names if "friction" in name or "drag" in name}
            for unit, names in made.items()}
    assert said["rad/s"] and not said["cm"]
    assert {"a constant loss of x1", "a quadratic loss of x2", "a power-law loss of x1",
            "a source local in time"} <= made["cm"] - made["rad/s"]
    # every name that is changed is one that an entry has: what has no resistance is offered one
    free = motor().replace(parameters=tuple(
        replace(p, value=0.0, free=False) if p.name == "b" else p for p in motor().parameters))
    every = made["rad/s"] | {c.name for c in candidates(sites(free, (STILL,)))}
    assert {n for n in OF_QUANTITY if not any(n in name for name in every)} == set()
