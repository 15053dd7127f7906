"""Further laws that no catalogue holds, none of which a diagnosis was developed against.

Each states its equation and where it comes from; θ'' gains the force unless the channel says
otherwise.
"""

from __future__ import annotations

from math import pi

from pikanid.validation.concealed.effect import Effect, Quantity


def _phase(field: str, reach: float) -> Quantity:
    return Quantity("phi", "rad", ((field, 1),), ((-reach, reach),), (0.0,), (-pi, pi), log=False)


UNFORESEEN = (
    # -c tanh(θ'/w).  Coulomb friction as simulators round it: Andersson, Söderberg & Björklund,
    # Friction models for sliding dry, boundary and mixed lubricated contacts, Tribol. Int. 2007.
    Effect("smooth_friction", "near", "dynamics", (
        Quantity("c", "rad/s^2", (("smooth_friction", 1),), ((0.002, 6.0),), (0.3,), (0.0, 30.0)),
        Quantity("width", "rad/s", (("smooth_width", 1),), ((0.004, 0.06),), (0.015,),
                 (0.001, 1.0))), near="coulomb_friction"),
    # -c z, δ z' = θ' - |θ'| z/s(θ'), s = 1 + r exp(-(θ'/v)²).  Bristles that bend and slip: Canudas
    # de Wit, Olsson, Åström & Lischinsky, IEEE Trans. Autom. Control 40 (1995), with σ₁ = 0.
    Effect("stick_slip_friction", "near", "dynamics", (
        Quantity("c", "rad/s^2", (("bristle", 1),), ((0.005, 6.0),), (0.3,), (0.0, 30.0)),
        Quantity("give", "rad", (("bristle_give", 1),), ((0.002, 0.02),), (0.006,), (5e-4, 0.5)),
        Quantity("rise", "", (("bristle_rise", 1),), ((0.3, 1.5),), (0.5,), (0.0, 10.0)),
        Quantity("speed", "rad/s", (("bristle_speed", 1),), ((0.05, 0.8),), (0.2,), (0.01, 10.0))),
        twins=("hysteresis",), near="coulomb_friction"),
    # -c θ² sgn θ'.  The normal force grows with the deflection: Armstrong-Hélouvry, Dupont &
    # Canudas de Wit, Automatica 30 (1994), on friction that depends on position.
    Effect("position_friction", "outside", "dynamics", (
        Quantity("c", "1/(rad*s^2)", (("position_friction", 1),), ((0.1, 400.0),), (10.0,),
                 (0.0, 3000.0)),)),
    # -a (sin(mθ + φ) - sin φ).  Teeth of a motor; it rests in a detent.  Hanselman, Brushless
    # Permanent Magnet Motor Design (2003), on cogging torque.
    Effect("cogging", "outside", "dynamics", (
        Quantity("a", "rad/s^2", (("cogging", 1),), ((0.01, 6.0),), (0.5,), (0.0, 30.0)),
        Quantity("m", "1/rad", (("cogging_pitch", 1),), ((20.0, 90.0),), (50.0,), (5.0, 300.0)),
        _phase("cogging_phase", 1.2))),
    # -k max(θ - θ_c, 0)².  A cable or hose that tightens beyond an angle, its force from zero with
    # slope zero as that of a chain whose slack is used up.
    Effect("cable_drag", "outside", "dynamics", (
        Quantity("k", "1/(rad*s^2)", (("cable", 1),), ((1.0, 8000.0),), (200.0,), (0.0, 1e5)),
        Quantity("theta_c", "rad", (("cable_angle", 1),), ((0.15, 0.7),), (0.4,), (0.0, 1.5),
                 relative="angle", log=False))),
    # -a s/(1 + s²)², s = θ/w.  A magnet beside the lowest point: it acts there only.
    Effect("magnet", "outside", "dynamics", (
        Quantity("a", "rad/s^2", (("magnet", 1),), ((0.02, 40.0),), (1.0,), (-200.0, 200.0)),
        Quantity("width", "rad", (("magnet_width", 1),), ((0.1, 0.35),), (0.2,), (0.02, 2.0),
                 relative="angle"))),
    # -κ |θ|.  Stiffer to one side: bilinear oscillator, Shaw & Holmes, J. Sound Vib. 90 (1983).
    Effect("asymmetric_spring", "outside", "dynamics", (
        Quantity("kappa", "1/s^2", (("asymmetry", 1),), ((0.05, 100.0),), (5.0,), (-150.0, 150.0),
                 signed=True),)),
    # g (1 + ε sin Ωt), Ω ≈ 2 ω₀.  The pivot shakes up and down: Mathieu's equation, Nayfeh & Mook,
    # Nonlinear Oscillations (1979), chapter 5.
    Effect("parametric_excitation", "outside", "dynamics", (
        Quantity("epsilon", "", (("pumping", 1),), ((1e-4, 0.2),), (0.02,), (-0.9, 0.9)),
        Quantity("rate", "rad/s", (("pumping_rate", 1),), ((1.8, 2.2),), (2.0,), (0.5, 6.0),
                 relative="rate", log=False))),
    # -κ (θ' - w), τ w' = θ' - w.  The fluid that moves along remembers: the radiation force of
    # Cummins, Schiffstechnik 9 (1962), with an exponential kernel.
    Effect("fluid_memory", "outside", "dynamics", (
        Quantity("kappa", "1/s", (("wake", 1),), ((0.02, 80.0),), (2.0,), (0.0, 500.0)),
        Quantity("tau", "s", (("wake_time", 1),), ((0.02, 0.4),), (0.1,), (0.005, 5.0)))),
    # d (1 + a exp(-t/τ)).  Oil that warms up: viscosity falls exponentially to its final value.
    Effect("warming_damping", "near", "dynamics", (
        Quantity("a", "", (("warming", 1),), ((0.01, 12.0),), (0.5,), (0.0, 100.0)),
        Quantity("tau", "s", (("warming_time", 1),), ((0.1, 0.5),), (0.25,), (0.02, 3.0),
                 relative="duration")), near="parameter_drift"),
    # g sin(κ x) along x, x'' = u.  The platform gives way under the shuttle that stands on it.
    Effect("platform_tilt", "outside", "dynamics", (
        Quantity("kappa", "rad/m", (("tilt", 1),), ((2e-4, 0.5),), (0.02,), (-3.0, 3.0),
                 signed=True),)),
    # u + κ u².  A drive whose two directions differ in strength, as a magnetic force does.
    Effect("quadratic_input", "outside", "input", (
        Quantity("kappa", "s^2/m", (("input_square", 1),), ((0.001, 3.0),), (0.05,), (-10.0, 10.0),
                 signed=True),)),
    # y + a sin(Ωt + φ), Ω/2π above half the frame rate.  The camera trembles, and sampling folds
    # that to a line at another frequency: Shannon, Proc. IRE 37 (1949).
    Effect("aliased_vibration", "outside", "sensor", (
        Quantity("a", "rad", (("shake", 1),), ((5e-5, 0.2),), (0.002,), (0.0, 1.0)),
        Quantity("rate", "rad/s", (("shake_rate", 1),), ((330.0, 605.0), (650.0, 905.0)),
                 (400.0,), (315.0, 2000.0), log=False),
        _phase("shake_phase", pi))),
    # y = s + a (sin(ms + φ) - sin φ).  A disc that is geared m-fold and runs out of true, once a
    # turn; the zero is set at rest.
    Effect("eccentric_encoder", "outside", "sensor", (
        Quantity("a", "rad", (("ripple", 1),), ((5e-5, 0.1),), (0.002,), (0.0, 1.0)),
        Quantity("m", "1/rad", (("ripple_pitch", 1),), ((10.0, 60.0),), (25.0,), (1.0, 300.0)),
        _phase("ripple_phase", 1.2))),
    # Samples taken at t + δ, δ normal, written down as t: Souders, Flach, Hagwood & Yang, IEEE
    # Trans. Instrum. Meas. 39 (1990), on timing jitter.
    Effect("timing_jitter", "outside", "sensor", (
        Quantity("std", "s", (("jitter", 1),), ((2e-5, 4e-3),), (5e-4,), (0.0, 0.01)),
        Quantity("key", "", (("jitter_key", 1),), ((1.0, 9e4),), (1.0,), (0.0, 1e5), log=False)),
        held_out="other"),
)  # definition: sizes are drawn from these
