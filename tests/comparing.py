"""Comparison of the simulator with hand-written references, values and sensitivities."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import interpreted
import numpy as np
from oracle import derivative

from pikanid.model import Model
from pikanid.recording import Recording
from pikanid.simulation.simulator import MethodChoice, Steps

SIGMA = 0.1 * np.pi / 180  # the noise of the study [rad]
Reference = Callable[[Mapping[str, float]], np.ndarray]


@dataclass(frozen=True)
class Comparison:
    """Ours beside the reference: outputs (rows,), and their derivative along one direction in p."""

    ours: np.ndarray
    reference: np.ndarray
    slope: np.ndarray
    reference_slope: np.ndarray
    steps: Steps

    @property
    def error(self) -> float:
        """Largest deviation of the outputs."""
        return float(np.abs(self.ours - self.reference).max())

    @property
    def slope_error(self) -> float:
        """Largest deviation of the derivative, relative to its largest value."""
        scale = np.abs(self.reference_slope).max()
        return float(np.abs(self.slope - self.reference_slope).max() / scale)


def compare(model: Model, recording: Recording, reference: Reference, *,
            t: np.ndarray | None = None, direction: Mapping[str, float] | None = None,
            tolerance: float = 0.01 * SIGMA / 20, method: MethodChoice = "auto",
            step: float = 1e-4, compiled: bool = False) -> Comparison:
    """Simulate by both ways, and differentiate along `direction` (relative changes by name).

    The default direction moves every free parameter, each by another share, so that no column
    of the sensitivities can be wrong unnoticed.  `step` is the relative step of the differences;
    the
    default tolerance is what a fit of 400 samples at `SIGMA` asks for.
    """
    from pikanid.problem.problem import bind
    from pikanid.simulation.simulator import Simulator
    from pikanid.simulation.synthetic import with_outputs

    simulator = (Simulator(model, bind(model, with_outputs(model, recording, t))) if compiled
                 else interpreted.simulator(model, recording, t))
    names = list(model.parameter_names)
    p = np.array(list(model.values.values()))
    if direction is None:
        shares = np.random.default_rng(7).uniform(0.3, 1.0, len(names))
        direction = {n: s * (model.values[n] or 0.1)
                     for n, s in zip(names, shares, strict=True) if n in model.free_names}
    active = np.array([names.index(n) for n in direction], dtype=np.int64)
    steps = simulator.choose_steps(p, tolerance, method)
    response = simulator.run(p, active, steps)
    assert response.finished

    def along(h: float) -> np.ndarray:
        return reference({**model.values, **{n: model.values[n] + h * v
                                             for n, v in direction.items()}})

    slope = response.sensitivity @ np.array(list(direction.values())) if direction else (
        np.zeros(len(response.y)))
    expected = derivative(along, 0.0, step) if direction else np.ones(len(response.y))
    return Comparison(response.y, along(0.0), slope, expected, steps)
