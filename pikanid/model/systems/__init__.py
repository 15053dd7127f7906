"""Ready-made models: the slosh pendulum of Eq. (6) and the oscillators it is compared with."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping
from pathlib import Path

from pikanid import errors
from pikanid.model.model import Model
from pikanid.model.systems.oscillators import duffing_oscillator, linear_oscillator, pendulum
from pikanid.model.systems.sloshing import sloshing, sloshing_2d

__all__ = [
    "SYSTEMS",
    "duffing_oscillator",
    "find",
    "linear_oscillator",
    "pendulum",
    "sloshing",
    "sloshing_2d",
]

SYSTEMS: Mapping[str, Callable[[], Model]] = {
    "sloshing": sloshing,
    "sloshing_2d": sloshing_2d,
    "pendulum": pendulum,
    "linear_oscillator": linear_oscillator,
    "duffing_oscillator": duffing_oscillator,
}


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
