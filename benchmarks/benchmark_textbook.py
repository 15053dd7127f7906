"""NLS as a textbook has it: SciPy's solver and optimiser, nothing told of inputs or derivatives.

The paper names SciPy's Trust Region Reflective and best of five starts, neither integrator nor
tolerances nor derivatives.  Read plainly that is `solve_ivp` over the whole interval inside
`least_squares` with finite differences.  An adaptive integrator steps over or into the switches of
the input, and its steps change with the parameters: the cost is neither exact nor smooth.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pikanid.objective.shooting import Shooting
from pikanid.problem.problem import Problem
from pikanid.validation.benchmark import files

Array = NDArray[np.float64]
GRAVITY, MASS = 9.81, 0.30
BOUNDS = ([1e-3, 0.0], [2.0, 10.0])
SOLVERS: dict[str, dict[str, Any]] = {
    "RK45, default tolerances": {"method": "RK45"},
    "LSODA, default tolerances": {"method": "LSODA"},
    "LSODA, rtol 1e-6": {"method": "LSODA", "rtol": 1e-6, "atol": 1e-9},
    "RK45, steps of 0.05 s at most": {"method": "RK45", "max_step": 0.05},
}


@dataclass(frozen=True, eq=False)
class Textbook:
    """Estimates (seed, 2) with one solver in one scenario."""

    scenario: str
    solver: str
    estimates: Array


def textbook(scenario_name: str, solver: str, seeds: int) -> Textbook:
    """Best of five starts within ±20 % of the guess, seed after seed."""
    from scipy.optimize import least_squares

    scenario = files.chosen([scenario_name])[0]
    guess = np.array([scenario.fitted.values[p] for p in scenario.true])
    found = []
    for seed in range(seeds):
        y = scenario.recording(seed)["theta"]
        draws = np.random.default_rng(seed).uniform(0.8, 1.2, (4, 2)) * guess
        run = simulation(y.time, **SOLVERS[solver])

        def residual(p: Array, run: Callable[[Array], Array] = run, y: Any = y) -> Array:
            return run(p) - y.values

        ends = [least_squares(residual, start, bounds=BOUNDS, method="trf")
                for start in (guess, *draws)]
        found.append(min(ends, key=lambda end: end.cost).x)
    return Textbook(scenario_name, solver, np.array(found))


def simulation(times: Array, **options: Any) -> Callable[[Array], Array]:
    """Eq. (6) under the pulses of Table II, as a function of (l, d)."""
    from scipy.integrate import solve_ivp

    def u(t: float) -> float:
        return 1.0 if 0.2 <= t < 0.6 else (-1.0 if 1.2 <= t < 1.6 else 0.0)

    def run(p: Array) -> Array:
        length, d = p

        def rhs(t: float, x: Array) -> list[float]:
            return [x[1], (u(t) * np.cos(x[0]) - GRAVITY * np.sin(x[0])) / length
                    - d / MASS * x[1] * np.cos(x[0]) ** 2]

        made = solve_ivp(rhs, (0.0, times[-1]), [0.0, 0.0], t_eval=times, **options)
        return made.y[0] if made.y.shape[1] == times.size else np.full(times.size, 1e3)

    return run


def plain_trf(scenario_name: str, lengths: Array, dampings: Array) -> Array:
    """Ends (d0, l0, 2) of `least_squares` with exact residuals and derivatives, seed 0."""
    from scipy.optimize import least_squares

    scenario = files.chosen([scenario_name])[0]
    problem = Problem(scenario.fitted, scenario.recording(0))
    shooting = Shooting(problem)
    ends = np.full((dampings.size, lengths.size, 2), np.nan)
    for i, d in enumerate(dampings):
        for j, length in enumerate(lengths):
            start = np.array([length, d])
            shooting.choose_steps(start, "fine")
            ends[i, j] = least_squares(shooting.residual, start, jac=shooting.jacobian,
                                       bounds=BOUNDS, method="trf").x
    return ends
