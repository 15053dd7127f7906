"""An arm of two joints with a motor in each: double pendulum, acrobot, pendubot."""

from __future__ import annotations

from pikanid.model.model import Model


def double_pendulum() -> Model:
    """A driven arm of two rigid links with viscous joints; both angles are measured.

    M(q) q'' + c(q, q') + G(q) = (τ1 - b1 q1', τ2 - b2 q2') with h = l1 g2 and

    M = [[a1 + a2 + 2 h cos q2, a2 + h cos q2], [a2 + h cos q2, a2]]
    c = [-h sin q2 (2 q1' q2' + q2'²), h sin q2 q1'²]
    G = g [g1 sin q1 + g2 sin(q1 + q2), g2 sin(q1 + q2)]

    R. Tedrake, Underactuated Robotics, chapter "Acrobots, Cart-Poles, and Quadrotors", with what
    angles and torques can tell in place of masses, lengths and inertias.  q1 = q2 = 0 hangs down,
    q2 is counted from the first link.  Guesses are those of the rig of F. Wiebe et al., Open-source
    dual-purpose acrobot and pendubot platform, IEEE Robotics & Automation Magazine (2023).

    >>> double_pendulum().output_names
    ('q1', 'q2')
    """
    lever = "l1*g2"
    m11, m12 = f"(a1 + a2 + 2*{lever}*cos(q2))", f"(a2 + {lever}*cos(q2))"
    f1 = (f"(tau1 - b1*v1 + {lever}*sin(q2)*(2*v1*v2 + v2**2)"
          " - g*(g1*sin(q1) + g2*sin(q1 + q2)))")
    f2 = f"(tau2 - b2*v2 - {lever}*sin(q2)*v1**2 - g*g2*sin(q1 + q2))"
    determinant = f"({m11}*a2 - {m12}**2)"
    start = {"initial": "free"}
    return Model.from_dict({
        "name": "double_pendulum",
        "states": {"q1": {"unit": "rad", **start}, "q2": {"unit": "rad", **start},
                   "v1": {"unit": "rad/s", **start}, "v2": {"unit": "rad/s", **start}},
        "inputs": {"tau1": {"unit": "N*m", "default": 0.0},
                   "tau2": {"unit": "N*m", "default": 0.0}},
        "parameters": {
            "a1": {"unit": "kg*m^2", "guess": 0.055, "bounds": [0.005, 0.5],
                   "description": "I1 + m2 l1^2, I1 about the first joint"},
            "a2": {"unit": "kg*m^2", "guess": 0.05, "bounds": [0.002, 0.3],
                   "description": "I2 about the second joint"},
            "g1": {"unit": "kg*m", "guess": 0.23, "bounds": [0.02, 1.0],
                   "description": "m1 r1 + m2 l1"},
            "g2": {"unit": "kg*m", "guess": 0.16, "bounds": [0.02, 0.6],
                   "description": "m2 r2"},
            "b1": {"unit": "N*m*s", "guess": 0.02, "bounds": [0.0, 1.0],
                   "description": "viscous friction of the first joint"},
            "b2": {"unit": "N*m*s", "guess": 0.02, "bounds": [0.0, 1.0],
                   "description": "viscous friction of the second joint"},
            "l1": {"unit": "m", "value": 0.2, "description": "length of the first link"},
            "g": {"unit": "m/s^2", "value": 9.81, "description": "gravity"}},
        "equations": {
            "q1": "v1", "q2": "v2",
            "v1": f"(a2*{f1} - {m12}*{f2})/{determinant}",
            "v2": f"({m11}*{f2} - {m12}*{f1})/{determinant}"},
        "outputs": {"q1": {"unit": "rad", "expression": "q1"},
                    "q2": {"unit": "rad", "expression": "q2"}}})
