"""Laws between two coordinates, on a pair of carts that SciPy simulates."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import pikanid as pk
from pikanid.formula.expressions import symbol
from pikanid.mismatch.catalogue.between import effects_between
from pikanid.mismatch.catalogue.bound_effects import bound_to, reserved
from pikanid.mismatch.catalogue.catalogue import candidates
from pikanid.mismatch.catalogue.sites import coordinates, sites
from pikanid.model import systems

SIGMA = 0.002
M, N, K, D, G = 1.0, 0.5, 60.0, 0.4, 40.0
CARTS: dict[str, Any] = {
    "name": "two carts",
    "states": {"a": {"unit": "m"}, "b": {"unit": "m"}, "v": {"unit": "m/s"}, "w": {"unit": "m/s"}},
    "inputs": {"F": {"unit": "N", "hold": "zero"}},
    "parameters": {"M": {"unit": "kg", "value": M}, "N": {"unit": "kg", "value": N},
                   "k": {"unit": "N/m", "guess": 40.0, "bounds": [1.0, 500.0]},
                   "d": {"unit": "N*s/m", "guess": 0.3, "bounds": [0.0, 10.0]},
                   "g": {"unit": "N/m", "guess": 50.0, "bounds": [1.0, 500.0]},
                   "c": {"unit": "N*s/m", "guess": 0.5, "bounds": [0.0, 10.0]}},
    "equations": {"a": "v", "b": "w", "v": "(F - g*a - c*v - k*(a - b) - d*(v - w))/M",
                  "w": "(k*(a - b) + d*(v - w))/N"},
    "outputs": {"a": {"unit": "m", "expression": "a"}, "b": {"unit": "m", "expression": "b"}},
}


LAWS = ("friction_between", "drag_between", "damping_one_way_between", "spring_between",
        "play_between", "stops_between", "stop_between:above", "stop_between:below")


def between(model: pk.Model, reach: float = 1.0) -> dict[str, pk.Effect]:
    """By key; of a stop on one side with the side."""
    motion = dict.fromkeys(model.state_names, np.linspace(-reach, reach))
    return {e.key + f":{e.variant.rsplit(',')[-1]}" * (e.key == "stop_between"): e
            for e in effects_between(model, coordinates(model), lambda: motion)}


@pytest.mark.parametrize(("key", "force"), [
    ("friction_between", lambda size, d, dv: size * np.sign(dv)),
    ("drag_between", lambda size, d, dv: size * abs(dv) * dv),
    ("spring_between", lambda size, d, dv: size * d**3),
    ("play_between", lambda size, d, dv: K * (np.sign(d) * max(abs(d) - size, 0.0) - d)),
    ("damping_one_way_between", lambda size, d, dv: size * max(dv, 0.0)),
    ("stops_between", lambda size, d, dv: size * np.sign(d) * max(abs(d) - 0.2, 0.0)),
    ("stop_between:above", lambda size, d, dv: size * max(d - 0.2, 0.0)),
    ("stop_between:below", lambda size, d, dv: size * min(d + 0.2, 0.0))])
def test_they_act_on_both_alike(key: str, force: Callable[[float, float, float], float]) -> None:
    """Against the equations of motion: a force f between the carts adds -f/M and f/N."""
    model = pk.Model.from_dict(CARTS).with_values(k=K)
    effect = between(model)[key]
    extended, rng = model.with_effect(effect), np.random.default_rng(1)
    for _ in range(5):
        x = dict(zip("abvw", rng.normal(size=4), strict=True))
        size = float(rng.uniform(0.1, 0.5))
        at = {symbol(n): v for n, v in {**model.values, **x, "F": 0.0, **{
            p.name: 0.2 for p in effect.parameters}, effect.size.name: size}.items()}
        f = force(size, x["a"] - x["b"], x["v"] - x["w"])
        for state, share in (("v", -1 / M), ("w", 1 / N)):
            more = (extended.equations[state] - model.equations[state]).subs(at)
            assert float(more) == pytest.approx(share * f)


def test_gears_are_counted() -> None:
    """A shaft behind a gear: the difference of angles is weighed with the ratio."""
    geared = pk.Model.from_dict({**CARTS, "equations": {
        "a": "v", "b": "w", "v": "(F - g*a - c*v - 3*k*(3*a - b))/M", "w": "k*(3*a - b)/N"}})
    found = between(geared)
    assert (*found,) == LAWS
    text = found["friction_between"].add["v"]
    assert "sign" in text and "w" in text and ("3*v" in text or "w/3" in text)


@pytest.mark.parametrize("name", ["sloshing", "sloshing_2d", "cart_pole", "double_pendulum"])
def test_where_nothing_acts_between_there_are_none(name: str) -> None:
    """Of a linkage `lever` says how forces in a joint act."""
    assert between(getattr(systems, name)()) == {}


def test_the_drive_has_a_shaft() -> None:
    assert (*between(systems.two_mass_drive()),) == LAWS


def carts(seed: int, force: Callable[[float, float], float]) -> pk.Recording:
    rng = np.random.default_rng(seed)
    t = np.arange(600) * 0.02
    F = np.repeat(rng.uniform(-8, 8, 25), 24)

    def rate(time: float, x: np.ndarray) -> list[float]:
        a, b, v, w = x
        between = K * (a - b) + D * (v - w) + force(a - b, v - w)
        u = F[min(int(time / 0.02 + 1e-9), len(F) - 1)]
        return [v, w, (u - G * a - 0.6 * v - between) / M, between / N]

    found = solve_ivp(rate, (0, t[-1]), np.zeros(4), "DOP853", t, rtol=1e-8, atol=1e-10,
                      max_step=0.01)
    y = found.y[:2] + SIGMA * rng.normal(size=(2, len(t)))
    return pk.Recording.from_arrays(t, {"a": y[0], "b": y[1], "F": F},
                                    units={"a": "m", "b": "m", "F": "N"})


@pytest.mark.slow
@pytest.mark.parametrize(("name", "force", "parameter", "size"), [
    ("friction_between", lambda d, dv: 0.8 * np.tanh(dv / 0.002), "F_a_b", 0.8),
    ("play_between", lambda d, dv: -K * np.clip(d, -0.01, 0.01), "gap_a_b", 0.01),
    ("stops_between", lambda d, dv: 400.0 * (d - np.clip(d, -0.03, 0.03)), "stop_a_b", 0.03),
    ("stop_between", lambda d, dv: 400.0 * min(d + 0.03, 0.0), "stop_below_a_b", 0.03),
    ("damping_one_way_between", lambda d, dv: 0.5 * max(dv, 0.0), "d_one_way_a_b", 0.5)])
def test_they_are_found(name: str, force: Callable[[float, float], float], parameter: str,
                        size: float) -> None:
    found = pk.diagnose(pk.Model.from_dict(CARTS), carts(1, force), carts(2, force))
    assert found.verdict == "named", str(found)
    (effect,) = found.hypotheses[0].effects
    assert effect.ids == (name,)
    assert effect.parameters[parameter].value == pytest.approx(size, rel=0.05)


def test_nothing_is_found_where_nothing_is() -> None:
    found = pk.diagnose(pk.Model.from_dict(CARTS), carts(3, lambda d, dv: 0.0),
                        carts(4, lambda d, dv: 0.0))
    assert found.verdict == "none", str(found)


def test_two_ways_of_one_pair_are_told_apart() -> None:
    """A damper behind a lever acts by another difference of the same two speeds."""
    equations = {"a": "v", "b": "w", "v": "(F - g*a - c*v - k*(a - b) - 2*d*(2*v - w))/M",
                 "w": "(k*(a - b) + d*(2*v - w))/N"}
    model = pk.Model.from_dict({**CARTS, "equations": equations})
    motion = dict.fromkeys(model.state_names, np.linspace(-1.0, 1.0))
    found = [*effects_between(model, coordinates(model), lambda: motion)]
    assert len({(e.key, e.variant) for e in found}) == len(found) == 11
    assert len({p.name for e in found for p in e.parameters}) == 14
    recording = carts(5, lambda d, dv: 0.0)
    own = bound_to([], sites(model, (recording,)), [recording], lambda: motion)
    assert len(candidates(reserved(sites(model, (recording,)), own), own)) > 60


def test_names_of_the_user_stay_the_users() -> None:
    table = {**CARTS, "parameters": {**CARTS["parameters"],
                                     "F_a_b": {"unit": "N", "value": 1.0}}}
    table["equations"] = {**CARTS["equations"],
                          "v": "(F + F_a_b - g*a - c*v - k*(a - b) - d*(v - w))/M"}
    model = pk.Model.from_dict(table)
    friction = between(model)["friction_between"]
    assert friction.size.name == "F_a_b_x"
    mine = replace(friction, name="mine", variant="")
    recording = carts(5, lambda d, dv: 0.0)
    own = bound_to([mine], sites(model, (recording,)), [recording],
                   lambda: dict.fromkeys(model.state_names, np.linspace(-1.0, 1.0)))
    assert [e.name for e in own if e.key == "friction_between"] == ["mine"]
    assert not {p.name for e in own if e is not mine for p in e.parameters} & {*mine.names}


def test_a_cart_that_only_rubs_on_the_other_may_rub_on_the_ground() -> None:
    recording = carts(5, lambda d, dv: 0.0)
    found = {s.v: s.resisted for s in sites(pk.Model.from_dict(CARTS), (recording,))}
    assert found == {"v": True, "w": False}
    undamped = pk.Model.from_dict(CARTS).fix(c=0.0)
    assert not sites(undamped, (recording,))[0].resisted
