"""Second-order oscillators: linear, Duffing, and the viscous pendulum."""

from __future__ import annotations

from pikanid.model.model import Model


def linear_oscillator() -> Model:
    """x'' = b u - 2 ζ ω x' - ω² x, with x measured.

    >>> linear_oscillator().state_names
    ('x', 'x_dot')
    """
    return Model.from_dict({
        "name": "linear_oscillator",
        "states": {"x": {"unit": "m"}, "x_dot": {"unit": "m/s"}},
        "inputs": {"u": {"unit": "N"}},
        "parameters": {
            "omega": {"unit": "rad/s", "guess": 6.0, "bounds": [1e-3, 1e5],
                      "description": "natural frequency"},
            "zeta": {"guess": 0.05, "bounds": [0.0, 5.0], "description": "damping ratio"},
            "b": {"unit": "1/kg", "guess": 1.0, "description": "input gain"}},
        "equations": {"x": "x_dot", "x_dot": "b*u - 2*zeta*omega*x_dot - omega**2*x"},
        "outputs": {"x": {"unit": "m", "expression": "x"}}})


def duffing_oscillator() -> Model:
    """x'' = b u - c x' - k x - k3 x³, with x measured."""
    return Model.from_dict({
        "name": "duffing_oscillator",
        "states": {"x": {"unit": "m"}, "x_dot": {"unit": "m/s"}},
        "inputs": {"u": {"unit": "N"}},
        "parameters": {
            "k": {"unit": "1/s^2", "guess": 36.0, "bounds": [0.0, 1e9],
                  "description": "linear stiffness over mass"},
            "k3": {"unit": "1/(m^2*s^2)", "guess": 10.0,
                   "description": "cubic stiffness over mass"},
            "c": {"unit": "1/s", "guess": 0.6, "bounds": [0.0, 1e4],
                  "description": "damping over mass"},
            "b": {"unit": "1/kg", "guess": 1.0, "description": "input gain"}},
        "equations": {"x": "x_dot", "x_dot": "b*u - c*x_dot - k*x - k3*x**3"},
        "outputs": {"x": {"unit": "m", "expression": "x"}}})


def pendulum() -> Model:
    """A free viscous pendulum, θ'' = -g/l sin θ - d θ', started from an estimated state."""
    return Model.from_dict({
        "name": "pendulum",
        "states": {"theta": {"unit": "rad", "initial": "free"},
                   "theta_dot": {"unit": "rad/s", "initial": "free"}},
        "parameters": {
            "l": {"unit": "m", "guess": 0.25, "bounds": [0.005, 100.0],
                  "description": "equivalent length"},
            "d": {"unit": "1/s", "guess": 0.1, "bounds": [0.0, 100.0],
                  "description": "viscous damping over inertia"},
            "g": {"unit": "m/s^2", "value": 9.81, "description": "gravity"}},
        "equations": {"theta": "theta_dot", "theta_dot": "-g/l*sin(theta) - d*theta_dot"},
        "outputs": {"theta": {"unit": "rad", "expression": "theta"}}})
