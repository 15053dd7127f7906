"""Non-smooth terms of the slosh pendulum, as model text and written out by hand."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import oracle

from pikanid.model import Model, Parameter, systems
from pikanid.recording import Recording, excitation

G = 9.81
Values = Mapping[str, float]


@dataclass(frozen=True)
class Term:
    """A term of θ'' as model text, and the same by hand: force(t, x, u, s, p), guards(p)."""

    text: str
    values: Values
    force: Callable[..., float]
    guards: Callable[[Values], Sequence[oracle.Guard]] = lambda p: ()
    start: tuple[float, float] = (0.0, 0.0)
    drive: str = "pulses"
    accuracy: float = 5e-5  # of the sensitivities, relative to the largest
    look: float = 0.02  # longest time between two looks of the reference at its guards
    step: float = 1e-4  # of the differences that sensitivities are compared with


def velocity(t: float, x: np.ndarray, u: np.ndarray) -> float:
    return float(x[1])


def at_angle(name: str, sign: float = 1.0) -> Callable[[Values], list[oracle.Guard]]:
    return lambda p: [lambda t, x, u: x[0] - sign * p[name]]


def both_sides(name: str, of: int) -> Callable[[Values], list[oracle.Guard]]:
    return lambda p: [lambda t, x, u: x[of] + p[name], lambda t, x, u: x[of] - p[name]]


def limited(x: float, level: float, s: np.ndarray) -> float:
    """clip(x, -level, level) by the signs of x + level and x - level."""
    return level if s[1] > 0 else (-level if s[0] < 0 else x)


TERMS = {
    "coulomb": Term("-mu*sign(theta_dot)", {"mu": 2.0}, lambda t, x, u, s, p: -p["mu"] * s[0],
                    lambda p: [velocity]),
    "stribeck": Term(
        "-(mu + more*exp(-(theta_dot/vs)**2))*sign(theta_dot)",
        {"mu": 1.0, "more": 0.8, "vs": 0.3},
        lambda t, x, u, s, p: -(p["mu"] + p["more"] * np.exp(-((x[1] / p["vs"]) ** 2))) * s[0],
        lambda p: [velocity]),
    "quadratic drag": Term("-c*abs(theta_dot)*theta_dot", {"c": 0.6},
                           lambda t, x, u, s, p: -p["c"] * s[0] * x[1] * x[1],
                           lambda p: [velocity]),
    "power 1.5": Term("-c*signed_power(theta_dot, n)", {"c": 0.6, "n": 1.5},
                      lambda t, x, u, s, p: -p["c"] * s[0] * abs(x[1]) ** p["n"],
                      lambda p: [velocity]),
    # below 1 the slope at zero velocity is infinite: any one-step method loses its order there
    "power 0.6": Term("-c*signed_power(theta_dot, n)", {"c": 0.6, "n": 0.6},
                      lambda t, x, u, s, p: -p["c"] * s[0] * abs(x[1]) ** p["n"],
                      lambda p: [velocity], accuracy=3e-2),
    "even power": Term("-c*abs_power(theta_dot, n)", {"c": 0.6, "n": 1.5},
                       lambda t, x, u, s, p: -p["c"] * abs(x[1]) ** p["n"],
                       lambda p: [velocity]),
    "dead zone": Term("-k*dead_zone(theta, w)", {"k": 150.0, "w": 0.05},
                      lambda t, x, u, s, p: -p["k"] * (x[0] - limited(x[0], p["w"], s)),
                      both_sides("w", 0)),
    "clipped feedback": Term("-c*clip(theta_dot, -level, level)", {"c": 3.0, "level": 0.8},
                             lambda t, x, u, s, p: -p["c"] * limited(x[1], p["level"], s),
                             both_sides("level", 1)),
    "stop": Term("-k*max(theta - wall, 0)", {"k": 2e4, "wall": 0.08},
                 lambda t, x, u, s, p: -p["k"] * (x[0] - p["wall"]) * (s[0] > 0),
                 at_angle("wall")),
    # smooth enough to be stepped over
    "stiffening stop": Term("-k*max(theta - wall, 0)**3", {"k": 2e6, "wall": 0.08},
                            lambda t, x, u, s, p: -p["k"] * max(x[0] - p["wall"], 0.0) ** 3,
                            at_angle("wall")),
    "stop with damper": Term(
        "-(k*(theta - wall) + c*theta_dot)*step(theta - wall)",
        {"k": 2e4, "wall": 0.08, "c": 20.0},
        lambda t, x, u, s, p: -(p["k"] * (x[0] - p["wall"]) + p["c"] * x[1]) * (1 + s[0]) / 2,
        at_angle("wall")),
    "preload": Term("-k*sign(theta)", {"k": 8.0}, lambda t, x, u, s, p: -p["k"] * s[0],
                    lambda p: [lambda t, x, u: x[0]], start=(0.15, 0.0)),
    "switching time": Term("-push*step(t - t1)", {"push": 4.0, "t1": 0.71},
                           lambda t, x, u, s, p: -p["push"] * (1 + s[0]) / 2,
                           lambda p: [lambda t, x, u: t - p["t1"]]),
    # two instants that meet: the derivative has a kink there, so that differences must be small
    "switching time at a pulse": Term(
        "-push*step(t - t1)", {"push": 4.0, "t1": 0.6},
        lambda t, x, u, s, p: -p["push"] * (1 + s[0]) / 2,
        lambda p: [lambda t, x, u: t - p["t1"]], accuracy=1e-4, step=1e-5),
    "window": Term("-push*(step(t - t1) - step(t - t2))", {"push": 4.0, "t1": 0.71, "t2": 0.7151},
                   lambda t, x, u, s, p: -p["push"] * (s[0] - s[1]) / 2,
                   lambda p: [lambda t, x, u: t - p["t1"], lambda t, x, u: t - p["t2"]]),
    "nested": Term("-c*abs(max(theta_dot, -a*theta))*min(theta, b)",
                   {"c": 60.0, "a": 3.0, "b": 0.03},
                   lambda t, x, u, s, p: -p["c"] * abs(
                       x[1] if s[0] > 0 else -p["a"] * x[0]) * (p["b"] if s[1] > 0 else x[0]),
                   lambda p: [lambda t, x, u: x[1] + p["a"] * x[0],
                              lambda t, x, u: x[0] - p["b"],
                              lambda t, x, u: max(x[1], -p["a"] * x[0])]),
    "belt": Term("-mu*sign(theta_dot - u_x)", {"mu": 9.0},
                 lambda t, x, u, s, p: -p["mu"] * s[0],
                 lambda p: [lambda t, x, u: x[1] - u[0]], drive="wave", look=2e-3,
                 accuracy=1e-4, step=1e-5),
    "curved belt": Term("-mu*sign(theta_dot - a*sin(w*t))", {"mu": 12.0, "a": 0.7, "w": 5.0},
                        lambda t, x, u, s, p: -p["mu"] * s[0],
                        lambda p: [lambda t, x, u: x[1] - p["a"] * np.sin(p["w"] * t)],
                        accuracy=1e-4, step=1e-5),
    "sign of the input": Term("-push*sign(u_x)", {"push": 4.0},
                              lambda t, x, u, s, p: -p["push"] * np.sign(u[0])),
    "zero-order belt": Term("-mu*sign(theta_dot - u_x)", {"mu": 40.0},
                 lambda t, x, u, s, p: -p["mu"] * s[0],
                 lambda p: [lambda t, x, u: x[1] - u[0]], accuracy=1e-4, step=1e-5),
    "limited ramp": Term("c*clip(u_x, -level, level)", {"c": 30.0, "level": 0.313},
                         lambda t, x, u, s, p: p["c"] * np.clip(u[0], -p["level"], p["level"]),
                         lambda p: [lambda t, x, u: u[0] + p["level"],
                                    lambda t, x, u: u[0] - p["level"]], drive="wave"),
}


def drive(name: str, dt: float = 0.02, duration: float = 2.0) -> Recording:
    if name == "pulses":
        return excitation.two_pulse(duration, dt)
    t = excitation.grid(duration, dt)
    return Recording.from_arrays(t, {"u_x": 0.6 * np.sin(4 * t) + 0.2 * np.sin(11 * t)},
                                 {"u_x": "m/s^2"}, hold={"u_x": "first"})


def slosh(term: Term) -> Model:
    parameters = [Parameter(n, v) for n, v in term.values.items()]
    return systems.sloshing().with_initial(
        theta=term.start[0], theta_dot=term.start[1]).with_term("theta_dot", term.text, parameters)


def by_hand(term: Term, recording: Recording, t: np.ndarray) -> Callable[[Values], np.ndarray]:
    channel = recording["u_x"]
    signal = oracle.Signal(channel.time, channel.values, channel.hold or "zero")

    def outputs(p: Values) -> np.ndarray:
        length, damping = p["l_theta"], p["d_theta"] / p["m"]

        def rhs(t: float, x: np.ndarray, u: np.ndarray, s: np.ndarray) -> list[float]:
            swing = u[0] / length * np.cos(x[0]) - G / length * np.sin(x[0])
            return [x[1], swing - damping * x[1] * np.cos(x[0]) ** 2
                    + term.force(t, x, u, s, p)]

        return oracle.simulate(rhs, term.start, t, [signal], term.guards(p),
                               max_step=term.look).x[:, 0]

    return outputs
