"""Families of physics, by id: what a diagnosis may say where it cannot give the exact name.

An id of several variants stands with its variant, as `hysteresis:backlash`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

# Friction whose load grows with the deflection loses energy with the cube of the amplitude, as
# quadratic drag does: it is of both kinds, and so is a loss that reaches a limit, which is linear
# in slow motion and does not depend on the speed in fast one.  Liquid has modes beside the one that
# a pendulum is.
FAMILIES: dict[str, tuple[str, ...]] = {
    "dry friction": ("coulomb_friction", "stribeck_friction", "one_way_friction",
                     "hysteresis:bouc_wen", "smooth_friction", "stick_slip_friction",
                     "position_friction", "bounded_loss"),
    "drag": ("quadratic_drag", "power_drag", "amplitude_damping", "boundary_layer",
             "fluid_memory", "fading_memory", "position_friction", "bounded_loss"),
    "restoring force": ("cubic_stiffness", "quintic_stiffness", "even_stiffness", "wall_impact",
                        "hard_stop", "cogging", "cable_drag", "magnet", "asymmetric_spring",
                        "one_sided_spring"),
    "constant force": ("static_bias", "sensor_offset", "one_way_friction"),
    "timing": ("input_delay", "sensor_delay", "actuator_lag", "sensor_lag", "input_hold",
               "clock_error", "rate_limited_input", "timing_jitter"),
    "gain": ("input_gain", "sensor_gain"),
    "input curve": ("input_saturation", "soft_saturation", "input_dead_zone",
                    "hysteresis:backlash", "velocity_coupled_drive", "quadratic_input",
                    "bilinear_input", "one_way_gain"),
    "sensor curve": ("sensor_saturation", "sensor_nonlinearity", "eccentric_encoder",
                     "rippled_sensor"),
    "mode": ("second_mode", "internal_resonance", "potential_flow"),
    "slow change": ("parameter_drift", "sensor_drift", "sensor_fading", "wobbling_length",
                    "warming_damping"),
    "other axis": ("cross_axis",),
}
DRY_EXPONENT = 0.3  # definition: up to which a power law of the speed is dry friction as well


def families_of(identifier: str, variant: str = "") -> set[str]:
    """Families of an effect; where its variant is not known, those of each.

    >>> sorted(families_of("hysteresis")), families_of("hysteresis", "backlash")
    (['dry friction', 'input curve'], {'input curve'})
    """
    def means(member: str) -> bool:
        name, _, kind = member.partition(":")
        return name == identifier and (not kind or not variant or kind == variant)

    return {family for family, members in FAMILIES.items() if any(map(means, members))}


def families_of_entry(effect: Mapping[str, Any]) -> set[str]:
    """Families of an effect as the truth file has it, its twins' among them.

    >>> sorted(families_of_entry({"id": "power_drag", "parameters": {"n": {"value": 0.2}}}))
    ['drag', 'dry friction']
    """
    if "families" in effect:
        return {*effect["families"]}
    found = families_of(effect["id"], effect.get("variant", ""))
    for twin in effect.get("twins", ()):
        found |= families_of(twin)
    exponent = effect.get("parameters", {}).get("n", {}).get("value")
    if effect["id"] == "power_drag" and exponent is not None and exponent <= DRY_EXPONENT:
        found.add("dry friction")
    return found
