"""Hand-written references for the slosh fit, each the way an expert would write it for this model.

They share the problem (Eq. 6, Table II, N = 501, σ = 0.1°), the start [0.06, 0.05] and the
optimiser (MINPACK through `scipy.optimize.least_squares`), and differ in how they integrate and
differentiate.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numba import njit
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

SIGMA = math.radians(0.1)
MASS, GRAVITY, STEP, COUNT = 0.30, 9.81, 0.01, 501
START = np.array([0.06, 0.05])
SWITCHES = ((0.0, 0.2, 0.0), (0.2, 0.6, 1.0), (0.6, 1.2, 0.0), (1.2, 1.6, -1.0), (1.6, 5.0, 0.0))

Simulation = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


@njit(cache=True, error_model="numpy")
def _numba_rk4(length, d, u, y, J):  # type: ignore[no-untyped-def]  # numba infers
    th = om = a0 = a1 = b0 = b1 = 0.0
    for i in range(len(u)):
        xs, vs, p0, p1, q0, q1 = th, om, a0, a1, b0, b1
        s0 = s1 = s2 = s3 = s4 = s5 = 0.0
        for stage in range(4):
            s, c = math.sin(xs), math.cos(xs)
            k1 = u[i] / length * c - GRAVITY / length * s - d / MASS * vs * c * c
            f0 = -u[i] / length * s - GRAVITY / length * c + 2.0 * d / MASS * vs * c * s
            f1 = -d / MASS * c * c
            ka = f0 * p0 + f1 * p1 - (u[i] * c - GRAVITY * s) / (length * length)
            kb = f0 * q0 + f1 * q1 - vs * c * c / MASS
            w = 1.0 if stage == 0 or stage == 3 else 2.0
            s0 += w * vs
            s1 += w * k1
            s2 += w * p1
            s3 += w * ka
            s4 += w * q1
            s5 += w * kb
            h = STEP * (0.5 if stage < 2 else 1.0)
            xs, vs, p0, p1, q0, q1 = (
                th + h * vs, om + h * k1, a0 + h * p1, a1 + h * ka, b0 + h * q1, b1 + h * kb)
        h = STEP / 6.0
        th, om = th + h * s0, om + h * s1
        a0, a1, b0, b1 = a0 + h * s2, a1 + h * s3, b0 + h * s4, b1 + h * s5
        y[i + 1], J[i + 1, 0], J[i + 1, 1] = th, a0, b0


def pulses() -> np.ndarray:
    """u_x in each of the 500 intervals of Table II."""
    u = np.zeros(COUNT - 1)
    u[20:60], u[120:160] = 1.0, -1.0
    return u


def numba_rk4() -> Simulation:
    """Runge-Kutta on the sample grid with forward sensitivities, written out by hand."""
    u, y, J = pulses(), np.zeros(COUNT), np.zeros((COUNT, 2))

    def simulate(p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        _numba_rk4(p[0], p[1], u, y, J)
        return y, J

    return simulate


def dop853() -> Simulation:
    """SciPy's DOP853, restarted at every switch, state and sensitivities as one system."""
    times = np.arange(COUNT) * STEP

    def simulate(p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        length, d = p

        def field(t: float, z: np.ndarray, u: float) -> list[float]:
            x, v, p0, p1, q0, q1 = z
            s, c = math.sin(x), math.cos(x)
            f0 = -u / length * s - GRAVITY / length * c + 2 * d / MASS * v * c * s
            f1 = -d / MASS * c * c
            return [v, u / length * c - GRAVITY / length * s - d / MASS * v * c * c,
                    p1, f0 * p0 + f1 * p1 - (u * c - GRAVITY * s) / length**2,
                    q1, f0 * q0 + f1 * q1 - v * c * c / MASS]

        z, out = np.zeros(6), np.zeros((COUNT, 6))
        for low, high, u in SWITCHES:
            inside = np.flatnonzero((times > low + 1e-9) & (times <= high + 1e-9))
            found = solve_ivp(field, (low, times[inside[-1]]), z, "DOP853", times[inside],
                              args=(u,), rtol=1e-8, atol=1e-10)
            out[inside] = found.y.T
            z = found.y[:, -1]
        return out[:, 0], out[:, [2, 4]]

    return simulate


def casadi_rk4() -> Simulation:
    """CasADi: symbolic Runge-Kutta mapped over the grid, differentiated algorithmically."""
    import casadi as ca

    x, u, p = ca.SX.sym("x", 2), ca.SX.sym("u"), ca.SX.sym("p", 2)
    c, s = ca.cos(x[0]), ca.sin(x[0])
    field = ca.Function("f", [x, u, p], [ca.vertcat(
        x[1], u / p[0] * c - GRAVITY / p[0] * s - p[1] / MASS * x[1] * c * c)])
    k1 = field(x, u, p)
    k2 = field(x + STEP / 2 * k1, u, p)
    k3 = field(x + STEP / 2 * k2, u, p)
    k4 = field(x + STEP * k3, u, p)
    step = ca.Function("step", [x, u, p], [x + STEP / 6 * (k1 + 2 * k2 + 2 * k3 + k4)])
    q = ca.MX.sym("q", 2)
    states = step.mapaccum(COUNT - 1)(ca.DM.zeros(2), ca.DM(pulses()).T, ca.repmat(q, 1, COUNT - 1))
    y = ca.horzcat(0, states[0, :]).T
    both = ca.Function("both", [q], [y, ca.jacobian(y, q)])

    def simulate(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        out, slopes = both(values)
        return np.asarray(out).ravel(), np.asarray(slopes)

    return simulate


def fit(simulate: Simulation, data: np.ndarray) -> np.ndarray:
    """l and d by Levenberg-Marquardt from START."""
    last: list[np.ndarray] = []

    def residual(p: np.ndarray) -> np.ndarray:
        y, J = simulate(p)
        last[:] = [p.copy(), J]
        return (y - data) / SIGMA

    def jacobian(p: np.ndarray) -> np.ndarray:
        if not last or not np.array_equal(last[0], p):
            residual(p)
        return last[1] / SIGMA

    return least_squares(residual, START, jacobian, method="lm", x_scale="jac",
                         ftol=1e-9, xtol=1e-9, gtol=1e-15).x
