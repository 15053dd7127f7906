"""A pole that swings on a driven cart: the crane, and the inverted pendulum."""

from __future__ import annotations

from pikanid.model.model import Model


def cart_pole() -> Model:
    """A pole on a cart that a force F moves; cart position x and pole angle θ are measured.

    (m_c + m_p) x'' + m_p l (θ'' cos θ - θ'² sin θ) = F - b x'
    m_p l x'' cos θ + (J + m_p l²) θ'' + m_p g l sin θ = -d θ'

    R. Tedrake, Underactuated Robotics, chapter "Acrobots, Cart-Poles, and Quadrotors", with viscous
    friction added; θ = 0 hangs down and counts positive towards positive x.  With the pole's
    inertia J about its own centre of mass fixed at 0 it is a point mass at distance l; give a
    uniform rod of length 2 l its m_p l²/3.  J cannot be told from the masses and l: it must be
    known.

    >>> cart_pole().free_names
    ('m_c', 'm_p', 'l', 'b', 'd')
    """
    inertia, lever = "(J + m_p*l**2)", "m_p*l*cos(theta)"
    push = "(F - b*x_dot + m_p*l*theta_dot**2*sin(theta))"
    turn = "(-d*theta_dot - m_p*g*l*sin(theta))"
    determinant = f"((m_c + m_p)*{inertia} - ({lever})**2)"
    return Model.from_dict({
        "name": "cart_pole",
        "states": {"x": {"unit": "m"}, "theta": {"unit": "rad"},
                   "x_dot": {"unit": "m/s"}, "theta_dot": {"unit": "rad/s"}},
        "inputs": {"F": {"unit": "N"}},
        "parameters": {
            "m_c": {"unit": "kg", "guess": 1.0, "bounds": [1e-3, 1e5],
                    "description": "mass of the cart"},
            "m_p": {"unit": "kg", "guess": 0.2, "bounds": [1e-4, 1e5],
                    "description": "mass of the pole"},
            "l": {"unit": "m", "guess": 0.3, "bounds": [0.005, 100.0],
                  "description": "from the joint to the pole's centre of mass"},
            "b": {"unit": "N*s/m", "guess": 0.5, "bounds": [0.0, 1e5],
                  "description": "viscous friction of the cart"},
            "d": {"unit": "N*m*s", "guess": 0.002, "bounds": [0.0, 1e4],
                  "description": "viscous friction of the joint"},
            "J": {"unit": "kg*m^2", "value": 0.0,
                  "description": "inertia of the pole about its centre of mass"},
            "g": {"unit": "m/s^2", "value": 9.81, "description": "gravity"}},
        "equations": {
            "x": "x_dot", "theta": "theta_dot",
            "x_dot": f"({inertia}*{push} - {lever}*{turn})/{determinant}",
            "theta_dot": f"((m_c + m_p)*{turn} - {lever}*{push})/{determinant}"},
        "outputs": {"x": {"unit": "m", "expression": "x"},
                    "theta": {"unit": "rad", "expression": "theta"}}})
