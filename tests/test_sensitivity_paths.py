"""Every path from a parameter to an output, differentiated by an independent integrator.

Two inputs with a delay each, an initial state that is a formula of parameters and inputs, gains,
a late output with a direct path from an input: generated functions run by Python, and tapes, smooth
ones and those that stop at switches.
"""

from __future__ import annotations

from collections.abc import Mapping

import interpreted
import numpy as np
import oracle
import pytest

from pikanid.model import Model
from pikanid.problem.problem import bind
from pikanid.recording import Channel, Recording
from pikanid.simulation.simulator import Simulator, Steps
from pikanid.simulation.synthetic import with_outputs
from pikanid.simulation.translated import Translated

Values = Mapping[str, float]
TRUTH = {"k": 30.0, "d": 0.8, "b": 0.7, "c": -0.4, "tau": 0.0137, "late": 0.0271, "seen": 0.0093,
         "x0": 0.12, "gain": 1.3, "path": 0.21, "mu": 0.6}
STEPS = Steps("explicit", 0.0025)


def model(friction: bool) -> Model:
    """x'' = -k sin x - d x' + b u² + c w·cos x - mu·sign(x'), both inputs late, z later still."""
    stick = " - mu*sign(v)" if friction else " - mu*tanh(v)"
    return Model.from_dict({
        "states": {"x": {"initial": "x0 + 0.1*w"}, "v": {"initial": "x0*d"}},
        "inputs": {"u": {"delay": "tau", "hold": "zero"}, "w": {"delay": "late", "hold": "first"}},
        "parameters": {n: {"guess": 1.2 * v} for n, v in TRUTH.items()},
        "equations": {"x": "v", "v": "-k*sin(x) - d*v + b*u**2 + c*w*cos(x)" + stick},
        "outputs": {"z": {"expression": "gain*x + path*w", "delay": "seen"},
                    "y": {"expression": "x*v"}}})


def recording() -> Recording:
    """Inputs on grids of their own; jumps and kinks fall between the samples of the outputs."""
    a, b = np.arange(0.0, 1.3, 0.11), np.arange(0.0, 1.4, 0.17)
    return Recording({"u": Channel("u", a, np.cos(5 * a) + (a > 0.5), hold="zero"),
                      "w": Channel("w", b, np.sin(4 * b) + 0.4, hold="first")})


TIMES = np.linspace(0.0, 1.2, 31)


def by_hand(p: Values, friction: bool) -> np.ndarray:
    """z, then y, at `TIMES`."""
    u, w = recording()["u"], recording()["w"]
    signals = [oracle.Signal(u.time, u.values, "zero", p["tau"]),
               oracle.Signal(w.time, w.values, "first", p["late"])]

    def rhs(t: float, x: np.ndarray, f: np.ndarray, s: np.ndarray) -> list[float]:
        stick = s[0] if friction else np.tanh(x[1])
        return [x[1], -p["k"] * np.sin(x[0]) - p["d"] * x[1] + p["b"] * f[0] ** 2
                + p["c"] * f[1] * np.cos(x[0]) - p["mu"] * stick]

    start = [p["x0"] + 0.1 * float(w.values[0]), p["x0"] * p["d"]]
    guards = [lambda t, x, f: x[1]] if friction else []
    seen = np.maximum(TIMES - p["seen"], 0.0)
    path = oracle.simulate(rhs, start, np.concatenate([seen, TIMES]), signals, guards, t0=0.0,
                           max_step=0.1)
    z, y = path.x[:31], path.x[31:]
    return np.concatenate([p["gain"] * z[:, 0] + p["path"] * path.u[:31, 1], y[:, 0] * y[:, 1]])


def made(kind: str, friction: bool) -> Simulator:
    own, given = model(friction), recording()
    if kind == "by Python":
        return interpreted.simulator(own, given, TIMES)
    return Translated(own, bind(own, with_outputs(own, given, TIMES)))


@pytest.fixture(scope="module", params=[False, True], ids=["smooth", "friction"])
def expected(request: pytest.FixtureRequest) -> tuple[bool, np.ndarray, dict[str, np.ndarray]]:
    """Outputs and their derivative by each parameter, by DOP853 between all switches."""
    friction = bool(request.param)
    slopes = {}
    for name, value in TRUTH.items():
        def along(h: float, name: str = name, value: float = value) -> np.ndarray:
            return by_hand({**TRUTH, name: value + h}, friction)

        # no switch moves across a sample within twice this step
        slopes[name] = oracle.derivative(along, 0.0, 2e-4 * abs(value))
    return friction, by_hand(TRUTH, friction), slopes


@pytest.mark.parametrize("kind", ["by Python", "tape"])
def test_every_path_of_every_parameter(
        kind: str, expected: tuple[bool, np.ndarray, dict[str, np.ndarray]]) -> None:
    friction, y, slopes = expected
    names, p = list(TRUTH), np.array(list(TRUTH.values()))
    simulator = made(kind, friction)
    found = simulator.run(p, np.arange(len(p)), STEPS)
    np.testing.assert_allclose(found.y, y, atol=2e-7)
    for rows in (slice(0, 31), slice(31, 62)):
        for k, name in enumerate(names):
            size = max(np.abs(slopes[name][rows]).max(), 1e-3 * np.abs(slopes[name]).max())
            off = np.abs(found.sensitivity[rows, k] - slopes[name][rows]).max() / size
            assert off < 2e-4, (name, off)
    # any choice and order of them gives the same columns
    some = np.array([names.index(n) for n in ("late", "gain", "tau", "k")])
    part = simulator.run(p, some, STEPS)
    np.testing.assert_allclose(part.sensitivity, found.sensitivity[:, some], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(part.y, found.y, rtol=0, atol=1e-13)
