"""The size at which an effect is as visible as wanted."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pikanid import errors
from pikanid.validation.concealed.arrays import Array
from pikanid.validation.concealed.candidate import nominal_fit
from pikanid.validation.concealed.effect import Shape
from pikanid.validation.concealed.experiment import Experiment
from pikanid.validation.concealed.fisher import sensitivities, unexplained
from pikanid.validation.concealed.noise import Noise
from pikanid.validation.concealed.rig import Rig
from pikanid.validation.concealed.simulate import measured

# Distance of the nominal model that is aimed at: from hardly detectable to gross [σ].
FAINTEST, GROSSEST = 2.0, 600.0  # definition: hardly detectable to gross
HALVINGS = 13  # numerical: the size is then known to 1e-4 of its range
# The same where a remainder is left beside the effect: strong, so that both can be seen.
STRONG, STRONGEST = 80.0, 1500.0  # definition: [σ], gross ones
LADDER, RUNGS = np.linspace(0.2, 1.0, 9), 7  # numerical: sizes tried, halvings between two


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

    return shape.sized(_halved(distance, wanted, 0.0, 1.0, HALVINGS)[0])


def strong(shape: Shape, rng: np.random.Generator, base: Rig, experiment: Experiment,
           noise: Noise) -> dict[str, float]:
    """Values at which the refitted nominal model is `STRONG` to `STRONGEST` σ away.

    Evenly in the logarithm of the distance, up to what the effect reaches in this experiment.
    Refitted and not to first order: what brakes hard leaves no motion to be missed, so that the
    distance falls again beyond some size.

    Raises:
        SimulationFailed: If the effect does not even reach `STRONG`.
    """
    def distance(share: float) -> float:
        rig = shape.effect.applied(base, shape.sized(share))
        try:
            truth = noise.whitened(measured(rig, experiment))
            return nominal_fit(truth, experiment, noise, base).distance
        except errors.SimulationFailed:
            return 0.0

    reached = np.array([distance(float(share)) for share in LADDER])
    farthest = min(float(np.max(reached)), STRONGEST)
    if farthest <= STRONG:
        raise errors.SimulationFailed(errors.conceal_faint())
    wanted = float(np.exp(rng.uniform(np.log(STRONG), np.log(farthest))))
    first = int(np.argmax(reached >= wanted))
    below = float(LADDER[first - 1]) if first else 0.0
    return shape.sized(_halved(distance, wanted, below, float(LADDER[first]), RUNGS)[1])


def _halved(distance: Callable[[float], float], wanted: float, low: float, high: float,
            times: int) -> tuple[float, float]:
    """The interval in which a distance reaches what is wanted, halved so many times."""
    for _ in range(times):
        middle = 0.5 * (low + high)
        if distance(middle) < wanted:
            low = middle
        else:
            high = middle
    return low, high


def _nominal_sensitivities(base: Rig, experiment: Experiment, noise: Noise,
                           clean: Array) -> Array:
    def response(v: Array) -> Array:
        rig = base._replace(length=float(v[0]), damping=float(v[1]))
        return noise.whitened(measured(rig, experiment))

    at = np.array([base.length, base.damping])
    return sensitivities(response, at, clean, np.full(2, np.inf), at)
