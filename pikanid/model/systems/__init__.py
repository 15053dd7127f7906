"""Ready-made models: sloshing, oscillators, machines, and what flows, heats, reacts or lives."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping
from pathlib import Path

from pikanid import errors
from pikanid.model.model import Model
from pikanid.model.systems.batch_reactor import batch_reactor
from pikanid.model.systems.cart_pole import cart_pole
from pikanid.model.systems.cascaded_tanks import cascaded_tanks
from pikanid.model.systems.dc_motor import dc_motor
from pikanid.model.systems.double_pendulum import double_pendulum
from pikanid.model.systems.lotka_volterra import lotka_volterra
from pikanid.model.systems.one_compartment import one_compartment
from pikanid.model.systems.oscillators import duffing_oscillator, linear_oscillator, pendulum
from pikanid.model.systems.sir import sir
from pikanid.model.systems.sloshing import sloshing, sloshing_2d
from pikanid.model.systems.thermal_rc import thermal_rc
from pikanid.model.systems.two_mass_drive import two_mass_drive

__all__ = [
    "SYSTEMS",
    "batch_reactor",
    "cart_pole",
    "cascaded_tanks",
    "dc_motor",
    "double_pendulum",
    "duffing_oscillator",
    "find",
    "linear_oscillator",
    "lotka_volterra",
    "one_compartment",
    "pendulum",
    "sir",
    "sloshing",
    "sloshing_2d",
    "thermal_rc",
    "two_mass_drive",
]

SYSTEMS: Mapping[str, Callable[[], Model]] = {build.__name__: build for build in (
    sloshing, sloshing_2d, pendulum, linear_oscillator, duffing_oscillator, double_pendulum,
    cart_pole, dc_motor, two_mass_drive, cascaded_tanks, thermal_rc, batch_reactor, one_compartment,
    sir, lotka_volterra)}


def find(name: str) -> Model:
    """The ready-made model of that name, or the model in that TOML file.

    Raises:
        BadModel: Neither a known name nor a readable model file.

    >>> find("pendulum").free_names
    ('l', 'd', 'theta_0', 'theta_dot_0')
    """
    if name in SYSTEMS:
        return SYSTEMS[name]()
    if name.endswith(".toml") or Path(name).exists():
        return Model.load(name)
    close = difflib.get_close_matches(name, SYSTEMS, 1)
    raise errors.BadModel(errors.unknown_system(name, list(SYSTEMS), close))
