"""Forces in a linkage: one in a joint moves the others, and two joints may lack the same law."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp

import pikanid as pk
from pikanid.formula.expressions import symbol
from pikanid.mismatch.catalogue.catalogue import candidates
from pikanid.mismatch.catalogue.lever import lever
from pikanid.mismatch.catalogue.sites import sites
from pikanid.mismatch.search.neighbours import beside
from pikanid.model import systems

SIGMA = 0.002


@pytest.mark.parametrize(("v", "torque"), [("v1", "tau1"), ("v2", "tau2")])
def test_a_force_in_a_joint_acts_as_the_motor_there(v: str, torque: str) -> None:
    """The column of the inverse mass matrix, by the derivatives to the motor's torque."""
    model = systems.double_pendulum()
    found = lever(model, v, ["v1", "v2"])
    assert found is not None
    _, shares = found
    by_torque = {r: model.equations[r].diff(symbol(torque)) for r in ("v1", "v2")}
    values = {symbol(n): x for n, x in model.values.items()}
    rng = np.random.default_rng(2)

    def at(e: sp.Expr, q: np.ndarray) -> float:
        return float(e.subs(values).subs({symbol("q1"): q[0], symbol("q2"): q[1]}))

    rest = at(by_torque[v], np.zeros(2))
    for q in rng.uniform(-3, 3, (5, 2)):
        for r in ("v1", "v2"):
            assert at(shares[r], q) == pytest.approx(at(by_torque[r], q) / rest, rel=1e-9)


@pytest.mark.parametrize(("name", "v", "rates"), [
    ("sloshing", "theta_dot", ("theta_dot",)),
    ("two_mass_drive", "omega_m", ("omega_m", "omega_l")),
    ("sloshing_2d", "theta_dot", ("theta_dot", "phi_dot"))])
def test_without_a_linkage_there_is_no_lever(name: str, v: str, rates: tuple[str, ...]) -> None:
    assert lever(getattr(systems, name)(), v, rates) is None


def linkage(friction: tuple[float, float], seed: int, level: float) -> pk.Recording:
    """A double pendulum with rounded dry friction in its joints by DOP853 and a mass matrix."""
    p = systems.double_pendulum().values
    t = np.arange(0.0, 8.0, 0.01)
    rng = np.random.default_rng(seed)
    rates, phases = rng.uniform(1.0, 6.0, (2, 4)), rng.uniform(0, 6, (2, 4))
    torques = level * np.sin(rates[:, :, None] * t + phases[:, :, None]).sum(axis=1)

    def rhs(now: float, x: np.ndarray, tau: np.ndarray) -> np.ndarray:
        q1, q2, v1, v2 = x
        c = p["a2"] + p["l1"] * p["g2"] * np.cos(q2)
        mass = np.array([[p["a1"] + 2 * c - p["a2"], c], [c, p["a2"]]])
        spin = p["l1"] * p["g2"] * np.sin(q2)
        force = np.array([
            tau[0] - p["b1"] * v1 - friction[0] * np.tanh(v1 / 0.01) + spin * (2 * v1 * v2 + v2**2)
            - p["g"] * (p["g1"] * np.sin(q1) + p["g2"] * np.sin(q1 + q2)),
            tau[1] - p["b2"] * v2 - friction[1] * np.tanh(v2 / 0.01) - spin * v1**2
            - p["g"] * p["g2"] * np.sin(q1 + q2)])
        return np.concatenate([[v1, v2], np.linalg.solve(mass, force)])

    x = np.zeros((len(t), 4))
    for k in range(len(t) - 1):
        x[k + 1] = solve_ivp(rhs, (t[k], t[k + 1]), x[k], "DOP853", rtol=1e-7, atol=1e-9,
                             args=(torques[:, k],)).y[:, -1]
    return pk.Recording.from_arrays(
        t, {"q1": x[:, 0] + rng.normal(0, SIGMA, len(t)), "tau1": torques[0],
            "q2": x[:, 1] + rng.normal(0, SIGMA, len(t)), "tau2": torques[1]},
        {"q1": "rad", "q2": "rad", "tau1": "N*m", "tau2": "N*m"},
        hold={"tau1": "zero", "tau2": "zero"})


def test_the_same_law_may_be_missing_in_two_coordinates() -> None:
    """Twins are alike in one coordinate only."""
    model, recording = systems.double_pendulum(), linkage((0.0, 0.0), 1, 0.2)
    entries = candidates(sites(model, (recording,)))
    own = next(c for c in entries if c.key == "coulomb_friction_q1_b1")
    h: Any = SimpleNamespace(effects=(own,), key=frozenset({own.key}), far=False)
    keys = {c.key for c in beside(h, entries)}
    assert "coulomb_friction_q2_b2" in keys and "coulomb_friction_q1" not in keys
    assert own.name == "Coulomb friction on q1 as b1 acts"


def test_forces_on_a_coordinate_act_through_the_lever_or_do_not() -> None:
    """Some of each together would be a coupling of the other equation to this coordinate."""
    model, recording = systems.double_pendulum(), linkage((0.0, 0.0), 1, 0.2)
    entries = candidates(sites(model, (recording,)))
    forces = [c for c in entries if c.pushes and c.site.v == "v1"]
    direct = next(c for c in forces if c.key == "quadratic_drag_q1")
    h: Any = SimpleNamespace(effects=(direct,), key=frozenset({direct.key}), far=False)
    keys = {c.key for c in beside(h, entries)}
    assert {"cubic_stiffness_q1", "quadratic_drag_q2_b2", "parameter_drift[b1]"} <= keys
    along = {c.key for c in forces if c.site.along}
    assert {"cubic_stiffness_q1_b1", "cubic_stiffness_q4_v0_q1_b1", "wall_impact_q1_b1"} <= along
    assert not along & keys
    walls = [c for c in forces if c.ids == ("wall_impact",)]
    assert len({c.alike for c in walls}) == 3  # one side, the other one, both


@pytest.mark.slow
def test_friction_in_both_joints_is_named_in_both() -> None:
    train, other = (linkage((0.08, 0.05), seed, 0.35) for seed in (3, 4))
    dx = pk.diagnose(systems.double_pendulum(), train, other, workers=1)
    first = {(e.ids[0], e.equation) for e in dx.hypotheses[0].effects}
    assert dx.verdict in ("named", "partial")
    assert first == {("coulomb_friction", "v1"), ("coulomb_friction", "v2")}
