"""For every ready-made model an experiment, and its right-hand side written by hand.

The right-hand sides share nothing with the package: equations of motion are solved as they stand in
textbooks, by their mass matrix, and rates count in seconds by plain factors.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
import oracle

import pikanid as pk
from pikanid.model import Model, systems

NOISE = 0.005
MINUTE, HOUR, DAY, YEAR = 60.0, 3600.0, 86400.0, 31557600.0
Values = Mapping[str, float]
Rates = Callable[[np.ndarray, np.ndarray, Values], object]
Start = Callable[[Values], list[float]]


@dataclass(frozen=True)
class Experiment:
    """How a ready-made model is tried: times [s], drives, values that matter, what to compare with.

    Attributes:
        duration: [s].
        samples: Number of sampling intervals.
        levels: Input -> its values, each held for an equal share of the time.
        rates: States x, inputs u (in model order) and parameters p -> dx/dt.
        start: Parameters -> x(0).
        seen: Which states the outputs are.
        values: Parameters that differ from the guesses.
    """

    duration: float
    samples: int
    rates: Rates
    start: Start
    seen: tuple[int, ...]
    levels: Mapping[str, np.ndarray] = field(default_factory=dict)
    values: Values = field(default_factory=dict)

    def model(self, name: str) -> Model:
        """The model at the values of this experiment."""
        return systems.SYSTEMS[name]().with_values(self.values)

    def times(self) -> np.ndarray:
        """Sampling times."""
        return np.linspace(0.0, self.duration, self.samples + 1)

    def drive(self, model: Model) -> pk.Recording:
        """The inputs as a recording; of a model without any, times only."""
        t = self.times()
        held = {name: v[np.minimum(np.arange(len(t)) * len(v) // self.samples, len(v) - 1)]
                for name, v in self.levels.items()}
        names = {i.name: i.unit for i in model.inputs if i.name in held} or {"nothing": ""}
        return pk.Recording.from_arrays(
            t, {name: held.get(name, np.zeros(len(t))) for name in names}, names,
            hold=dict.fromkeys(names, "zero"))

    def recording(self, name: str, seed: int) -> pk.Recording:
        """What sensors with noise of 0.5 % of each output's range would record."""
        truth = self.model(name)
        clean = pk.simulate(truth, self.drive(truth))
        sigma = {o: NOISE * float(np.ptp(clean[o].values)) for o in truth.output_names}
        return pk.simulate(truth, self.drive(truth), sigma=sigma, seed=seed)

    def guess(self, name: str) -> Model:
        """The model with all that is free a twentieth off."""
        truth = self.model(name)
        return truth.with_values({n: 1.05 * truth.values[n] for n in truth.free_names})

    def reference(self, model: Model) -> np.ndarray:
        """Outputs (samples + 1, q) by an integrator that starts afresh wherever an input jumps."""
        t, p = self.times(), model.values
        drive = self.drive(model)
        signals = []
        for item in model.inputs:
            values = drive[item.name].values if item.name in drive else np.zeros(len(t))
            new = np.concatenate([[True], np.diff(values) != 0])
            signals.append(oracle.Signal(t[new], values[new]))
        path = oracle.simulate(lambda _, x, u, s: np.asarray(self.rates(x, u, p)), self.start(p), t,
                               signals, max_step=np.inf)
        return path.x[:, list(self.seen)]


def levels(seed: int, low: float, high: float, count: int = 20) -> np.ndarray:
    """Random levels (count,) between two limits."""
    return np.random.default_rng(seed).uniform(low, high, count)


def _slosh(x: np.ndarray, v: float, u: float, u_z: float, p: Values) -> float:
    return (u * np.cos(x) - (p["g"] - u_z) * np.sin(x)) / p["l_theta"] - (
        p["d_theta"] / p["m"] * v * np.cos(x) ** 2)


def _cart_pole(x: np.ndarray, u: np.ndarray, p: Values) -> list[float]:
    _, theta, v, w = x
    lever, c, s = p["m_p"] * p["l"], np.cos(theta), np.sin(theta)
    mass = [[p["m_c"] + p["m_p"], lever * c], [lever * c, p["J"] + lever * p["l"]]]
    force = [u[0] - p["b"] * v + lever * w**2 * s, -p["d"] * w - lever * p["g"] * s]
    return [v, w, *np.linalg.solve(mass, force)]


def double_pendulum_mass(q2: float, p: Values) -> np.ndarray:
    """The mass matrix [kg m²] at an elbow angle."""
    h = p["l1"] * p["g2"] * np.cos(q2)
    return np.array([[p["a1"] + p["a2"] + 2 * h, p["a2"] + h], [p["a2"] + h, p["a2"]]])


def _double_pendulum(x: np.ndarray, u: np.ndarray, p: Values) -> list[float]:
    q1, q2, v1, v2 = x
    h = p["l1"] * p["g2"] * np.sin(q2)
    coriolis = np.array([[-2 * h * v2, -h * v2], [h * v1, 0.0]]) @ [v1, v2]
    outer = p["g"] * p["g2"] * np.sin(q1 + q2)
    weight = np.array([p["g"] * p["g1"] * np.sin(q1) + outer, outer])
    torque = np.asarray(u) - [p["b1"] * v1, p["b2"] * v2]
    return [v1, v2, *np.linalg.solve(double_pendulum_mass(q2, p), torque - coriolis - weight)]


