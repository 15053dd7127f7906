"""What the catalogue does not hold: laws that resemble one of its entries, and others."""

from __future__ import annotations

from dataclasses import replace

from pikanid.validation.concealed.effect import Effect, Quantity
from pikanid.validation.concealed.effects_dynamics import EXPONENT

NEAR = (
    Effect("power_drag", "near", "dynamics", (
        Quantity("c", "rad^(1-n)*s^(n-2)", (("power", 1),), ((0.003, 6.0),), (0.3,), (0.0, 50.0)),
        replace(EXPONENT, draw=((1.4, 1.6), (0.15, 0.3), (1.75, 1.85), (2.15, 2.3)))),
        near="quadratic_drag"),
    Effect("stribeck_friction", "near", "dynamics", (
        Quantity("c", "rad/s^2", (("coulomb", 1),), ((0.005, 4.0),), (0.3,), (0.0, 30.0)),
        Quantity("rise", "", (("stribeck", 1),), ((0.3, 1.5),), (0.5,), (0.0, 10.0)),
        Quantity("speed", "rad/s", (("stribeck_speed", 1),), ((0.05, 0.8),), (0.2,),
                 (0.01, 10.0))), near="coulomb_friction"),
    Effect("one_way_friction", "near", "dynamics", (
        Quantity("c", "rad/s^2", (("one_way", 1),), ((0.005, 6.0),), (0.3,), (0.0, 30.0)),),
        near="coulomb_friction"),
    Effect("hard_stop", "near", "dynamics", (
        Quantity("theta_stop", "rad", (("stop", 1),), ((0.99995, 0.5),), (0.8,), (0.1, 1.5),
                 relative="angle", log=False),
        Quantity("restitution", "", (("restitution", 1),), ((0.2, 0.9),), (0.5,), (0.0, 1.0))),
        near="wall_impact"),
    Effect("rate_limited_input", "near", "input", (
        Quantity("rate", "m/s^3", (("slew", 1),), ((500.0, 3.0),), (20.0,), (0.5, 1e4),
                 relative="input"),), near="input_saturation"),
    Effect("soft_saturation", "near", "input", (
        Quantity("limit", "m/s^2", (("soft_limit", 1),), ((15.0, 0.6),), (2.0,), (0.2, 100.0),
                 relative="input"),), near="input_saturation"),
    Effect("quintic_stiffness", "near", "dynamics", (
        Quantity("k5", "1/(s^2*rad^4)", (("quintic", 1),), ((10.0, 1e4),), (500.0,),
                 (-2e4, 1e5), signed=True),), near="cubic_stiffness"),
)  # definition: sizes are drawn from these

OUTSIDE = (
    Effect("wobbling_length", "outside", "dynamics", (
        Quantity("epsilon", "", (("wobble", 1),), ((1e-4, 0.1),), (0.01,), (-0.5, 0.5)),
        Quantity("rate", "rad/s", (("wobble_rate", 1),), ((0.1, 0.8),), (0.4,), (0.02, 3.0),
                 relative="rate"))),
    Effect("internal_resonance", "outside", "dynamics", (
        Quantity("kappa", "1/(rad*s^2)", (("internal", 1),), ((3.0, 1500.0),), (100.0,),
                 (0.0, 1e4)),
        Quantity("omega2", "rad/s", (("mode_rate", 1),), ((1.7, 2.3),), (2.0,), (1.2, 4.0),
                 relative="rate"))),
    Effect("even_stiffness", "outside", "dynamics", (
        Quantity("k2", "1/(s^2*rad)", (("even", 1),), ((0.1, 200.0),), (10.0,), (-500.0, 500.0),
                 signed=True),)),
    Effect("background_vibration", "outside", "dynamics", (
        Quantity("peak", "rad/s^2", (("vibration", 1),), ((0.01, 20.0),), (1.0,), (0.0, 100.0)),
        Quantity("rate", "rad/s", (("vibration_rate", 1),), ((0.3, 0.85), (1.2, 2.5)), (1.5,),
                 (0.1, 5.0), relative="rate"))),
    Effect("turbulence", "outside", "dynamics", (
        Quantity("std", "rad/s^2", (("turbulence", 1),), ((0.02, 20.0),), (1.0,), (0.0, 100.0)),
        Quantity("key", "", (("turbulence_key", 1),), ((1.0, 9e4),), (1.0,), (0.0, 1e5),
                 log=False)), held_out="other"),
    Effect("velocity_coupled_drive", "outside", "input", (
        Quantity("kappa", "s/m", (("bilinear", 1),), ((0.005, 5.0),), (0.3,), (-20.0, 20.0),
                 signed=True),)),
    Effect("clock_error", "outside", "sensor", (
        Quantity("epsilon", "", (("clock", 1),), ((1e-5, 0.02),), (1e-3,), (-0.1, 0.1),
                 signed=True),)),
)  # definition: sizes are drawn from these
