"""Excitations that a planar motor runs: moves from rest to rest within its bounds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pikanid import errors
from pikanid.recording.channel import Array
from pikanid.recording.excitation.sampling import grid, inputs
from pikanid.recording.recording import Recording


def move(distance: float = 0.1, duration: float = 5.0, dt: float = 0.01, start: float = 0.2,
         acceleration: float = 1.0, velocity: float = 0.5, channel: str = "u_x") -> Recording:
    """One planar-motor move from rest to rest with bounded acceleration and velocity.

    Ramp and cruise times are rounded up to the grid and the acceleration is lowered to match, so
    that the shuttle stands still afterwards, exactly `distance` away.

    Args:
        distance: To travel [m], negative for backwards.
        duration: Of the recording [s].
        dt: [s].
        start: When the move begins [s].
        acceleration: Bound [m/s²].
        velocity: Bound [m/s].
        channel: Name of the input, the shuttle's acceleration [m/s²].

    Raises:
        BadSetting: If a bound is not positive or the move does not fit into `duration`.

    >>> u = move(0.1)["u_x"]
    >>> round(float((u.values * 0.01).sum()), 12)      # at rest again
    0.0
    """
    t = grid(duration, dt)
    u = np.zeros(len(t))
    _add_move(u, round(start / dt), distance, dt, acceleration, velocity)
    return inputs(t, {channel: u}, "m/s^2", "move")


def planar_moves(count: int = 6, duration: float = 20.0, dt: float = 0.01, stroke: float = 0.4,
                 acceleration: float = 1.0, velocity: float = 0.5, seed: int = 0,
                 channels: Sequence[str] = ("u_x",)) -> Recording:
    """Random planar-motor moves that keep to bounds of stroke, velocity and acceleration.

    Args:
        count: Moves an axis, spread evenly over `duration`.
        duration: [s].
        dt: Sampling interval [s].
        stroke: The shuttle starts at 0 and stays within ±stroke/2 [m].
        acceleration: Bound [m/s²].
        velocity: Bound [m/s].
        seed: Of the random targets, pauses and ramps.
        channels: Names of the inputs [m/s²], one an axis.

    Raises:
        BadSetting: If a bound is not positive or `count` moves do not fit into `duration`.

    >>> planar_moves(channels=("u_x", "u_y"), seed=3).names
    ('u_x', 'u_y')
    """
    rng = np.random.default_rng(seed)
    t = grid(duration, dt)
    slot = duration / max(count, 1)
    made = {}
    for key in channels:
        u, position = np.zeros(len(t)), 0.0
        for k in range(count):
            target = rng.uniform(-stroke / 2, stroke / 2)
            gentle = acceleration * rng.uniform(0.5, 1.0)
            ramp, cruise = _steps(target - position, dt, gentle, velocity)
            length = dt * (2 * ramp + cruise + 1)
            if length > slot:
                raise errors.BadSetting(errors.move_too_long(target - position, length))
            first = k * slot + rng.uniform(0.0, max(0.5 * slot - length, 0.0))
            _add_move(u, int(np.ceil(first / dt)), target - position, dt, gentle, velocity)
            position = target
        made[key] = u
    return inputs(t, made, "m/s^2", "planar moves")


def _steps(distance: float, dt: float, acceleration: float, velocity: float) -> tuple[int, int]:
    """Grid steps of each ramp and of the cruise between them."""
    if min(acceleration, velocity, dt) <= 0:
        raise errors.BadSetting(errors.bad_move_bounds(acceleration, velocity))
    way = abs(distance)
    peak = min(velocity, np.sqrt(way * acceleration))
    ramp = max(1, int(np.ceil(peak / acceleration / dt - 1e-9)))
    cruise = max(0, int(np.ceil((way / velocity - ramp * dt) / dt - 1e-9)))
    return ramp, cruise


def _add_move(u: Array, first: int, distance: float, dt: float, acceleration: float,
              velocity: float) -> None:
    ramp, cruise = _steps(distance, dt, acceleration, velocity)
    last = first + 2 * ramp + cruise
    if first < 0 or last > len(u):
        raise errors.BadSetting(errors.move_too_long(distance, dt * (2 * ramp + cruise)))
    # Trapezoidal velocity: way = a·(ramp·dt)·((ramp + cruise)·dt).
    a = distance / (ramp * (ramp + cruise) * dt**2)
    u[first : first + ramp] += a
    u[last - ramp : last] -= a
