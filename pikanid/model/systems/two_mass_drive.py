"""A motor that drives a load through an elastic shaft."""

from __future__ import annotations

from pikanid.model.model import Model


def two_mass_drive() -> Model:
    """A motor and a load joined by an elastic shaft; both angles are measured.

    J_m φ_m'' = τ - b_m φ_m' - s,    J_l φ_l'' = s - b_l φ_l'
    s = k (φ_m - φ_l) + d (φ_m' - φ_l')

    Newton's law for two inertias and a shaft that is a spring and a damper side by side: the
    two-mass model of drives, as in the chapter on compliance and resonance of G. Ellis, Control
    System Design Guide.  All is seen from one side of a gear; τ is the motor's torque.

    >>> two_mass_drive().output_names
    ('phi_m', 'phi_l')
    """
    shaft = "(k*(phi_m - phi_l) + d*(omega_m - omega_l))"
    return Model.from_dict({
        "name": "two_mass_drive",
        "states": {"phi_m": {"unit": "rad"}, "phi_l": {"unit": "rad"},
                   "omega_m": {"unit": "rad/s"}, "omega_l": {"unit": "rad/s"}},
        "inputs": {"tau": {"unit": "N*m"}},
        "parameters": {
            "J_m": {"unit": "kg*m^2", "guess": 0.01, "bounds": [1e-9, 1e5],
                    "description": "inertia of the motor"},
            "J_l": {"unit": "kg*m^2", "guess": 0.03, "bounds": [1e-9, 1e5],
                    "description": "inertia of the load"},
            "k": {"unit": "N*m/rad", "guess": 10.0, "bounds": [1e-6, 1e9],
                  "description": "stiffness of the shaft"},
            "d": {"unit": "N*m*s/rad", "guess": 0.02, "bounds": [0.0, 1e6],
                  "description": "damping of the shaft"},
            "b_m": {"unit": "N*m*s/rad", "guess": 0.01, "bounds": [0.0, 1e6],
                    "description": "viscous friction of the motor"},
            "b_l": {"unit": "N*m*s/rad", "guess": 0.01, "bounds": [0.0, 1e6],
                    "description": "viscous friction of the load"}},
        "equations": {
            "phi_m": "omega_m", "phi_l": "omega_l",
            "omega_m": f"(tau - b_m*omega_m - {shaft})/J_m",
            "omega_l": f"({shaft} - b_l*omega_l)/J_l"},
        "outputs": {"phi_m": {"unit": "rad", "expression": "phi_m"},
                    "phi_l": {"unit": "rad", "expression": "phi_l"}}})
