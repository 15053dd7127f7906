"""A stop of constant restitution, which a wall of springs must not be called."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import pikanid as pk
from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.catalogue.catalogue import candidates
from pikanid.mismatch.catalogue.sites import sites
from pikanid.recording import excitation

LENGTH, DAMPING, MASS, GRAVITY = 0.05, 0.3, 0.3, 9.81
SIGMA = 0.1 * np.pi / 180
NOMINAL = pk.systems.sloshing()


def bounced(seed: int, restitution: float, at: float) -> pk.Recording:
    """The rig with a stop at an angle [rad], by SciPy from one impact to the next."""
    moves = excitation.planar_moves(4, 8.0, seed=seed)
    drive = moves["u_x"]
    x, angles = np.zeros(2), [0.0]

    def rates(u: float, _: float, x: np.ndarray) -> list[float]:
        c, s = np.cos(x[0]), np.sin(x[0])
        return [x[1], (u * c - GRAVITY * s) / LENGTH - DAMPING / MASS * x[1] * c**2]

    def touches(_: float, x: np.ndarray) -> float:
        return float(at - x[0])

    event: Any = touches
    event.terminal, event.direction = True, -1
    for k, u in enumerate(drive.values[:-1]):
        now, end = drive.time[k], drive.time[k + 1]
        while now < end - 1e-12:
            found = solve_ivp(partial(rates, float(u)), (now, end), x, events=event,
                              rtol=1e-9, atol=1e-11)
            now, x = found.t[-1], found.y[:, -1].copy()
            if found.status == 1:
                x = np.array([at - 1e-12, -restitution * x[1]])
        angles.append(x[0])
    noise = SIGMA * np.random.default_rng(seed).normal(size=len(angles))
    theta = pk.Channel("theta", drive.time, np.array(angles) + noise, "rad")
    return pk.Recording({**moves.channels, "theta": theta})


def entry(key: str) -> Candidate:
    recording = pk.simulate(NOMINAL, excitation.planar_moves(4, 8.0, seed=3), sigma=SIGMA, seed=3)
    return next(c for c in candidates(sites(NOMINAL, (recording,))) if c.key == key)


@pytest.mark.parametrize("lost, side", [(0.75, 1.0), (0.36, -1.0)])
def test_a_stop_returns_what_it_does_not_take(lost: float, side: float) -> None:
    """(1 - lost)^½ of the speed, however fast it is hit: energies before and after the impact."""
    stop = entry("rigid_stop" if side > 0 else "rigid_stop[negative side]")
    place, share = (p.name for p in stop.parameters)
    model = stop.applied(NOMINAL).with_values(
        {"d_theta": 0.0, "l_theta": LENGTH, place: 0.1, share: lost})
    t = np.linspace(0.0, 0.3, 3001)
    rest = pk.Recording.from_arrays(t, {"u_x": 0 * t}, {"u_x": "m/s^2"})
    for speed in (3.0, 6.0):
        begun = model.with_initial(theta=0.0, theta_dot=side * speed)
        q = side * pk.simulate(begun, rest)["theta"].values
        hit = int(np.argmax(q))
        after = -np.gradient(q, t)[hit + 60]
        gained = 2 * GRAVITY / LENGTH * (1 - np.cos(0.1))
        fallen = 2 * GRAVITY / LENGTH * (np.cos(q[hit + 60]) - np.cos(0.1))
        before = speed**2 - gained
        assert after**2 - fallen == pytest.approx((1 - lost) * before, rel=0.05)


@pytest.mark.slow
def test_a_rigid_stop_is_not_called_a_wall_of_springs() -> None:
    found = pk.diagnose(NOMINAL, bounced(3, 0.6, 0.235), bounced(4, 0.6, 0.235))
    assert found.verdict in ("named", "set", "partial")
    assert any("rigid stop" in e.name for e in found.hypotheses[0].effects)
    assert all("wall_impact" not in p.ids for p in found.present)
