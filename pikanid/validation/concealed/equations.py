"""Equations of motion of the reference rig, compiled.

State: θ, θ', actuator, sensor, hysteresis z, second mode q, q', then the boundary layer's
relaxation states.  Only the first n that a rig needs are integrated.

Nothing here asks for the sign of θ' or for contact: the integrator knows both exactly and passes
them, so that the right-hand side is smooth between events.
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
 VIBRATION, VIBRATION_RATE, BILINEAR, ACTUATOR_LAG,
 SENSOR_LAG) = range(42)  # definition: positions in the settings

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
CREEP = 1e-3  # numerical: ε [rad/s]: a power below one has no slope at rest


@njit
def friction(p, sign, speed):
    """Friction that opposes sliding in direction `sign` at `speed` ≥ 0 [rad/s²]."""
    c = p[COULOMB]
    if p[STRIBECK] != 0.0:
        c *= 1.0 + p[STRIBECK] * math.exp(-((speed / p[STRIBECK_SPEED]) ** 2))
    return c + p[ONE_WAY] if sign > 0 else c


@njit
def power_law(v, sign, exponent):
    """|v|ⁿ sgn v; for n < 1, whose slope at rest has no bound, (v² + ε²)^((n-1)/2) v."""
    if exponent < 1.0:
        return v * (v * v + CREEP * CREEP) ** (0.5 * (exponent - 1.0))
    speed = sign * v
    return sign * speed**exponent if speed > 0.0 else 0.0


@njit
def rhs(t, x, n, u, p, sign, contact, memory_sign, stuck, dx):
    """Write dx/dt; return the angular acceleration that friction has to hold where stuck.

    Args: t [s]; x (n,); u (4,): u_x, u_y [m/s²], pitch [rad], random force [rad/s²]; p settings;
    `sign` of θ'; `contact` with the wall; `memory_sign` of z; `stuck` at rest; dx (n,) result.
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
    length = p[LENGTH] * (1.0 + p[LENGTH_DRIFT] * t)
    if p[WOBBLE] != 0.0:
        length *= 1.0 + p[WOBBLE] * math.sin(p[WOBBLE_RATE] * t)
    d = p[DAMPING] * (1.0 + p[DAMPING_DRIFT] * t)
    sine, cosine = math.sin(theta), math.cos(theta)
    f = (along * cosine - p[GRAVITY] * sine) / length - d / p[MASS] * v * cosine * cosine
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
    if n > FIRST_LAYER:
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
        slip = friction(p, sign, abs(v)) if p[COULOMB] > 0.0 or p[ONE_WAY] > 0.0 else 0.0
        dx[1] = f - sign * slip
    return f
