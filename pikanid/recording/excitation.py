"""Excitations: recordings that hold only input channels, to simulate or to plan with.

All are on a uniform grid with a zero-order hold: sample k counts for t in [t_k, t_{k+1}).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from pikanid import errors
from pikanid.recording.channel import Array
from pikanid.recording.recording import Recording

Pulse = tuple[float, float, float]

# Table II: u_x = 1 m/s² for t in [0.2, 0.6) s, -1 m/s² for t in [1.2, 1.6) s, else 0.
TABLE_II: tuple[Pulse, ...] = ((0.2, 0.6, 1.0), (1.2, 1.6, -1.0))


def grid(duration: float, dt: float) -> Array:
    """Times 0, dt, ..., duration [s] as the doubles nearest to their decimals.

    0.01*57 is not 0.57; dividing by a whole rate is correctly rounded, so that a comparison with
    the decimal of a switching time comes out right.

    Raises:
        BadSetting: If `duration` or `dt` is not positive or `dt` exceeds `duration`.

    >>> grid(5.0, 0.01)[57], len(grid(5.0, 0.01))
    (np.float64(0.57), 501)
    """
    if not (np.isfinite(duration) and 0 < dt <= duration):
        raise errors.BadSetting(errors.bad_grid(duration, dt))
    k = np.arange(int(np.floor(duration / dt * (1 + 1e-12) + 1e-9)) + 1)
    rate = round(1 / dt)
    t = k / rate if rate and abs(rate * dt - 1) < 1e-12 else k * dt
    return np.asarray(t, dtype=float)


def pulses(
    pulses: Sequence[Pulse],
    duration: float,
    dt: float = 0.01,
    channel: str = "u_x",
    unit: str = "m/s^2",
    name: str = "pulses",
) -> Recording:
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
    return _inputs(t, {channel: u}, unit, name)


def two_pulse(
    duration: float = 5.0, dt: float = 0.01, amplitude: float = 1.0, channel: str = "u_x"
) -> Recording:
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


def free_decay(
    duration: float = 10.0,
    dt: float = 0.01,
    channels: Sequence[str] = ("u_x",),
    unit: str = "m/s^2",
) -> Recording:
    """No excitation at all: the response to the initial state alone.

    >>> free_decay(0.02)["u_x"].values.tolist()
    [0.0, 0.0, 0.0]
    """
    t = grid(duration, dt)
    return _inputs(t, {key: np.zeros(len(t)) for key in channels}, unit, "free decay")


def chirp(
    low: float,
    high: float,
    duration: float = 20.0,
    dt: float = 0.01,
    amplitude: float = 1.0,
    channel: str = "u_x",
    unit: str = "m/s^2",
) -> Recording:
    """A sine whose frequency rises exponentially from `low` to `high` [Hz].

    Each octave gets the same time: phase 2π·low·T/ln(r)·(r^{t/T} - 1) with r = high/low.
    BadSetting is raised unless 0 < low < high < half the sampling rate.

    >>> chirp(0.5, 5.0, duration=2.0).names
    ('u_x',)
    """
    _check_band([low, high], dt)
    if low >= high:
        raise errors.BadSetting(errors.bad_band([low, high], dt))
    t = grid(duration, dt)
    ratio = high / low
    phase = 2 * np.pi * low * duration / np.log(ratio) * (ratio ** (t / duration) - 1)
    return _inputs(t, {channel: amplitude * np.sin(phase)}, unit, "chirp")


def multisine(
    frequencies: ArrayLike,
    duration: float = 20.0,
    dt: float = 0.01,
    amplitude: float = 1.0,
    seed: int | None = None,
    channel: str = "u_x",
    unit: str = "m/s^2",
) -> Recording:
    """A sum of equal sines, scaled to a peak of `amplitude`.

    Args:
        frequencies: (K,) [Hz]; multiples of 1/duration make it periodic.
        duration: [s].
        dt: [s].
        amplitude: Largest absolute value.
        seed: Phases are random for a seed, and Schroeder's φ_k = -π·k(k-1)/K (M. R. Schroeder,
            IEEE Trans. Inf. Theory 16, 1970; a low crest factor) for None.
        channel: Name of the input.
        unit: Of the input.

    Raises:
        BadSetting: Unless all frequencies lie between 0 and half the sampling rate.

    >>> rec = multisine([0.5, 1.0, 1.5], duration=4.0, amplitude=2.0)
    >>> float(abs(rec["u_x"].values).max().round(12))
    2.0
    """
    f = np.atleast_1d(np.asarray(frequencies, dtype=float))
    _check_band(f.tolist(), dt)
    k = np.arange(1, len(f) + 1)
    phase = (
        -np.pi * k * (k - 1) / len(f)
        if seed is None
        else np.random.default_rng(seed).uniform(0, 2 * np.pi, len(f))
    )
    t = grid(duration, dt)
    u = np.cos(2 * np.pi * np.outer(t, f) + phase).sum(axis=1)
    return _inputs(t, {channel: u * (amplitude / np.max(np.abs(u)))}, unit, "multisine")


def move(
    distance: float,
    duration: float = 5.0,
    dt: float = 0.01,
    start: float = 0.2,
    acceleration: float = 1.0,
    velocity: float = 0.5,
    channel: str = "u_x",
) -> Recording:
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
    return _inputs(t, {channel: u}, "m/s^2", "move")


def planar_moves(
    count: int = 6,
    duration: float = 20.0,
    dt: float = 0.01,
    stroke: float = 0.4,
    acceleration: float = 1.0,
    velocity: float = 0.5,
    seed: int = 0,
    channels: Sequence[str] = ("u_x",),
) -> Recording:
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
    return _inputs(t, made, "m/s^2", "planar moves")


def _steps(distance: float, dt: float, acceleration: float, velocity: float) -> tuple[int, int]:
    """Grid steps of each ramp and of the cruise between them."""
    if min(acceleration, velocity, dt) <= 0:
        raise errors.BadSetting(errors.bad_move_bounds(acceleration, velocity))
    way = abs(distance)
    peak = min(velocity, np.sqrt(way * acceleration))
    ramp = max(1, int(np.ceil(peak / acceleration / dt - 1e-9)))
    cruise = max(0, int(np.ceil((way / velocity - ramp * dt) / dt - 1e-9)))
    return ramp, cruise


def _add_move(
    u: Array, first: int, distance: float, dt: float, acceleration: float, velocity: float
) -> None:
    ramp, cruise = _steps(distance, dt, acceleration, velocity)
    last = first + 2 * ramp + cruise
    if first < 0 or last > len(u):
        raise errors.BadSetting(errors.move_too_long(distance, dt * (2 * ramp + cruise)))
    # Trapezoidal velocity: way = a·(ramp·dt)·((ramp + cruise)·dt).
    a = distance / (ramp * (ramp + cruise) * dt**2)
    u[first : first + ramp] += a
    u[last - ramp : last] -= a


def _check_band(frequencies: Sequence[float], dt: float) -> None:
    if not frequencies or not all(0 < f < 0.5 / dt for f in frequencies):
        raise errors.BadSetting(errors.bad_band(frequencies, dt))


def _inputs(t: Array, values: dict[str, Array], unit: str, name: str) -> Recording:
    return Recording.from_arrays(
        t, values, {key: unit for key in values}, hold={key: "zero" for key in values}, name=name
    )
