"""How far a model stays from a recording without noise, whatever its parameters are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from pikanid import errors
from pikanid.model import Model
from pikanid.recording import Recording
from pikanid.validation.concealed.arrays import Array
from pikanid.validation.own_model.plant import Plant

STEP = 1e-5  # numerical: relative, of a finite difference through the simulator
MOST_FITS = 12  # numerical: evaluations of a rival's refit, each with a Jacobian
ENOUGH = 1e-3  # numerical: relative, of χ²: a step that changes it by less ends a rival's refit
# of a refit without what hides, along valleys that its absence opens
MOST_SURE, SURE = 60, 1e-5  # numerical: the same
FAR = 1e6  # numerical: [σ] in place of a residual of a motion that diverges


@dataclass(frozen=True, eq=False)
class Scene:
    """An experiment with the noise of its outputs.

    Attributes:
        experiment: Inputs.
        sigma: Standard deviation of each output.
    """

    experiment: Recording
    sigma: Mapping[str, float]

    def whitened(self, outputs: Mapping[str, Array]) -> Array:
        """(rows,) all outputs, each over its noise."""
        return np.concatenate([outputs[n] / s for n, s in self.sigma.items()])


@dataclass(frozen=True, eq=False)
class Fit:
    """A refit: distance [σ] and values of what was free."""

    distance: float
    values: Mapping[str, float]


def sensitivities(plant: Plant, scene: Scene, values: Mapping[str, float], names: Sequence[str],
                  clean: Array) -> Array:
    """(rows, n) derivatives of the whitened outputs, in relative steps of each parameter.

    Raises:
        SimulationFailed: If the motion diverges.
    """
    columns = []
    for name in names:
        step = STEP * (abs(values[name]) or 1.0)
        moved = scene.whitened(plant.outputs({**values, name: values[name] + step},
                                             scene.experiment))
        columns.append((moved - clean) / STEP)
    return np.column_stack(columns)


def beyond(change: Array, directions: Array) -> tuple[float, Array]:
    """Length of what is left of a change [σ] when it is projected on directions (rows, n), and how
    far (n,) it goes along them.
    """
    scale = np.linalg.norm(directions, axis=0)
    scale = np.where(scale > 0, scale, 1.0)
    steps = np.linalg.lstsq(directions / scale, change, rcond=1e-9)[0] / scale
    return float(np.linalg.norm(change - directions @ steps)), steps


def refit(model: Model, scene: Scene, truth: Array, starts: Sequence[Mapping[str, float]],
          free: Sequence[str], sure: bool = False) -> Fit:
    """The least-squares distance of a model from a truth (rows,) without noise.

    Args:
        model: Whatever explains.
        scene: Experiment and noise.
        truth: Whitened.
        starts: Values of all parameters that are not the model's own; the nearest one is taken, or
            each where that is to be `sure`: one may lead into a minimum of its own.
        free: Names of those that are fitted, within their bounds.
        sure: Whether to go on along a valley, however long.
    """
    plant = Plant(model, under_way=True)
    bounds = {p.name: p.bounds for p in model.parameters}
    low, high = (np.array([bounds[n][k] for n in free]) for k in (0, 1))

    def residual(values: Mapping[str, float]) -> Array:
        try:
            return scene.whitened(plant.outputs(values, scene.experiment)) - truth
        except errors.SimulationFailed:
            return np.full(len(truth), FAR)

    within = [{**s, **dict(zip(free, np.clip([s[n] for n in free], low, high), strict=True))}
              for s in starts]
    begun = within if sure else [min(within, key=lambda s: float(np.linalg.norm(residual(s))))]

    def descended(start: Mapping[str, float]) -> Fit:
        x = np.array([start[n] for n in free])
        scale = np.where(x != 0, np.abs(x), 1.0)

        def at(z: Array) -> dict[str, float]:
            return {**start, **dict(zip(free, (z * scale).tolist(), strict=True))}

        def left(z: Array) -> Array:
            return residual(at(z))

        inside = np.clip(x / scale, low / scale, high / scale)
        inside = np.where(inside == low / scale, inside + 1e-6, inside)
        inside = np.where(inside >= high / scale, high / scale - 1e-6, inside)
        found = least_squares(
            left, inside, bounds=(low / scale, high / scale),
            diff_step=np.full(len(free), STEP), ftol=SURE if sure else ENOUGH,
            max_nfev=MOST_SURE if sure else MOST_FITS)
        return Fit(float(np.sqrt(2 * found.cost)), at(found.x))

    return min((descended(start) for start in begun), key=lambda fit: fit.distance)
