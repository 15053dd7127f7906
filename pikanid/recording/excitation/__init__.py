"""Excitations: recordings that hold only input channels, to simulate or to plan with.

All are on a uniform grid with a zero-order hold: sample k counts for t in [t_k, t_{k+1}).  The
command line offers all that `EXCITATIONS` lists.  Functions are imported when they are first used.
"""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from dataclasses import replace
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pikanid.recording.excitation.moves import move, planar_moves
    from pikanid.recording.excitation.sampling import grid
    from pikanid.recording.excitation.sines import chirp, multisine
    from pikanid.recording.excitation.switched import free_decay, pulses, two_pulse
    from pikanid.recording.recording import Recording

# name, in Python and on the command line -> file here that defines the function
EXCITATIONS = {
    "two_pulse": "switched",
    "free_decay": "switched",
    "move": "moves",
    "planar_moves": "moves",
    "chirp": "sines",
    "multisine": "sines",
}
_OTHERS = {"grid": "sampling", "pulses": "switched"}

__all__ = [
    "EXCITATIONS",
    "built_in",
    "chirp",
    "free_decay",
    "grid",
    "move",
    "multisine",
    "planar_moves",
    "pulses",
    "two_pulse",
]


def built_in(name: str, duration: float, dt: float, channels: Sequence[str]) -> Recording:
    """The excitation of that name with its default settings.

    Args:
        name: One of `EXCITATIONS`.
        duration: [s].
        dt: Sampling interval [s].
        channels: Inputs; an excitation of one input drives the first, and the others stay at 0.

    Raises:
        BadSetting: If the excitation does not fit into `duration`, or `dt` is too coarse for it.

    >>> built_in("free_decay", 1.0, 0.1, ["u_x", "u_y"]).names
    ('u_x', 'u_y')
    """
    function = __getattr__(name)
    many = "channels" in inspect.signature(function).parameters
    driven = {"channels": tuple(channels)} if many else {"channel": channels[0]}
    made: Recording = function(duration=duration, dt=dt, **driven)
    still = [replace(made[made.names[0]], name=c, values=0.0 * made.t, unit="")
             for c in channels if c not in made]
    return made.with_channels(*made.channels.values(), *still)


def __getattr__(name: str) -> Any:
    file = {**EXCITATIONS, **_OTHERS}.get(name)
    if file is None:
        raise AttributeError(f"module 'pikanid.recording.excitation' has no attribute {name!r}")
    return getattr(import_module(f"pikanid.recording.excitation.{file}"), name)
