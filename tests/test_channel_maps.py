"""Maps of inputs and outputs, simulated, against references written out by hand."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import interpreted
import numpy as np
import oracle
import pytest
from comparing import SIGMA, compare

from pikanid import errors
from pikanid.model import Model, Parameter, systems
from pikanid.recording import Recording, excitation
from pikanid.simulation import Steps

Values = Mapping[str, float]
T = excitation.grid(1.5, 0.02)
WAVE = 0.6 * np.sin(4 * T) + 0.3 * np.sin(9 * T)
RECORDING = Recording.from_arrays(T, {"u_x": WAVE}, hold={"u_x": "first"})


def swing(p: Values, x: np.ndarray, force: float) -> list[float]:
    length = p["l_theta"]
    return [x[1], force / length * np.cos(x[0]) - p["g"] / length * np.sin(x[0])
            - p["d_theta"] / p["m"] * x[1] * np.cos(x[0]) ** 2]


def mapped(p: Values, force: Callable[[float], float] = float,
           guards: list[oracle.Guard] | None = None) -> np.ndarray:
    signal = oracle.Signal(T, WAVE, "first")
    return oracle.simulate(lambda t, x, u, s: swing(p, x, force(u[0])), [0, 0], T, [signal],
                           guards or ()).x[:, 0]


def at(level: Callable[[float], float]) -> oracle.Guard:
    return lambda t, x, u: level(u[0])


def free(**values: float) -> list[Parameter]:
    return [Parameter(n, v) for n, v in values.items()]


INPUT = {
    "gain": (dict(parameters=free(k=1.3), gain="k"), lambda p: mapped(p, lambda u: p["k"] * u)),
    "offset": (dict(parameters=free(b=0.2), offset="b"), lambda p: mapped(p, lambda u: u + p["b"])),
    "saturation": (
        dict(parameters=free(level=0.45), saturation="level"),
        lambda p: mapped(p, lambda u: float(np.clip(u, -p["level"], p["level"])),
                         [at(lambda u: u - p["level"]), at(lambda u: u + p["level"])])),
    "dead zone": (
        dict(parameters=free(w=0.25), dead_zone="w"),
        lambda p: mapped(p, lambda u: u - float(np.clip(u, -p["w"], p["w"])),
                         [at(lambda u: u - p["w"]), at(lambda u: u + p["w"])])),
    "function": (dict(parameters=free(c=0.7), function="u_x + c*u_x**3"),
                 lambda p: mapped(p, lambda u: u + p["c"] * u**3)),
    "rounded power": (dict(parameters=free(n=0.8), function="signed_power(u_x, n)"),
                      lambda p: mapped(p, lambda u: float(np.sign(u)) * abs(u) ** p["n"],
                                       [at(lambda u: u)])),
    "everything": (
        dict(parameters=free(k=1.5, b=0.1, level=0.6, w=0.1, c=0.3), gain="k", offset="b",
             saturation="level", dead_zone="w", function="u_x + c*u_x**2"),
        lambda p: mapped(
            p, lambda u: _everything(u, p),
            [at(lambda u, q=q: p["k"] * u + p["b"] - q)
             for q in (p["level"], -p["level"], p["w"], -p["w"])])),
}


def _everything(u: float, p: Values) -> float:
    """The order of the keywords: gain, offset, saturation, dead zone, function."""
    v = float(np.clip(p["k"] * u + p["b"], -p["level"], p["level"]))
    v -= float(np.clip(v, -p["w"], p["w"]))
    return v + p["c"] * v**2


@pytest.mark.parametrize("name", INPUT)
def test_input_maps(name: str) -> None:
    maps, reference = INPUT[name]
    model = systems.sloshing().map_input("u_x", **maps)
    found = compare(model, RECORDING, reference, step=1e-5)
    assert found.error < 0.05 * SIGMA
    assert found.slope_error < 2e-4
    assert Model.from_dict(model.to_dict()) == model


OUTPUT = {
    "gain": (dict(parameters=free(k=1.1), gain="k"), lambda y, p: p["k"] * y),
    "offset": (dict(parameters=free(b=0.02), offset="b"), lambda y, p: y + p["b"]),
    "drift": (dict(parameters=free(r=0.01), drift="r"), lambda y, p: y + p["r"] * T),
    "function": (dict(parameters=free(c=0.5), function="tan(theta)*c"),
                 lambda y, p: p["c"] * np.tan(y)),
    "clip": (dict(parameters=free(top=0.07), clip=(-0.02, "top")),
             lambda y, p: np.clip(y, -0.02, p["top"])),
    "everything": (
        dict(parameters=free(k=1.2, b=0.01, r=-0.02, c=2.0, top=0.06), gain="k", offset="b",
             drift="r", function="theta + c*theta**2", clip=("-top", "top")),
        lambda y, p: np.clip(
            (v := p["k"] * y + p["b"] + p["r"] * T) + p["c"] * v**2, -p["top"], p["top"])),
}


@pytest.mark.parametrize("name", OUTPUT)
def test_output_maps(name: str) -> None:
    maps, meaning = OUTPUT[name]
    model = systems.sloshing().map_output("theta", **maps)
    found = compare(model, RECORDING, lambda p: meaning(mapped(p), p), step=1e-5)
    assert found.error < 0.05 * SIGMA
    assert found.slope_error < 2e-4
    assert Model.from_dict(model.to_dict()) == model


def test_lags_start_in_equilibrium_whatever_was_mapped_before_or_after() -> None:
    """A constant input, seen through gain and two lags in any order, never moves the lags."""
    constant = Recording.from_arrays(T, {"u_x": np.full(len(T), 0.4)}, hold={"u_x": "zero"})
    gain = dict(parameters=free(k=1.5), gain="k")
    first = dict(parameters=free(a=0.05), lag="a")
    second = dict(parameters=free(b=0.1), lag="b")
    ends = []
    for order in ((gain, first, second), (first, gain, second), (second, first, gain)):
        model = systems.sloshing()
        for maps in order:
            model = model.map_input("u_x", **maps)
        made = interpreted.simulator(model, constant)
        x = made.run(np.array(list(model.values.values())), None, Steps("explicit", 0.01),
                     states=True).states
        assert np.ptp(x[:, 2:], axis=0) == pytest.approx([0, 0], abs=1e-13)
        ends.append(x[-1, 0])
    np.testing.assert_allclose(ends, ends[0], atol=1e-12)


def test_lag_of_an_output_starts_from_the_output() -> None:
    model = systems.sloshing().with_initial(theta="m/3").map_output("theta", offset=0.05)
    model = model.map_output("theta", free(tau=0.03), lag="tau")
    made = interpreted.simulator(model, RECORDING)
    y = made.run(np.array(list(model.values.values())), None, Steps("explicit", 0.01)).y
    assert y[0] == pytest.approx(0.15, abs=1e-14)


def test_two_lags_of_one_channel_get_different_names() -> None:
    model = systems.sloshing().map_input("u_x", lag=0.1).map_input("u_x", lag=0.2)
    assert model.state_names == ("theta", "theta_dot", "u_x_lag", "u_x_lag2")


def test_delays_of_maps_add_up() -> None:
    model = systems.sloshing().map_input("u_x", delay=0.1).map_input("u_x", delay=0.05)
    assert float(model.input("u_x").delay) == pytest.approx(0.15)


def test_what_cannot_be_mapped_is_refused() -> None:
    model = systems.sloshing()
    with pytest.raises(errors.BadModel, match=r"u_y"):
        model.map_input("u_y", gain=2)
    with pytest.raises(errors.BadModel, match="phi"):
        model.map_output("phi", gain=2)
    with pytest.raises(errors.BadModel, match=r"'k'.*gain of input 'u_x'"):
        model.map_input("u_x", gain="k")
    with pytest.raises(errors.BadModel, match="theta"):
        model.map_input("u_x", delay="theta")
    with pytest.raises(errors.BadModel, match="'zero', 'first' or 'cubic'"):
        model.map_input("u_x", hold="smooth")
    with pytest.raises(TypeError):
        model.map_input("u_x", gian=2)
