"""Liquid sloshing in a moved container: the pendulum analogy.

Eq. (6) of "Physics-Informed Parameter Identification: From Splines to Kolmogorov-Arnold Networks":

    θ'' = u_x/l cos θ - (g - u_z)/l sin θ - d/m θ' cos² θ

with the container's accelerations u_x, u_z [m/s²] and the angle θ [rad] of the liquid surface.
"""

from __future__ import annotations

from pikanid.model.model import Model

_PARAMETERS = {
    "l_theta": {"unit": "m", "guess": 0.045, "bounds": [0.002, 2.0],
                "description": "pendulum length: the natural frequency is sqrt(g/l)"},
    "d_theta": {"unit": "N*s/m", "guess": 0.15, "bounds": [0.0, 20.0],
                "description": "viscous damping, lumped in the angular coordinate"},
    "m": {"unit": "kg", "value": 0.30, "description": "oscillating mass"},
    "g": {"unit": "m/s^2", "value": 9.81, "description": "gravity"},
}  # definition: the laboratory's glass of water


def sloshing() -> Model:
    """The slosh pendulum of Eq. (6) along x; the surface angle θ is measured.

    Guesses are the reference values l_theta = 0.045 m and d_theta = 0.15 N s/m; m = 0.30 kg and
    g = 9.81 m/s² are fixed.  An input u_z that is not recorded counts as 0.

    >>> sloshing().free_names
    ('l_theta', 'd_theta')
    """
    return Model.from_dict({
        "name": "sloshing",
        "states": {"theta": {"unit": "rad"}, "theta_dot": {"unit": "rad/s"}},
        "inputs": {"u_x": {"unit": "m/s^2"}, "u_z": {"unit": "m/s^2", "default": 0.0}},
        "parameters": _PARAMETERS,
        "equations": {
            "theta": "theta_dot",
            "theta_dot": "u_x/l_theta*cos(theta) - (g - u_z)/l_theta*sin(theta)"
                         " - d_theta/m*theta_dot*cos(theta)**2"},
        "outputs": {"theta": {"unit": "rad", "expression": "theta"}}})


def sloshing_2d() -> Model:
    """Two slosh pendulums side by side, along x and y, that share l_theta, d_theta, m and g.

    The planar extension named in the paper's Section III, for small coupling between the axes;
    inputs u_y and u_z count as 0 where they are not recorded.
    """
    def axis(angle: str, drive: str) -> str:
        return (f"{drive}/l_theta*cos({angle}) - (g - u_z)/l_theta*sin({angle})"
                f" - d_theta/m*{angle}_dot*cos({angle})**2")

    return Model.from_dict({
        "name": "sloshing_2d",
        "states": {"theta": {"unit": "rad"}, "theta_dot": {"unit": "rad/s"},
                   "phi": {"unit": "rad"}, "phi_dot": {"unit": "rad/s"}},
        "inputs": {"u_x": {"unit": "m/s^2"}, "u_y": {"unit": "m/s^2", "default": 0.0},
                   "u_z": {"unit": "m/s^2", "default": 0.0}},
        "parameters": _PARAMETERS,
        "equations": {"theta": "theta_dot", "theta_dot": axis("theta", "u_x"),
                      "phi": "phi_dot", "phi_dot": axis("phi", "u_y")},
        "outputs": {"theta": {"unit": "rad", "expression": "theta"},
                    "phi": {"unit": "rad", "expression": "phi"}}})
