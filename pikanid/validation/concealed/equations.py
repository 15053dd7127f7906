"""Equations of motion of the reference rig, compiled.

State: θ, θ', actuator, sensor, hysteresis z, second mode q, q', the boundary layer's relaxation
states, the bristles' bend z, the wake w, the platform's position and velocity.  Only the first n
that a rig needs are integrated.

Nothing here asks for a sign or for contact: the integrator knows them exactly and passes them, so
that the right-hand side is smooth between events.
"""

# mypy: disallow-untyped-defs=False
# Numba infers the types of compiled functions from the call.

from __future__ import annotations

import math

import numpy as np
from numba import njit

# Positions in the settings, in the order of Rig.DYNAMIC.
(LENGTH, DAMPING, MASS, GRAVITY, COULOMB, STRIBECK, STRIBECK_SPEED, ONE_WAY, QUADRATIC, POWER,
 EXPONENT, AMPLITUDE_DAMPING, CUBIC, QUINTIC, EVEN, BIAS, LENGTH_DRIFT, DAMPING_DRIFT, WOBBLE,
 WOBBLE_RATE, MODE_GAIN, MODE_RATE, MODE_DAMPING, INTERNAL, WALL, WALL_STIFFNESS, WALL_DAMPING,
 STOP, RESTITUTION, LEAK_Y, LEAK_PITCH, BUMP, BUMP_TIME, BUMP_WIDTH, LAYER, MEMORY, YIELD_ANGLE,
 VIBRATION, VIBRATION_RATE, BILINEAR, ACTUATOR_LAG, SENSOR_LAG, SMOOTH_FRICTION, SMOOTH_WIDTH,
 POSITION_FRICTION, BRISTLE, BRISTLE_GIVE, BRISTLE_RISE, BRISTLE_SPEED, COGGING, COGGING_PITCH,
 COGGING_PHASE, CABLE, CABLE_ANGLE, MAGNET, MAGNET_WIDTH, ASYMMETRY, PUMPING, PUMPING_RATE, WAKE,
 WAKE_TIME, WARMING, WARMING_TIME, TILT) = range(64)  # definition: positions in the settings

# D^½ as relaxations: s^½ = (1/π) ∫ λ^(-½) s/(s + λ) dλ with λ = e^y, the trapezoidal rule in y.
# Its error is below e^(-π²/h) of the value; beyond both ends s/(s + λ) is 1 and s/λ.
_H = 0.9  # numerical: step of y: an error of e^-11
_Y = np.arange(-5, 8) * _H  # numerical: relaxation rates of e^-4.5 to e^6.3
RATES = np.exp(_Y)
WEIGHTS = _H / math.pi * np.exp(_Y / 2)  # definition: of the formula above
SLOW = float(WEIGHTS[0] * math.exp(-_H / 2)
             / (1 - math.exp(-_H / 2)))  # definition: of the formula above
FAST = float(WEIGHTS[-1] / RATES[-1] * math.exp(-_H / 2)
             / (1 - math.exp(-_H / 2)))  # definition: of the formula above
LAYERS = len(RATES)
# Positions in the state.
ACTUATOR, SENSOR, HYSTERESIS, MODE, FIRST_LAYER = 2, 3, 4, 5, 7  # definition: positions in it
BEND = FIRST_LAYER + LAYERS
TRAIL, TRACK = BEND + 1, BEND + 2  # definition: positions in it
CREEP = 1e-3  # numerical: ε [rad/s]: a power below one has no slope at rest


@njit
def rubs(p):
    """Whether there is friction that can hold."""
    return p[COULOMB] > 0.0 or p[ONE_WAY] > 0.0 or p[POSITION_FRICTION] > 0.0


@njit
def friction(p, theta, sign, speed):
    """Friction at an angle that opposes sliding in direction `sign` at `speed` ≥ 0 [rad/s²]."""
    c = p[COULOMB]
    if p[STRIBECK] != 0.0:
        c *= 1.0 + p[STRIBECK] * math.exp(-((speed / p[STRIBECK_SPEED]) ** 2))
    if p[POSITION_FRICTION] != 0.0:
        c += p[POSITION_FRICTION] * theta * theta
    return c + p[ONE_WAY] if sign > 0 else c


@njit
def power_law(v, sign, exponent):
    """|v|ⁿ sgn v; for n < 1, whose slope at rest has no bound, (v² + ε²)^((n-1)/2) v."""
    if exponent < 1.0:
        return v * (v * v + CREEP * CREEP) ** (0.5 * (exponent - 1.0))
    speed = sign * v
    return sign * speed**exponent if speed > 0.0 else 0.0


@njit
def static_force(p, theta, taut, side):
    """Forces of the angle alone that no catalogue holds [rad/s²]; `side` is the sign of θ."""
    f = 0.0
    if p[COGGING] != 0.0:
        phase = p[COGGING_PHASE]
        f -= p[COGGING] * (math.sin(p[COGGING_PITCH] * theta + phase) - math.sin(phase))
    if taut:
        f -= p[CABLE] * (theta - p[CABLE_ANGLE]) ** 2
    if p[MAGNET] != 0.0:
        s = theta / p[MAGNET_WIDTH]
        f -= p[MAGNET] * s / (1.0 + s * s) ** 2
    if p[ASYMMETRY] != 0.0:
        f -= p[ASYMMETRY] * side * theta
    return f


