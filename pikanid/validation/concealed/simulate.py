"""What the camera would see of a rig or of a tank, without noise."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from pikanid import errors
from pikanid.validation.concealed import equations, signals
from pikanid.validation.concealed.arrays import Array
from pikanid.validation.concealed.camera import surface_angle
from pikanid.validation.concealed.experiment import RATE, Experiment
from pikanid.validation.concealed.rig import DYNAMIC, FAR, Rig
from pikanid.validation.concealed.signals import Signal
from pikanid.validation.concealed.tank import Tank

TURBULENCE_STEP = 0.05  # definition: [s] between the corners of the random force
LARGEST_JITTER = 0.45 / RATE  # definition: [s]: samples keep their order
FARTHEST = 1.2  # limit: [rad] of an angle at rest
REST_STEP = 1e-3  # numerical: [rad] in the search for the angle at rest


def measured(rig: Rig | Tank, experiment: Experiment) -> Array:
    """(N,) the angle as recorded, without noise [rad].

    Raises:
        SimulationFailed: If the motion does not stay finite.

    >>> from pikanid.validation.concealed.excitations import two_pulse
    >>> theta = measured(Rig(), two_pulse())
    >>> len(theta), round(float(np.degrees(theta.max())), 2)
    (501, 11.34)
    """
    if isinstance(rig, Tank):
        states = motion(rig, experiment, experiment.t)
        return surface_angle(rig, states)
    # The camera samples at t, but sees what was there `sensor_delay` before.
    seen_at = experiment.t * (1.0 + rig.clock) - rig.sensor_delay
    if rig.jitter:
        seen_at = seen_at + _jitter(len(seen_at), rig.jitter, int(rig.jitter_key))
    seen_at = np.maximum(seen_at, 0.0)
    states = motion(rig, experiment, seen_at)
    s = states[:, 0]
    if rig.sensor_lag > 0.0:
        s = states[:, equations.SENSOR]
    elif states.shape[1] > equations.MODE:
        s = s + states[:, equations.MODE]
    if rig.ripple:
        phase = rig.ripple_phase
        s = s + rig.ripple * (np.sin(rig.ripple_pitch * s + phase) - np.sin(phase))
    y = rig.sensor_gain * (s + rig.sensor_cubic * s**3)
    y = np.clip(y, rig.sensor_low, rig.sensor_high)
    if rig.shake:
        y = y + rig.shake * np.sin(rig.shake_rate * experiment.t + rig.shake_phase)
    return y + rig.offset + rig.sensor_drift * experiment.t


def motion(rig: Rig | Tank, experiment: Experiment, t: Array) -> Array:
    """(M, n) states at rising times t (M,) ≥ 0 [s].

    Raises:
        SimulationFailed: If the motion does not stay finite.
    """
    # Compiled code is loaded only by those who simulate.
    from pikanid.validation.concealed import integrator

    if isinstance(rig, Tank):
        drive = _drive(experiment, INPUT_OF_NOMINAL)
        kind, p, x0 = integrator.TANK, rig.settings(), rig.rest()
        extra: tuple[float, ...] = ()
        reverses = rig.contact_line > 0.0
    else:
        drive = _drive(experiment, _input_settings(rig))
        kind, p = integrator.RIG, np.array(rig[: len(DYNAMIC)], dtype=float)
        x0, reverses = _start(rig), _reverses(rig)
        half = rig.bump_width / 2
        extra = (rig.bump_time - half, rig.bump_time + half) if rig.bump else ()
    stops, segments, rows = _stops(drive, t, extra)
    states = np.empty((len(stops), len(x0)))
    with np.errstate(all="ignore"):
        events = integrator.integrate(kind, p, drive, stops, segments, x0, reverses, states)
    if events < 0 or not np.all(np.isfinite(states)):
        raise errors.SimulationFailed(errors.conceal_diverged())
    return states[rows]


def _stops(drive: Array, t: Array,
           extra: tuple[float, ...]) -> tuple[Array, NDArray[np.intp], NDArray[np.intp]]:
    """Times to stop at, the row of the drive up to each, and where the times t are among them."""
    end = max(float(t[-1]), 0.0)
    knots = np.r_[drive[:, 0], np.array(extra)]
    stops = np.unique(np.r_[0.0, t, knots[(knots > 0.0) & (knots < end)]])
    middles = 0.5 * (stops + np.r_[stops[0], stops[:-1]])
    segments = np.maximum(np.searchsorted(drive[:, 0], middles, side="right") - 1, 0)
    return stops, segments, np.searchsorted(stops, t)


def _input_settings(rig: Rig) -> tuple[float, ...]:
    return tuple(rig[len(DYNAMIC) : Rig._fields.index("start_angle")])


INPUT_OF_NOMINAL = _input_settings(Rig())


@lru_cache(maxsize=32)
def _drive(experiment: Experiment, settings: tuple[float, ...]) -> Array:
    """(K, 9) knot, values and slopes of u_x on its way into the rig, u_y, pitch, random force."""
    hold, dead, limit, soft, slew, play, gain, delay, turbulence, key, square = settings
    samples = experiment.u_x
    if square != 0.0:
        samples = samples + square * samples**2
    if soft < FAR:
        samples = soft * np.tanh(samples / soft)
    u = (signals.first_order if hold else signals.zero_order)(experiment.t, samples)
    if dead > 0.0:
        u = signals.dead_zone(u, dead)
    if limit < FAR:
        u = signals.clipped(u, -limit, limit)
    if slew < FAR:
        u = signals.slewed(u, slew)
    if play > 0.0:
        u = signals.played(u, play)
    parts = [u.scaled(gain).delayed(delay),
             signals.zero_order(experiment.t, experiment.u_y),
             signals.zero_order(experiment.t, experiment.pitch),
             _random_force(experiment.duration, turbulence, int(key))]
    knots = np.unique(np.concatenate([part.knots for part in parts]))
    table = np.empty((len(knots), 9))
    table[:, 0] = knots
    for i, part in enumerate(parts):
        k = np.maximum(np.searchsorted(part.knots, knots, side="right") - 1, 0)
        table[:, 1 + i] = part.values[k] + part.slopes[k] * (knots - part.knots[k])
        table[:, 5 + i] = part.slopes[k]
    table.setflags(write=False)
    return table


def _random_force(duration: float, size: float, key: int) -> Signal:
    if size == 0.0:
        return Signal(np.zeros(1), np.zeros(1), np.zeros(1))
    t = np.arange(0.0, duration + 2 * TURBULENCE_STEP, TURBULENCE_STEP)
    values = size * np.random.default_rng(key).standard_normal(len(t))
    values[[0, -1]] = 0.0
    return signals.first_order(t, values)


def _jitter(n: int, size: float, key: int) -> Array:
    """(N,) errors of the times of samples, too small to change their order [s]."""
    drawn = size * np.random.default_rng(key).standard_normal(n)
    return np.clip(drawn, -LARGEST_JITTER, LARGEST_JITTER)


def _reverses(rig: Rig) -> bool:
    return bool(rig.coulomb or rig.one_way or rig.position_friction or rig.bristle
                or rig.quadratic or rig.power or rig.memory or rig.wall_stiffness
                or rig.stop < FAR)


def _start(rig: Rig) -> Array:
    """State at rest under the constant forces, plus what the initial state is off by."""
    n = 2
    for needed, last in ((rig.actuator_lag, equations.ACTUATOR), (rig.sensor_lag, equations.SENSOR),
                         (rig.memory, equations.HYSTERESIS),
                         (rig.mode_gain or rig.internal, equations.MODE + 1),
                         (rig.layer, equations.FIRST_LAYER + equations.LAYERS - 1),
                         (rig.bristle, equations.BEND), (rig.wake, equations.TRAIL),
                         (rig.tilt, equations.TRACK + 1)):
        n = last + 1 if needed else n
    x0 = np.zeros(n)
    x0[0] = _angle_at_rest(rig) + rig.start_angle
    x0[1] = rig.start_rate
    if n > equations.SENSOR:
        x0[equations.SENSOR] = x0[0]
    return x0


def _angle_at_rest(rig: Rig) -> float:
    if rig.bias == 0.0:
        return 0.0

    def force(theta: float) -> float:
        return (rig.bias - rig.gravity / rig.length * np.sin(theta)
                - rig.cubic * 6 * (theta - np.sin(theta)) - rig.even * theta**2
                - rig.quintic * theta**5)

    if not (rig.cogging or rig.cable or rig.magnet or rig.asymmetry):
        if force(-FARTHEST) * force(FARTHEST) >= 0.0:
            raise errors.SimulationFailed(errors.conceal_diverged())
        return float(brentq(force, -FARTHEST, FARTHEST, xtol=1e-15))
    p = np.array(rig[: len(DYNAMIC)], dtype=float)

    def every_force(theta: float) -> float:
        taut, side = theta > rig.cable_angle, 1.0 if theta > 0.0 else -1.0
        return force(theta) + float(equations.static_force(p, theta, taut, side))

    # Of several places to rest, the first that the bias pushes it to.
    way = REST_STEP if rig.bias > 0.0 else -REST_STEP
    last = 0.0
    while every_force(last + way) * way > 0.0 and abs(last) < FARTHEST:
        last += way
    if abs(last) >= FARTHEST:
        raise errors.SimulationFailed(errors.conceal_diverged())
    return float(brentq(every_force, last, last + way, xtol=1e-15))
