"""The reference rig: the slosh pendulum with every imperfection it may have, each off by default.

A hidden effect is nothing but a setting of this rig.  The nominal rig is the pendulum of Eq. (6),

    θ'' = u_x/l cos θ - g/l sin θ - d/m θ' cos² θ,

driven by a zero-order hold of the recorded acceleration and seen by a perfect sensor.
"""

from __future__ import annotations

from typing import NamedTuple

FAR = 1e9  # definition: a wall, stop or limit that is never reached


class Rig(NamedTuple):
    """Settings of the rig; SI units, angles in rad.

    The first block enters the equations of motion, in the order that the compiled right-hand side
    expects; the second one acts before (input) and after (sensor) them.

    >>> Rig(coulomb=0.3).coulomb, Rig().coulomb
    (0.3, 0.0)
    """

    length: float = 0.045  # l [m]
    damping: float = 0.15  # d [N s/m]
    mass: float = 0.30  # m [kg]
    gravity: float = 9.81  # g [m/s²]
    coulomb: float = 0.0  # kinetic friction [rad/s²]
    stribeck: float = 0.0  # static friction over the kinetic one, minus 1
    stribeck_speed: float = 0.1  # [rad/s]
    one_way: float = 0.0  # further friction where θ' > 0 [rad/s²]
    quadratic: float = 0.0  # |θ'|θ' [1/rad]
    power: float = 0.0  # |θ'|ⁿ sgn θ' [rad^(1-n) s^(n-2)]
    exponent: float = 1.0  # n
    amplitude_damping: float = 0.0  # sin²θ θ' [1/(s rad²)]
    cubic: float = 0.0  # 6 (θ - sin θ), which is θ³ - θ⁵/20 [1/(s² rad²)]
    quintic: float = 0.0  # θ⁵ [1/(s² rad⁴)]
    even: float = 0.0  # θ² [1/(s² rad)]
    bias: float = 0.0  # constant force [rad/s²]
    length_drift: float = 0.0  # l (1 + r t) [1/s]
    damping_drift: float = 0.0  # d (1 + r t) [1/s]
    wobble: float = 0.0  # l (1 + ε sin Ωt)
    wobble_rate: float = 1.0  # Ω [rad/s]
    mode_gain: float = 0.0  # a₂ of q'' + 2 ζ ω₂ q' + ω₂² q = a₂ u [rad/m]
    mode_rate: float = 40.0  # ω₂ [rad/s]
    mode_damping: float = 0.02  # ζ
    internal: float = 0.0  # θ'' gains κ θ q, q'' gains ½ κ θ² [rad⁻¹ s⁻²]
    wall: float = FAR  # one-sided elastic wall [rad]
    wall_stiffness: float = 0.0  # [1/s²]
    wall_damping: float = 0.0  # Hunt and Crossley's factor: force k δ (1 + α δ') [s/rad]
    stop: float = FAR  # rigid stop [rad]
    restitution: float = 0.5
    leak_y: float = 0.0  # share of u_y that acts along x
    leak_pitch: float = 0.0  # share of the pitch that tilts gravity
    bump: float = 0.0  # raised-cosine force, its peak [rad/s²]
    bump_time: float = 0.0  # its centre [s]
    bump_width: float = 0.1  # its length [s]
    layer: float = 0.0  # b of b D^½ θ' [s^(-1/2)]
    memory: float = 0.0  # hysteretic force b z, |z| ≤ 1 [rad/s²]
    yield_angle: float = 0.01  # [rad]
    vibration: float = 0.0  # force a sin Ωt [rad/s²]
    vibration_rate: float = 20.0  # Ω [rad/s]
    bilinear: float = 0.0  # κ u_x θ' [s/m]
    actuator_lag: float = 0.0  # [s]
    sensor_lag: float = 0.0  # [s]
    smooth_friction: float = 0.0  # c of c tanh(θ'/width) [rad/s²]
    smooth_width: float = 0.01  # [rad/s]
    position_friction: float = 0.0  # c of c θ² sgn θ' [1/(rad s²)]
    bristle: float = 0.0  # c of c z, friction by bristles that bend [rad/s²]
    bristle_give: float = 0.01  # angle over which they bend [rad]
    bristle_rise: float = 0.0  # static friction over the kinetic one, minus 1
    bristle_speed: float = 0.1  # [rad/s]
    cogging: float = 0.0  # a of a (sin(mθ + φ) - sin φ) [rad/s²]
    cogging_pitch: float = 50.0  # m [1/rad]
    cogging_phase: float = 0.0  # φ [rad]
    cable: float = 0.0  # k of k max(θ - θ_c, 0)² [1/(rad s²)]
    cable_angle: float = FAR  # θ_c [rad]
    magnet: float = 0.0  # a of a s/(1 + s²)², s = θ/width [rad/s²]
    magnet_width: float = 0.05  # [rad]
    asymmetry: float = 0.0  # κ of κ |θ| [1/s²]
    pumping: float = 0.0  # g (1 + ε sin Ωt)
    pumping_rate: float = 30.0  # Ω [rad/s]
    wake: float = 0.0  # κ of κ (θ' - w), τ w' = θ' - w [1/s]
    wake_time: float = 0.1  # τ [s]
    warming: float = 0.0  # d (1 + a exp(-t/τ))
    warming_time: float = 1.0  # τ [s]
    tilt: float = 0.0  # inclination of the platform over its position [rad/m]

    first_order_hold: float = 0.0  # 0: zero-order, 1: first-order
    dead_zone: float = 0.0  # [m/s²]
    input_limit: float = FAR  # [m/s²]
    soft_limit: float = FAR  # L of L tanh(u/L) [m/s²]
    slew: float = FAR  # [m/s³]
    backlash: float = 0.0  # half width of the play [m/s²]
    input_gain: float = 1.0
    input_delay: float = 0.0  # [s]
    turbulence: float = 0.0  # standard deviation of a random force [rad/s²]
    turbulence_key: float = 0.0  # which random force
    input_square: float = 0.0  # κ of u + κ u² [s²/m]
    start_angle: float = 0.0  # beyond the angle at rest [rad]
    start_rate: float = 0.0  # [rad/s]
    sensor_delay: float = 0.0  # [s]
    clock: float = 0.0  # the camera's clock runs slow by this share
    sensor_cubic: float = 0.0  # y = s + k s³ [1/rad²]
    sensor_gain: float = 1.0
    sensor_low: float = -FAR  # clipped below [rad]
    sensor_high: float = FAR  # clipped above [rad]
    offset: float = 0.0  # [rad]
    sensor_drift: float = 0.0  # [rad/s]
    ripple: float = 0.0  # a of s + a (sin(ms + φ) - sin φ) [rad]
    ripple_pitch: float = 20.0  # m [1/rad]
    ripple_phase: float = 0.0  # φ [rad]
    shake: float = 0.0  # a sin(Ωt + φ) on the angle that is seen [rad]
    shake_rate: float = 400.0  # Ω [rad/s]
    shake_phase: float = 0.0  # φ [rad]
    jitter: float = 0.0  # standard deviation of the times at which samples are taken [s]
    jitter_key: float = 0.0  # which random times


DYNAMIC = Rig._fields[: Rig._fields.index("first_order_hold")]
