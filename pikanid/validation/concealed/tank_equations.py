"""Equations of motion of the liquid in a tank, compiled.

State: amplitude and velocity of the three planar modes, then of the J₀ and the J₂ mode [m, m/s].
Lagrange's equations of the energies in `tank`, solved for the accelerations: with P = a_s11 and
Q = a_11s the first mode and the driven modes s obey

    (a₁ + Σ P η_s) η₁'' + η₁ Σ Q η_s'' + η₁' Σ P η_s' = -g η₁ - a_x x₁ - a₁ c₁ η₁' - F sgn η₁'
    a_s η_s'' + Q η₁ η₁'' + (Q - ½P) η₁'² = -g η_s - a_s c_s η_s'.
"""

# mypy: disallow-untyped-defs=False
# Numba infers the types of compiled functions from the call.

from __future__ import annotations

from numba import njit


@njit
def rhs(x, u, p, sign, stuck, dx):
    """Write dx/dt; return the force that the contact line has to hold where it is stuck.

    Args: x (10,); u (4,), u[0] the container's acceleration [m/s²]; p `Tank.settings`; `sign` of
    η₁'; `stuck` at rest; dx (10,) result.
    """
    g, line, push = p[0], p[1], u[0] + p[2]
    for n in range(3):
        a, c, offset = p[3 + n], p[8 + n], p[13 + n]
        dx[2 * n] = x[2 * n + 1]
        dx[2 * n + 1] = -(g * x[2 * n] + push * offset) / a - c * x[2 * n + 1]
    eta, rate = x[0], x[1]
    if stuck:
        rate = 0.0
    mass = p[3]
    force = -g * eta - push * p[13] - p[3] * p[8] * rate
    for s in range(2):
        a, c, big_p, big_q = p[6 + s], p[11 + s], p[16 + 2 * s], p[17 + 2 * s]
        amplitude, velocity = x[6 + 2 * s], x[7 + 2 * s]
        free = ((0.5 * big_p - big_q) * rate * rate - g * amplitude) / a - c * velocity
        mass += big_p * amplitude - big_q * big_q * eta * eta / a
        force -= rate * big_p * velocity + eta * big_q * free
        dx[6 + 2 * s] = velocity
        dx[7 + 2 * s] = free
    if stuck:
        dx[0] = 0.0
        dx[1] = 0.0
    else:
        dx[1] = (force - sign * line) / mass
        for s in range(2):
            dx[7 + 2 * s] -= p[17 + 2 * s] * eta * dx[1] / p[6 + s]
    return force
