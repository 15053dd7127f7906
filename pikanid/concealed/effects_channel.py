"""Catalogue: what happens on the way into the vessel, and on the way from it to the file."""

from __future__ import annotations

from pikanid.concealed.effect import Effect, Quantity

_DELAY = {"draw": ((1e-4, 0.06),), "starts": (0.006,), "bounds": (0.0, 0.2)}
_LAG = {"draw": ((1e-4, 0.08),), "starts": (0.01,), "bounds": (1e-7, 0.5)}
_GAIN = {"draw": ((0.001, 0.4),), "starts": (1.05,), "bounds": (0.05, 5.0), "signed": True,
         "neutral": 1.0}

EFFECTS = (
    Effect("input_delay", "catalogue", "input", (
        Quantity("tau", "s", (("input_delay", 1),), **_DELAY),), twins=("sensor_delay",)),
    Effect("sensor_delay", "catalogue", "sensor", (
        Quantity("tau", "s", (("sensor_delay", 1),), **_DELAY),), twins=("input_delay",)),
    Effect("actuator_lag", "catalogue", "input", (
        Quantity("tau", "s", (("actuator_lag", 1),), **_LAG),), twins=("sensor_lag",)),
    Effect("sensor_lag", "catalogue", "sensor", (
        Quantity("tau", "s", (("sensor_lag", 1),), **_LAG),), twins=("actuator_lag",)),
    Effect("input_gain", "catalogue", "input", (
        Quantity("k", "", (("input_gain", 1),), **_GAIN),), twins=("sensor_gain",)),
    Effect("sensor_gain", "catalogue", "sensor", (
        Quantity("k", "", (("sensor_gain", 1),), **_GAIN),), twins=("input_gain",)),
    Effect("input_saturation", "catalogue", "input", (
        Quantity("limit", "m/s^2", (("input_limit", 1),), ((0.995, 0.4),), (0.9, 0.75, 0.6, 0.45),
                 (0.1, 1.5), relative="input", log=False),)),
    Effect("input_dead_zone", "catalogue", "input", (
        Quantity("width", "m/s^2", (("dead_zone", 1),), ((0.001, 0.5),), (0.05, 0.2), (0.0, 0.95),
                 relative="input"),)),
    Effect("sensor_offset", "catalogue", "sensor", (
        Quantity("b", "rad", (("offset", 1),), ((3e-5, 0.1),), (0.01,), (-1.0, 1.0),
                 signed=True),), twins=("static_bias",)),
    Effect("sensor_drift", "catalogue", "sensor", (
        Quantity("beta", "rad/s", (("sensor_drift", 1),), ((3e-6, 0.02),), (1e-3,), (-1.0, 1.0),
                 signed=True),)),
    Effect("sensor_saturation", "catalogue", "sensor", (
        Quantity("limit", "rad", (("sensor_high", 1), ("sensor_low", -1)), ((0.995, 0.4),),
                 (0.95, 0.85, 0.7, 0.55), (0.1, 1.5), relative="angle", log=False),)),
    Effect("sensor_nonlinearity", "catalogue", "sensor", (
        Quantity("k", "1/rad^2", (("sensor_cubic", 1),), ((0.01, 8.0),), (1.0,), (-30.0, 60.0),
                 signed=True),)),
    Effect("input_hold", "catalogue", "input", fixed=(("first_order_hold", 1.0),)),
)