@njit
def rhs(t, x, n, u, p, sign, contact, memory_sign, stuck, taut, side, dx):
    """Write dx/dt; return the angular acceleration that friction has to hold where stuck.

    Args: t [s]; x (n,); u (4,): u_x, u_y [m/s²], pitch [rad], random force [rad/s²]; p settings;
    `sign` of θ'; `contact` with the wall; `memory_sign` of z; `stuck` at rest; `taut` cable; `side`
    sign of θ; dx (n,) result.
    """
    theta, v = x[0], x[1]
    push = u[0]
    if n > ACTUATOR:
        dx[ACTUATOR] = 0.0
        if p[ACTUATOR_LAG] > 0.0:
            push = x[ACTUATOR]
            dx[ACTUATOR] = (u[0] - push) / p[ACTUATOR_LAG]
    along = push + p[LEAK_Y] * u[1]
    if p[LEAK_PITCH] != 0.0:
        along += p[GRAVITY] * math.sin(p[LEAK_PITCH] * u[2])
    if p[TILT] != 0.0:
        along += p[GRAVITY] * math.sin(p[TILT] * x[TRACK])
    gravity = p[GRAVITY]
    if p[PUMPING] != 0.0:
        gravity *= 1.0 + p[PUMPING] * math.sin(p[PUMPING_RATE] * t)
    length = p[LENGTH] * (1.0 + p[LENGTH_DRIFT] * t)
    if p[WOBBLE] != 0.0:
        length *= 1.0 + p[WOBBLE] * math.sin(p[WOBBLE_RATE] * t)
    d = p[DAMPING] * (1.0 + p[DAMPING_DRIFT] * t)
    if p[WARMING] != 0.0:
        d *= 1.0 + p[WARMING] * math.exp(-t / p[WARMING_TIME])
    sine, cosine = math.sin(theta), math.cos(theta)
    f = (along * cosine - gravity * sine) / length - d / p[MASS] * v * cosine * cosine
    f += p[BIAS] + u[3] - p[AMPLITUDE_DAMPING] * sine * sine * v
    f -= p[CUBIC] * 6.0 * (theta - sine) + p[EVEN] * theta * theta + p[QUINTIC] * theta**5
    f -= p[QUADRATIC] * sign * v * v
    f += p[BILINEAR] * push * v
    if p[POWER] != 0.0:
        f -= p[POWER] * power_law(v, sign, p[EXPONENT])
    if p[VIBRATION] != 0.0:
        f += p[VIBRATION] * math.sin(p[VIBRATION_RATE] * t)
    if p[BUMP] != 0.0:
        phase = (t - p[BUMP_TIME]) / p[BUMP_WIDTH]
        if abs(phase) < 0.5:
            f += p[BUMP] * 0.5 * (1.0 + math.cos(2.0 * math.pi * phase))
    f += static_force(p, theta, taut, side)
    if p[SMOOTH_FRICTION] != 0.0:
        f -= p[SMOOTH_FRICTION] * math.tanh(v / p[SMOOTH_WIDTH])
    if contact:
        f -= p[WALL_STIFFNESS] * (theta - p[WALL]) * (1.0 + p[WALL_DAMPING] * v)
    shown = theta
    if n > MODE:
        q, w = x[MODE], x[MODE + 1]
        dx[MODE] = w
        dx[MODE + 1] = (p[MODE_GAIN] * push - 2.0 * p[MODE_DAMPING] * p[MODE_RATE] * w
                        - p[MODE_RATE] ** 2 * q + 0.5 * p[INTERNAL] * theta * theta)
        f += p[INTERNAL] * theta * q
        shown += q
    if n > SENSOR:
        dx[SENSOR] = (shown - x[SENSOR]) / p[SENSOR_LAG] if p[SENSOR_LAG] > 0.0 else 0.0
    if n > HYSTERESIS:
        z = x[HYSTERESIS]
        dx[HYSTERESIS] = 0.0
        if p[MEMORY] != 0.0:
            f -= p[MEMORY] * z
            dx[HYSTERESIS] = (v - 0.5 * (sign * v * z + v * memory_sign * z)) / p[YIELD_ANGLE]
    if n > BEND:
        dx[BEND] = 0.0
        if p[BRISTLE] != 0.0:
            z = x[BEND]
            f -= p[BRISTLE] * z
            holds = 1.0 + p[BRISTLE_RISE] * math.exp(-((v / p[BRISTLE_SPEED]) ** 2))
            dx[BEND] = (v - sign * v * z / holds) / p[BRISTLE_GIVE]
    if n > TRAIL:
        dx[TRAIL] = (v - x[TRAIL]) / p[WAKE_TIME]
        f -= p[WAKE] * (v - x[TRAIL])
    if n > TRACK:
        dx[TRACK] = x[TRACK + 1]
        dx[TRACK + 1] = u[0]
    if n > FIRST_LAYER and p[LAYER] == 0.0:
        dx[FIRST_LAYER : FIRST_LAYER + LAYERS] = 0.0
    elif n > FIRST_LAYER:
        shear = SLOW * v
        for i in range(LAYERS):
            lag = v - x[FIRST_LAYER + i]
            shear += WEIGHTS[i] * lag
            dx[FIRST_LAYER + i] = RATES[i] * lag
        f = (f - p[LAYER] * shear) / (1.0 + p[LAYER] * FAST)
    dx[0] = v
    if stuck:
        dx[0] = 0.0
        dx[1] = 0.0
    else:
        slip = friction(p, theta, sign, abs(v)) if rubs(p) else 0.0
        dx[1] = f - sign * slip
    return f
