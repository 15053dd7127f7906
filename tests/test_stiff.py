"""The implicit route: accuracy, order, stability, sensitivities, and when it is chosen."""

from __future__ import annotations

import interpreted
import numpy as np
import oracle
import pytest
from scipy.integrate import solve_ivp

from pikanid import errors
from pikanid.model import Model, systems
from pikanid.recording import Recording, excitation
from pikanid.simulation import Steps

pytestmark = pytest.mark.compiled

T = np.linspace(0, 1, 21)
FAST = Model.from_dict({
    "states": {"x": {"initial": 1.0}, "y": {"initial": 0.0}}, "inputs": {"u": {}},
    "parameters": {"k": {"guess": 1e5}, "c": {"guess": 2.0}},
    "equations": {"x": "-k*(x - cos(3*t) - u*y)", "y": "x - c*y"},
    "outputs": {"x": {"expression": "x"}, "y": {"expression": "y"}}})
PULSE = Recording.from_arrays(T, {"u": np.where((T > 0.3) & (T < 0.6), 1.0, 0.0)},
                              hold={"u": "zero"})
ROBERTSON = Model.from_dict({
    "states": {"a": {"initial": 1.0}, "b": {}, "c": {}},
    "parameters": {"k1": {"guess": 0.04}, "k2": {"guess": 3e7}, "k3": {"guess": 1e4}},
    "equations": {"a": "-k1*a + k3*b*c", "b": "k1*a - k3*b*c - k2*b**2", "c": "k2*b**2"},
    "outputs": {n: {"expression": n} for n in "abc"}})


def radau(p: np.ndarray) -> np.ndarray:
    """Piece by piece over the pulse, so that no jump is inside a step."""
    edges, x, rows = T[1:][np.diff(PULSE["u"].values) != 0], np.array([1.0, 0.0]), []
    for a, b in zip([0.0, *edges], [*edges, 1.0], strict=True):
        u = PULSE["u"].values[np.searchsorted(T, 0.5 * (a + b)) - 1]
        wanted = T[(a <= T) & (b > T)]
        solution = solve_ivp(
            lambda t, y, u=u: [-p[0] * (y[0] - np.cos(3 * t) - u * y[1]), y[0] - p[1] * y[1]],
            (a, b), x, "Radau", t_eval=np.append(wanted, b), rtol=1e-10, atol=1e-12)
        rows.append(solution.y[:, :len(wanted)].T)
        x = solution.y[:, -1]
    return np.concatenate([*rows, x[None]]).T.ravel()


def test_stiff_model_agrees_with_radau_and_switches_exactly() -> None:
    made = interpreted.simulator(FAST, PULSE)
    p = np.array([1e5, 2.0])
    steps = made.choose_steps(p, 1e-7, "implicit")
    assert steps.longest > 1e-3  # an explicit step is stable below 2.8e-5
    response = made.run(p, np.arange(2), steps)
    assert np.abs(response.y - radau(p)).max() < 1e-6
    for k, scale in enumerate(p):
        expected = oracle.derivative(
            lambda h, k=k, scale=scale: radau(p + h * scale * np.eye(2)[k]), 0.0, 1e-2) / scale
        error = np.abs(response.sensitivity[:, k] - expected).max()
        # the stiff rate moves x by 1e-9 only: there the reference ends
        assert error < (5e-3 if k == 0 else 1e-4) * np.abs(expected).max()


def test_what_is_fast_but_not_stiff_stays_explicit_however_short_the_steps() -> None:
    model = Model.from_dict({
        "name": "fast", "states": {"x": {"initial": 1.0}, "v": {"initial": 0.0}},
        "parameters": {"w": {"guess": 8.0, "bounds": [1.0, 100.0]}},
        "equations": {"x": "v", "v": "-w**2*x"}, "outputs": {"y": {"expression": "x"}}})
    t = np.arange(40.0)  # more than a period from sample to sample
    made = interpreted.simulator(model, Recording.from_arrays(t, {"y": t}))
    steps = made.choose_steps(np.array([8.0]), 1e-8)
    assert steps.method == "explicit" and 1 / 4096 < steps.longest < 1 / 64
    found = made.run(np.array([8.0]), None, steps)
    assert np.abs(found.y - np.cos(8 * t)).max() < 2e-8


def test_order_four() -> None:
    """Prothero and Robinson's problem at moderate stiffness: each halving takes about 1/16."""
    made = interpreted.simulator(FAST, PULSE)
    p = np.array([30.0, 2.0])
    fine = made.run(p, None, Steps("explicit", 1e-3)).y
    errors_ = [np.abs(made.run(p, None, Steps("implicit", h)).y - fine).max()
               for h in (0.025, 0.0125, 0.00625)]
    orders = np.log2(np.array(errors_[:-1]) / errors_[1:])
    assert np.all((orders > 3.5) & (orders < 4.6))


@pytest.mark.slow
def test_chemical_kinetics_conserve_mass() -> None:
    """Robertson's reaction, nine decades of time scales; reference values: Hairer & Wanner II."""
    t = np.array([0.0, 0.4, 4.0])
    made = interpreted.simulator(ROBERTSON, Recording.from_arrays(t, {"unused": t}), t)
    p = np.array([0.04, 3e7, 1e4])
    response = made.run(p, np.arange(3), made.choose_steps(p, 1e-6, "implicit"), states=True)
    np.testing.assert_allclose(response.y[:3], [1, 0.98517, 0.90552], atol=1e-5)
    np.testing.assert_allclose(response.states.sum(axis=1), 1, atol=1e-12)
    total = response.sensitivity.reshape(3, 3, 3).sum(axis=0)
    np.testing.assert_allclose(total / np.abs(response.sensitivity).max(axis=0), 0, atol=1e-10)


def test_automatic_choice_takes_the_implicit_route_only_where_it_is_stiff() -> None:
    stiff = interpreted.simulator(FAST, PULSE)
    assert stiff.choose_steps(np.array([1e5, 2.0]), 1e-5).method == "implicit"
    mild = interpreted.simulator(systems.sloshing(), excitation.two_pulse(0.6, 0.02))
    assert mild.choose_steps(np.array([0.045, 0.15, 0.3, 9.81]), 1e-7).method == "explicit"


def test_both_routes_agree_on_the_pendulum() -> None:
    made = interpreted.simulator(systems.sloshing(), excitation.two_pulse(1.0, 0.02))
    p = np.array([0.045, 0.15, 0.3, 9.81])
    a = made.run(p, np.arange(4), Steps("explicit", 0.0025))
    b = made.run(p, np.arange(4), Steps("implicit", 0.005))
    np.testing.assert_allclose(a.y, b.y, atol=1e-6)
    np.testing.assert_allclose(a.sensitivity, b.sensitivity,
                               atol=2e-5 * np.abs(a.sensitivity).max())


def test_explicit_route_on_a_stiff_model_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pikanid.simulation.simulator.FINEST", 16)
    made = interpreted.simulator(FAST, PULSE)
    with pytest.raises(errors.SimulationFailed, match="finite numbers"):
        made.choose_steps(np.array([1e5, 2.0]), 1e-5, "explicit")
