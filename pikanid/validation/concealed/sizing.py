"""The size at which an effect is as visible as wanted."""

from __future__ import annotations

import numpy as np

from pikanid import errors
from pikanid.validation.concealed.arrays import Array
from pikanid.validation.concealed.effect import Shape
from pikanid.validation.concealed.experiment import Experiment
from pikanid.validation.concealed.fisher import sensitivities, unexplained
from pikanid.validation.concealed.noise import Noise
from pikanid.validation.concealed.rig import Rig
from pikanid.validation.concealed.simulate import measured

# Distance of the nominal model that is aimed at: from hardly detectable to gross [σ].
FAINTEST, GROSSEST = 2.0, 600.0  # definition: hardly detectable to gross
HALVINGS = 13  # numerical: the size is then known to 1e-4 of its range


def drawn_target(rng: np.random.Generator) -> float:
    """A distance [σ], evenly in its logarithm."""
    return float(np.exp(rng.uniform(np.log(FAINTEST), np.log(GROSSEST))))


def sized(shape: Shape, wanted: float, base: Rig, experiment: Experiment,
          noise: Noise) -> dict[str, float]:
    """Values at which the nominal model misses the effect by about `wanted` σ.

    The distance is that to first order in what a refit of l and d can absorb; where the effect
    cannot reach it, its strongest or faintest size is taken.
    """
    if not shape.effect.quantities:
        return {}
    clean = noise.whitened(measured(base, experiment))
    jacobian = _nominal_sensitivities(base, experiment, noise, clean)

    def distance(share: float) -> float:
        rig = shape.effect.applied(base, shape.sized(share))
        try:
            change = noise.whitened(measured(rig, experiment)) - clean
        except errors.SimulationFailed:
            return float("inf")
        return float(np.sqrt(np.sum(unexplained(jacobian, change) ** 2)))

    low, high = 0.0, 1.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if distance(middle) < wanted:
            low = middle
        else:
            high = middle
    return shape.sized(low)


def _nominal_sensitivities(base: Rig, experiment: Experiment, noise: Noise,
                           clean: Array) -> Array:
    def response(v: Array) -> Array:
        rig = base._replace(length=float(v[0]), damping=float(v[1]))
        return noise.whitened(measured(rig, experiment))

    at = np.array([base.length, base.damping])
    return sensitivities(response, at, clean, np.full(2, np.inf), at)
