"""Excitations that jump from one value to another: pulses, and none at all."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pikanid import errors
from pikanid.recording.excitation.sampling import grid, inputs
from pikanid.recording.recording import Recording

Pulse = tuple[float, float, float]

# Table II: u_x = 1 m/s² for t in [0.2, 0.6) s, -1 m/s² for t in [1.2, 1.6) s, else 0.
TABLE_II: tuple[Pulse, ...] = ((0.2, 0.6, 1.0), (1.2, 1.6, -1.0))  # definition: of the paper


def pulses(pulses: Sequence[Pulse], duration: float, dt: float = 0.01, channel: str = "u_x",
           unit: str = "m/s^2", name: str = "pulses") -> Recording:
    """Rectangular pulses: (start, stop, value) holds for t in [start, stop).

    Args:
        pulses: Start [s], stop [s] and value in `unit` of each; overlapping ones add up.
        duration: Of the recording [s].
        dt: Sampling interval [s]; starts and stops must lie on the grid.
        channel: Name of the input.
        unit: Of the input.
        name: Of the recording.

    Raises:
        BadSetting: If a start or stop is not on the grid.

    >>> rec = pulses([(0.1, 0.3, 2.0)], duration=0.5, dt=0.1)
    >>> rec["u_x"].values.tolist()
    [0.0, 2.0, 2.0, 0.0, 0.0, 0.0]
    """
    t = grid(duration, dt)
    u = np.zeros(len(t))
    for start, stop, value in pulses:
        first, last = round(start / dt), round(stop / dt)
        off = max(abs(first * dt - start), abs(last * dt - stop))
        if off > 1e-6 * dt or first < 0 or last < first:
            raise errors.BadSetting(errors.pulse_off_grid(start, stop, dt))
        u[first:last] += value
    return inputs(t, {channel: u}, unit, name)


def two_pulse(duration: float = 5.0, dt: float = 0.01, amplitude: float = 1.0,
              channel: str = "u_x") -> Recording:
    """The input profile of the simulation study (Table II): one push, one pull, then free swing.

    Args:
        duration: T [s].
        dt: Sampling interval [s].
        amplitude: Of both pulses [m/s²].
        channel: Name of the input.

    Returns:
        A recording with N = 501 samples by default.

    >>> rec = two_pulse()
    >>> len(rec.t), rec["u_x"].values[[19, 20, 59, 60, 120, 159, 160]].tolist()
    (501, [0.0, 1.0, 1.0, 0.0, -1.0, -1.0, 0.0])
    """
    scaled = [(start, stop, amplitude * value) for start, stop, value in TABLE_II]
    return pulses(scaled, duration, dt, channel, name="two-pulse")


def free_decay(duration: float = 10.0, dt: float = 0.01, channels: Sequence[str] = ("u_x",),
               unit: str = "m/s^2") -> Recording:
    """No excitation at all: the response to the initial state alone.

    >>> free_decay(0.02)["u_x"].values.tolist()
    [0.0, 0.0, 0.0]
    """
    t = grid(duration, dt)
    return inputs(t, {key: np.zeros(len(t)) for key in channels}, unit, "free decay")