def _two_mass(x: np.ndarray, u: np.ndarray, p: Values) -> list[float]:
    spring = np.array([[p["k"], -p["k"]], [-p["k"], p["k"]]])
    damper = np.array([[p["d"] + p["b_m"], -p["d"]], [-p["d"], p["d"] + p["b_l"]]])
    force = np.array([u[0], 0.0]) - spring @ x[:2] - damper @ x[2:]
    return [*x[2:], *(force / [p["J_m"], p["J_l"]])]


def _tanks(x: np.ndarray, u: np.ndarray, p: Values) -> list[float]:
    over = p["k1"] * np.sqrt(max(x[0], 0.0))
    return [p["k4"] * u[0] - over, over - p["k3"] * np.sqrt(max(x[1], 0.0))]


def _zero(n: int) -> Start:
    return lambda p: [0.0] * n


EXPERIMENTS = {
    "sloshing": Experiment(
        4.0, 400, lambda x, u, p: [x[1], _slosh(x[0], x[1], u[0], u[1], p)], _zero(2), (0,),
        {"u_x": levels(1, -2, 2)}),
    "sloshing_2d": Experiment(
        4.0, 400, lambda x, u, p: [x[1], _slosh(x[0], x[1], u[0], u[2], p),
                                   x[3], _slosh(x[2], x[3], u[1], u[2], p)], _zero(4), (0, 2),
        {"u_x": levels(1, -2, 2), "u_y": levels(2, -2, 2)}),
    "pendulum": Experiment(
        4.0, 400, lambda x, u, p: [x[1], -p["g"] / p["l"] * np.sin(x[0]) - p["d"] * x[1]],
        lambda p: [p["theta_0"], p["theta_dot_0"]], (0,),
        values={"theta_0": 1.2, "theta_dot_0": 0.5}),
    "linear_oscillator": Experiment(
        4.0, 400, lambda x, u, p: [x[1], p["b"] * u[0] - 2 * p["zeta"] * p["omega"] * x[1]
                                   - p["omega"] ** 2 * x[0]], _zero(2), (0,),
        {"u": levels(1, -2, 2)}),
    "duffing_oscillator": Experiment(
        4.0, 400, lambda x, u, p: [x[1], p["b"] * u[0] - p["c"] * x[1] - p["k"] * x[0]
                                   - p["k3"] * x[0] ** 3], _zero(2), (0,),
        {"u": levels(1, -60, 60)}),
    "double_pendulum": Experiment(
        3.0, 300, _double_pendulum, lambda p: [p[n] for n in ("q1_0", "q2_0", "v1_0", "v2_0")],
        (0, 1), {"tau1": levels(1, -0.5, 0.5), "tau2": levels(2, -0.5, 0.5)},
        {"q1_0": 0.5, "q2_0": -0.4, "v1_0": 0.2, "v2_0": -0.3}),
    "cart_pole": Experiment(6.0, 300, _cart_pole, _zero(4), (0, 1), {"F": levels(1, -5, 5)}),
    "dc_motor": Experiment(
        1.0, 500, lambda x, u, p: [(u[0] - p["R"] * x[0] - p["k"] * x[1]) / p["L"],
                                   (p["k"] * x[0] - p["b"] * x[1] - u[1]) / p["J"]], _zero(2), (1,),
        {"u": levels(1, -12, 12), "tau": levels(2, -0.02, 0.02, 10)}, {"b": 1e-4}),
    "two_mass_drive": Experiment(3.0, 600, _two_mass, _zero(4), (0, 1), {"tau": levels(1, -1, 1)}),
    "cascaded_tanks": Experiment(
        4000.0, 500, _tanks, lambda p: [p["x1_0"], p["x2_0"]], (1,),
        {"u": levels(1, 0.5, 5.0, 40)}),
    "thermal_rc": Experiment(
        14 * DAY, 672, lambda x, u, p: [(u[0] - x[0]) / (p["R"] * p["C"]) + u[1] / p["C"]],
        lambda p: [p["T_0"]], (0,),
        {"T_a": levels(1, -5, 15, 56), "P": levels(2, 0, 6000, 84)}),
    "batch_reactor": Experiment(
        60 * MINUTE, 120, lambda x, u, p: np.array([
            -p["k1"] * x[0], p["k1"] * x[0] - p["k2"] * x[1], p["k2"] * x[1]]) / MINUTE,
        lambda p: [p["a0"], 0.0, 0.0], (0, 1, 2)),
    "one_compartment": Experiment(
        24 * HOUR, 96, lambda x, u, p: np.array([
            -p["k_a"] * x[0], p["k_a"] * x[0] / p["V"] - p["k_e"] * x[1]]) / HOUR,
        lambda p: [4.02, 0.0], (1,), {"dose": np.array([4.02])}),
    "sir": Experiment(
        20 * DAY, 80, lambda x, u, p: np.array([
            -p["beta"] * x[0] * x[1] / p["N"],
            (p["beta"] * x[0] / p["N"] - p["gamma"]) * x[1], p["gamma"] * x[1]]) / DAY,
        lambda p: [p["N"] - p["I0"], p["I0"], 0.0], (1,)),
    "lotka_volterra": Experiment(
        40 * YEAR, 160, lambda x, u, p: np.array([
            x[0] * (p["alpha"] - p["beta"] * x[1]),
            x[1] * (p["delta"] * x[0] - p["gamma"])]) / YEAR,
        lambda p: [p["prey_0"], p["predators_0"]], (0, 1)),
}
