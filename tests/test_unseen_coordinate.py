"""Laws of a coordinate that no output shows: a link behind a flexible gear, of which only the motor
is measured.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp

import pikanid as pk
from pikanid.mismatch.catalogue.sites import sites
from pikanid.recording import Recording

STEP, SIGMA = 0.01, 3e-4
FRICTION = 1.5  # rad/s²: acceleration of the link


def joint() -> pk.Model:
    return pk.Model.from_dict({
        "name": "joint", "inputs": {"u": {"unit": "rad/s^2"}},
        "states": {"a": {"unit": "rad"}, "va": {"unit": "rad/s"},
                   "b": {"unit": "rad"}, "vb": {"unit": "rad/s"}},
        "parameters": {"k": {"unit": "1/s^2", "guess": 150.0, "bounds": [10.0, 2000.0]},
                       "m": {"guess": 1.2, "bounds": [0.1, 10.0]},
                       "c": {"unit": "1/s", "guess": 1.0, "bounds": [0.0, 20.0]},
                       "d": {"unit": "1/s", "guess": 0.5, "bounds": [0.0, 20.0]}},
        "equations": {"a": "va", "va": "u - k*(a - b) - c*va",
                      "b": "vb", "vb": "m*k*(a - b) - d*vb"},
        "outputs": {"motor": {"unit": "rad", "expression": "a"}}})


def moved(seed: int, friction: float) -> Recording:
    """k = 200 /s², m = 1.5, c = 2 /s, d = 0.4 /s; dry friction by a tanh."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, 8.0, STEP)
    u = np.repeat(rng.uniform(-40.0, 40.0, len(t) // 40 + 1), 40)[:len(t)]

    def rates(_: float, x: np.ndarray, push: float) -> list[float]:
        twist = 200.0 * (x[0] - x[2])
        return [x[1], push - twist - 2.0 * x[1], x[3],
                1.5 * twist - 0.4 * x[3] - friction * np.tanh(x[3] / 0.05)]

    x, now = np.zeros((len(t), 4)), np.zeros(4)
    for k in range(len(t) - 1):
        now = solve_ivp(rates, (0.0, STEP), now, args=(u[k],), method="LSODA", rtol=1e-8,
                        atol=1e-10).y[:, -1]
        x[k + 1] = now
    seen = x[:, 0] + SIGMA * rng.standard_normal(len(t))
    return Recording.from_arrays(t, {"u": u, "motor": seen},
                                 {"u": "rad/s^2", "motor": "rad"}, hold={"u": "zero"})


def test_a_coordinate_that_reaches_an_output_has_a_site() -> None:
    found = sites(joint(), (moved(0, 0.0),))
    assert [(s.q, s.v, s.shown) for s in found] == [("a", "va", True), ("b", "vb", False)]


def test_friction_of_an_unseen_link_is_named_there() -> None:
    dx = pk.diagnose(joint(), moved(1, FRICTION), moved(2, FRICTION), workers=1)
    assert dx.verdict in ("named", "set")
    effects = {(e.ids[0], e.equation) for h in dx.hypotheses for e in h.effects}
    assert ("coulomb_friction", "vb") in effects
    assert pk.diagnose(joint(), moved(3, 0.0), moved(4, 0.0), workers=1).verdict == "none"
