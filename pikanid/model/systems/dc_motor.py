"""A brushed DC motor, driven by its voltage."""

from __future__ import annotations

from pikanid.model.model import Model


def dc_motor() -> Model:
    """A DC motor, L i' = u - R i - k ω and J ω' = k i - b ω - τ, whose speed ω is measured.

    Textbook physics, as in G. F. Franklin, J. D. Powell and A. Emami-Naeini, Feedback Control of
    Dynamic Systems, ch. 2: in SI units the constants of torque and of back-EMF are one number k.
    From voltage and speed alone three numbers can be had, so that R and L, which a meter shows, are
    fixed: give them your motor's values.  A load torque τ that is not recorded counts as 0.

    >>> dc_motor().free_names
    ('k', 'J', 'b')
    """
    return Model.from_dict({
        "name": "dc_motor",
        "domain": "electrical",
        "states": {"i": {"unit": "A"}, "omega": {"unit": "rad/s"}},
        "inputs": {"u": {"unit": "V"}, "tau": {"unit": "N*m", "default": 0.0}},
        "parameters": {
            "k": {"unit": "N*m/A", "guess": 0.03, "bounds": [1e-5, 1e3],
                  "description": "torque constant = back-EMF constant in V*s/rad"},
            "J": {"unit": "kg*m^2", "guess": 1e-5, "bounds": [1e-10, 1e4],
                  "description": "inertia of rotor and load"},
            "b": {"unit": "N*m*s", "guess": 1e-5, "bounds": [0.0, 1e4],
                  "description": "viscous friction"},
            "R": {"unit": "ohm", "value": 1.0, "description": "armature resistance"},
            "L": {"unit": "H", "value": 1e-3, "description": "armature inductance"}},
        "equations": {"i": "(u - R*i - k*omega)/L", "omega": "(k*i - b*omega - tau)/J"},
        "outputs": {"omega": {"unit": "rad/s", "expression": "omega"}}})
