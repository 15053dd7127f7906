"""Catalogue: what happens on the way into the vessel, and on the way from it to the file."""

from __future__ import annotations

from pikanid.validation.concealed.effect import Effect, Quantity


def _delay(field: str) -> Quantity:
    return Quantity("tau", "s", ((field, 1),), ((1e-4, 0.06),), (0.006,), (0.0, 0.2))


def _lag(field: str) -> Quantity:
    # Below 0.4 ms a lag is stiff, and no camera sees it.
    return Quantity("tau", "s", ((field, 1),), ((4e-4, 0.08),), (0.01,), (4e-4, 0.5))


def _gain(field: str) -> Quantity:
    return Quantity("k", "", ((field, 1),), ((0.001, 0.4),), (1.05,), (0.05, 5.0), signed=True,
                    neutral=1.0)


EFFECTS = (
    Effect("input_delay", "catalogue", "input", (_delay("input_delay"),),
           twins=("sensor_delay",)),
    Effect("sensor_delay", "catalogue", "sensor", (_delay("sensor_delay"),),
           twins=("input_delay",)),
    Effect("actuator_lag", "catalogue", "input", (_lag("actuator_lag"),),
           twins=("sensor_lag",)),
    Effect("sensor_lag", "catalogue", "sensor", (_lag("sensor_lag"),),
           twins=("actuator_lag",)),
    Effect("input_gain", "catalogue", "input", (_gain("input_gain"),),
           twins=("sensor_gain",)),
    Effect("sensor_gain", "catalogue", "sensor", (_gain("sensor_gain"),),
           twins=("input_gain",)),
    Effect("input_saturation", "catalogue", "input", (
        Quantity("limit", "m/s^2", (("input_limit", 1),), ((0.99995, 0.4),), (0.9, 0.75, 0.6, 0.45),
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
        Quantity("limit", "rad", (("sensor_high", 1), ("sensor_low", -1)), ((0.99995, 0.4),),
                 (0.95, 0.85, 0.7, 0.55), (0.1, 1.5), relative="angle", log=False),)),
    Effect("sensor_nonlinearity", "catalogue", "sensor", (
        Quantity("k", "1/rad^2", (("sensor_cubic", 1),), ((0.01, 8.0),), (1.0,), (-30.0, 60.0),
                 signed=True),)),
    Effect("input_hold", "catalogue", "input", fixed=(("first_order_hold", 1.0),)),
)  # definition: sizes are drawn from these
