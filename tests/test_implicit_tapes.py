"""The implicit integrator of tapes: against the explicit one, generated code and SciPy's Radau."""

from __future__ import annotations

import interpreted
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from test_native_tape import CORNERED, DURATION, SMOOTH, model_of, run, simulator_of
from test_translated import recorded, values

from pikanid.model import Model
from pikanid.problem.problem import bind
from pikanid.recording import Recording
from pikanid.simulation.simulator import Steps
from pikanid.simulation.translated import Translated

pytestmark = pytest.mark.compiled

IMPLICIT = Steps("implicit", 0.01)
FINE = Steps("explicit", 0.0005)


@pytest.mark.parametrize("term", [*SMOOTH][:2])
def test_it_gives_the_numbers_of_generated_code(term: str) -> None:
    fast = run(simulator_of(term), steps=IMPLICIT)
    slow = run(interpreted.simulator(model_of(term), recorded(model_of(term), DURATION)),
               steps=IMPLICIT)
    size = np.abs(slow.sensitivity).max(axis=0)
    np.testing.assert_allclose(fast.y, slow.y, rtol=0, atol=1e-13)
    np.testing.assert_allclose(fast.sensitivity / size, slow.sensitivity / size, rtol=0, atol=1e-11)


@pytest.mark.parametrize("term", [*CORNERED, *SMOOTH])
def test_it_converges_to_what_the_explicit_one_does(term: str) -> None:
    simulator = simulator_of(term, located=True)
    exact = run(simulator, steps=FINE)
    size = np.abs(exact.sensitivity).max(axis=0)
    gaps, slopes = [], []
    for h in (0.01, 0.0025):
        found = run(simulator, steps=Steps("implicit", h))
        gaps.append(np.abs(found.y - exact.y).max())
        slopes.append(np.abs((found.sensitivity - exact.sensitivity) / size).max())
    order = 2.5 if "signed_power" in term else 3.5  # |v|^1.5 has no second derivative at rest
    assert gaps[1] < gaps[0] / 4**order and gaps[0] < 3e-4
    assert slopes[1] < slopes[0] / 4**(order - 1) and slopes[0] < 2e-2
    assert np.array_equal(run(simulator, 0, IMPLICIT).y, run(simulator, steps=IMPLICIT).y)


def belt() -> tuple[Model, Recording]:
    """Two coupled blocks on a belt: both stick for a while, together too, and are torn loose."""
    model = Model.from_dict({
        "name": "belt", "states": {"x": {}, "v": {}, "y": {}, "w": {}},
        "inputs": {"u": {"hold": "zero"}},
        "parameters": {"k": {"guess": 3.0}, "c": {"guess": 1.1}, "d": {"guess": 0.9},
                       "b": {"guess": 0.2}},
        "equations": {"x": "v", "v": "k*(y - 2*x) - c*sign(v - b) + u",
                      "y": "w", "w": "k*(x - 2*y) - d*sign(w - b - 0.1*v)"},
        "outputs": {"x": {"expression": "x"}, "y": {"expression": "y"}}})
    t = np.linspace(0, 6.0, 301)
    u = np.where(t < 2.0, 0.0, np.where(t < 3.0, 2.5, -1.0))
    return model, Recording.from_arrays(t, {"u": u, "x": t, "y": t}, hold={"u": "zero"})


def test_signs_that_are_held_move_with_states_and_parameters() -> None:
    model, recording = belt()
    simulator, p = Translated(model, bind(model, recording)), values(model)
    every = np.arange(len(p))
    exact = simulator.run(p, every, FINE, states=True)
    v, w = exact.states[:, 1], exact.states[:, 3]
    stuck, other = np.abs(v - p[3]) < 1e-9, np.abs(w - p[3] - 0.1 * v) < 1e-9
    assert (stuck & other).any() and (stuck & ~other).any() and (~stuck & ~other).any()
    found = simulator.run(p, every, Steps("implicit", 0.005))
    np.testing.assert_allclose(found.y, exact.y, rtol=0, atol=1e-7)
    np.testing.assert_allclose(found.sensitivity, exact.sensitivity, rtol=0, atol=1e-4)


def motor(fast: float) -> tuple[Model, Recording, np.ndarray]:
    """A motor whose current settles `fast` times within a sample, with its voltage (N,)."""
    model = Model.from_dict({
        "name": "motor", "states": {"i": {}, "w": {}}, "inputs": {"u": {"hold": "zero"}},
        "parameters": {"R": {"guess": 1.3}, "L": {"value": 1.3 * 0.05 / fast},
                       "k": {"guess": 0.06}, "J": {"guess": 3e-4}, "b": {"guess": 2e-5}},
        "equations": {"i": "(u - R*i - k*w)/L", "w": "(k*i - b*w*abs(w))/J"},
        "outputs": {"w": {"expression": "w"}}})
    t = 0.05 * np.arange(81)
    u = np.repeat(np.random.default_rng(4).uniform(-12, 12, 9), 10)[:81]
    return model, Recording.from_arrays(t, {"u": u, "w": t}, hold={"u": "zero"}), u


@pytest.mark.parametrize("fast", [300.0, 1e6])
def test_stiff_states_are_followed(fast: float) -> None:
    model, recording, u = motor(fast)
    simulator, p = Translated(model, bind(model, recording)), values(model)
    R, L, k, J, b = p
    x, wanted = np.zeros(2), [0.0]
    for n in range(80):
        def f(_: float, x: np.ndarray, n: int = n) -> list[float]:
            return [(u[n] - R * x[0] - k * x[1]) / L, (k * x[0] - b * x[1] * abs(x[1])) / J]
        x = solve_ivp(f, (0, 0.05), x, "Radau", rtol=1e-9, atol=1e-10).y[:, -1]
        wanted.append(x[1])
    size = np.abs(wanted).max()
    assert not simulator.run(p, steps=Steps("explicit", 0.05 / 64)).finished
    found = simulator.run(p, np.array([0, 2, 3, 4]), Steps("implicit", 0.05 / 8))
    np.testing.assert_allclose(found.y, wanted, rtol=0, atol=2e-5 * size)
    for column, q in zip(found.sensitivity.T, (0, 2, 3, 4), strict=True):
        moved = p.copy()
        moved[q] *= 1 + 1e-6
        ahead = simulator.run(moved, steps=Steps("implicit", 0.05 / 8)).y
        slope = (ahead - found.y) / 1e-6
        np.testing.assert_allclose(column * p[q], slope, rtol=0, atol=1e-4 * size)


def test_what_grows_beyond_all_numbers_is_said() -> None:
    model = Model.from_dict({
        "name": "burst", "states": {"x": {"initial": "x0"}}, "parameters": {"x0": {"guess": 1.0}},
        "equations": {"x": "x**2"}, "outputs": {"x": {"expression": "x"}}})
    t = np.linspace(0, 2.0, 41)
    simulator = Translated(model, bind(model, Recording.from_arrays(t, {"x": t})))
    found = simulator.run(np.array([1.0]), np.array([0]), IMPLICIT)
    assert not found.finished and 0.9 < found.stopped_at < 1.1
