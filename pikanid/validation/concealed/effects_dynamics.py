"""Catalogue: forces, and what else changes the motion itself."""

from __future__ import annotations

from pikanid.validation.concealed.effect import Effect, Quantity

EXPONENT = Quantity("n", "", (("exponent", 1),), ((0.3, 0.7), (1.3, 1.7), (2.4, 3.0)),
                    (0.5, 1.5, 2.6), (0.15, 4.0), log=False)  # definition: drawn from these

EFFECTS = (
    Effect("coulomb_friction", "catalogue", "dynamics", (
        Quantity("c", "rad/s^2", (("coulomb", 1),), ((0.002, 6.0),), (0.3,), (0.0, 30.0)),)),
    Effect("quadratic_drag", "catalogue", "dynamics", (
        Quantity("q", "1/rad", (("quadratic", 1),), ((0.003, 6.0),), (0.3,), (0.0, 50.0)),)),
    Effect("power_drag", "catalogue", "dynamics", (
        Quantity("c", "rad^(1-n)*s^(n-2)", (("power", 1),), ((0.003, 6.0),), (0.3,), (0.0, 50.0)),
        EXPONENT), covers=("coulomb_friction", "quadratic_drag")),
    Effect("amplitude_damping", "catalogue", "dynamics", (
        Quantity("c2", "1/(s*rad^2)", (("amplitude_damping", 1),), ((0.1, 300.0),), (10.0,),
                 (0.0, 3000.0)),)),
    Effect("cubic_stiffness", "catalogue", "dynamics", (
        Quantity("k3", "1/(s^2*rad^2)", (("cubic", 1),), ((0.3, 800.0),), (-50.0, 50.0),
                 (-1500.0, 5000.0), signed=True),)),
    Effect("static_bias", "catalogue", "dynamics", (
        Quantity("bias", "rad/s^2", (("bias", 1),), ((0.01, 15.0),), (1.0,), (-60.0, 60.0),
                 signed=True),), twins=("sensor_offset",)),
    Effect("parameter_drift", "catalogue", "dynamics", (
        Quantity("r", "1/s", (("length_drift", 1),), ((3e-6, 0.02),), (1e-3,), (-0.04, 0.2),
                 signed=True),), variant="length"),
    Effect("parameter_drift", "catalogue", "dynamics", (
        Quantity("r", "1/s", (("damping_drift", 1),), ((0.002, 1.0),), (0.03,), (-0.045, 20.0)),),
        variant="damping"),
    Effect("second_mode", "catalogue", "dynamics", (
        Quantity("a2", "rad/m", (("mode_gain", 1),), ((0.01, 60.0),), (2.0,), (-500.0, 500.0),
                 signed=True),
        Quantity("omega2", "rad/s", (("mode_rate", 1),), ((1.6, 3.5),), (1.5, 2.0, 2.6, 3.3),
                 (1.15, 6.0), relative="rate"),
        Quantity("zeta2", "", (("mode_damping", 1),), ((0.005, 0.06),), (0.02,), (0.0, 1.0)))),
    Effect("wall_impact", "catalogue", "dynamics", (
        Quantity("theta_wall", "rad", (("wall", 1),), ((0.99995, 0.4),), (0.9, 0.75, 0.6, 0.45),
                 (0.2, 1.5), relative="angle", log=False),
        Quantity("stiffness", "1/s^2", (("wall_stiffness", 1),), ((3e3, 3e4),), (1e4,),
                 (1e2, 1e6)))),
    Effect("cross_axis", "catalogue", "dynamics", (
        Quantity("kappa", "", (("leak_y", 1),), ((5e-4, 0.5),), (0.05,), (-3.0, 3.0),
                 signed=True),), variant="u_y"),
    Effect("cross_axis", "catalogue", "dynamics", (
        Quantity("kappa", "", (("leak_pitch", 1),), ((0.005, 1.0),), (0.2,), (-5.0, 5.0),
                 signed=True),), variant="pitch"),
    Effect("disturbance", "catalogue", "dynamics", (
        Quantity("peak", "rad/s^2", (("bump", 1),), ((0.05, 60.0),), (3.0,), (-500.0, 500.0),
                 signed=True),
        Quantity("time", "s", (("bump_time", 1),), ((0.2, 0.85),),
                 tuple(k / 11 for k in range(1, 11)), (0.02, 0.98), relative="duration",
                 log=False),
        Quantity("width", "s", (("bump_width", 1),), ((0.1, 0.6),), (0.25,), (0.03, 3.0))),
        held_out="absent"),
    Effect("boundary_layer", "catalogue", "dynamics", (
        Quantity("b", "s^(-1/2)", (("layer", 1),), ((0.001, 1.0),), (0.1,), (0.0, 10.0)),)),
    Effect("hysteresis", "catalogue", "dynamics", (
        Quantity("force", "rad/s^2", (("memory", 1),), ((0.01, 10.0),), (1.0,), (0.0, 100.0)),
        Quantity("yield_angle", "rad", (("yield_angle", 1),), ((0.004, 0.06),), (0.006, 0.03),
                 (5e-4, 0.5))), variant="bouc_wen"),
    Effect("hysteresis", "catalogue", "input", (
        Quantity("half_play", "m/s^2", (("backlash", 1),), ((0.003, 0.4),), (0.05,), (0.0, 0.9),
                 relative="input"),), variant="backlash"),
    Effect("initial_state", "catalogue", "dynamics", (
        Quantity("theta_0", "rad", (("start_angle", 1),), ((1e-4, 0.12),), (0.02,), (-0.8, 0.8),
                 signed=True),
        Quantity("theta_dot_0", "rad/s", (("start_rate", 1),), ((1.0, 20.0),), (0.3,),
                 (-10.0, 10.0), signed=True, tied=True)), held_out="other"),
)  # definition: sizes are drawn from these
