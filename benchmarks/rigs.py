"""Rigs that concealed effects are looked for in, beside the sloshing tank: models and experiments.

Every experiment is drawn with a seed of its own; the two of a rig differ in kind where a user would
have two kinds, and in their random levels everywhere.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pikanid.model import Model, systems
from pikanid.recording import Recording

Array = NDArray[np.float64]
# Linear-quadratic regulator of the pole upright: weights 1, 10, 1, 1 of states, 0.5 of the force
GAINS = {"x": 1.41, "theta": -33.0, "x_dot": 3.39, "theta_dot": -5.48}


@dataclass(frozen=True)
class Bench:
    """A rig and what moves it.

    Attributes:
        model: Without effects.
        catalogue: Names of catalogues that the model may lack effects of, as on the command line.
        experiment: Of a seed.
    """

    model: Callable[[], Model]
    experiment: Callable[[int], Recording]
    catalogue: tuple[str, ...] = ()


def levels(seed: int, n: int, hold: int, low: float, high: float) -> Array:
    """(n,) random levels, each held for so many samples."""
    drawn = np.random.default_rng(seed).uniform(low, high, -(-n // hold))
    return np.repeat(drawn, hold)[:n]


def _recorded(step: float, **inputs: tuple[Array, str]) -> Recording:
    count = len(next(iter(inputs.values()))[0])
    return Recording.from_arrays(step * np.arange(count), {k: v[0] for k, v in inputs.items()},
                                 {k: v[1] for k, v in inputs.items()})


def _tanks(seed: int) -> Recording:
    return _recorded(4.0, u=(levels(seed, 400, 10, 1.0, 4.0), "V"))


def _motor(seed: int) -> Recording:
    return _recorded(0.005, u=(levels(seed, 1000, 25, -6.0, 6.0), "V"))


def _drive(seed: int) -> Recording:
    return _recorded(0.01, tau=(levels(seed, 1000, 30, -1.0, 1.0), "N*m"))


def _house(seed: int) -> Recording:
    hours = 0.5 * np.arange(672)
    weather = levels(seed + 1, 672, 48, 0.0, 8.0)
    ambient = 4.0 + 5.0 * np.sin(2 * np.pi * (hours - 9.0) / 24.0) + weather
    return _recorded(1800.0, T_a=(ambient, "degC"), P=(levels(seed, 672, 12, 0.0, 6000.0), "W"))


def _pole(seed: int) -> Recording:
    return _recorded(0.02, F_0=(levels(seed, 500, 25, -2.0, 2.0), "N"))


def upright() -> Model:
    """A pole on a cart that its controller holds upright: unstable without it, so that what is
    recorded is the closed loop; the force that the controller is told is the input.
    """
    told = systems.cart_pole().to_dict()
    fed_back = " + ".join(f"({gain})*{name}" for name, gain in GAINS.items())
    for name, text in told["equations"].items():
        text = text.replace("sin(theta)", "(-sin(theta))").replace("cos(theta)", "(-cos(theta))")
        told["equations"][name] = text.replace("F -", f"F_0 + {fed_back} -")
    told["inputs"] = {"F_0": {"unit": "N", "hold": "zero"}}
    return Model.from_dict(told | {"name": "cart_pole_upright"})


RIGS = {
    "cascaded_tanks": Bench(systems.cascaded_tanks, _tanks, ("hydraulics",)),
    "dc_motor": Bench(systems.dc_motor, _motor, ("electrical",)),
    "two_mass_drive": Bench(systems.two_mass_drive, _drive),
    "thermal_rc": Bench(systems.thermal_rc, _house, ("thermal",)),
    "cart_pole_upright": Bench(upright, _pole),
}
