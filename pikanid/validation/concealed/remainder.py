"""What is left beside hidden effects: laws of no catalogue, as large as a share of their misfit.

The misfit that the hidden effects cause is the distance of the refitted nominal model from the rig
that has them and nothing else.  The remainder's is the distance of the whole truth from that rig,
refitted in l and d: what the laws leave beside the effects.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pikanid import errors
from pikanid.validation.concealed.arrays import Array
from pikanid.validation.concealed.candidate import (
    BASE_HIGH,
    BASE_LOW,
    BASE_SCALE,
    Candidate,
    nominal_fit,
)
from pikanid.validation.concealed.effect import Effect, Scales
from pikanid.validation.concealed.experiment import Experiment
from pikanid.validation.concealed.fisher import refit
from pikanid.validation.concealed.noise import Noise
from pikanid.validation.concealed.rig import Rig
from pikanid.validation.concealed.simulate import measured
from pikanid.validation.concealed.sizing import sized

LEAST, MOST = 0.05, 0.30  # definition: shares of a remainder
ROUNDS, CLOSE = 4, 0.1  # numerical: secant steps, and the error of a share that does


@dataclass(frozen=True)
class Remainder:
    """What was drawn.

    Attributes:
        values: Quantities of each law.
        rig: With the hidden effects and the laws, in the train recording.
        share: Of the hidden effects' misfit that is left beside them after a refit of l and d.
        left: The same after a refit of the effects' quantities as well.
    """

    values: tuple[Mapping[str, float], ...]
    rig: Rig
    share: float
    left: float


def drawn(laws: Sequence[Effect], hidden: Rig, base: Rig, effects: Sequence[Effect],
          sizes: Sequence[Mapping[str, float]], experiment: Experiment, scales: Scales,
          noise: Noise, rng: np.random.Generator) -> Remainder:
    """Laws that together leave a share between `LEAST` and `MOST`, drawn evenly.

    Args:
        laws: At least one.
        hidden: The rig with the hidden effects.
        base: The rig without them.
        effects: The hidden ones.
        sizes: Quantities of each.
        experiment: The train recording's.
        scales: Of the case.
        noise: That it is seen through.
        rng: Source of all that is random.

    Raises:
        SimulationFailed: If these laws cannot leave that much in this experiment.
    """
    wanted = float(rng.uniform(LEAST, MOST))
    parts = np.sqrt(rng.dirichlet(np.ones(len(laws))))
    shapes = [law.drawn(rng, scales) for law in laws]
    caused = nominal_fit(
        noise.whitened(measured(hidden, experiment)), experiment, noise, base).distance
    targets = wanted * caused * parts
    for _ in range(ROUNDS):
        values = tuple(sized(shape, float(target), hidden, experiment, noise)
                       for shape, target in zip(shapes, targets, strict=True))
        rig = hidden
        for law, chosen in zip(laws, values, strict=True):
            rig = law.applied(rig, chosen)
        truth = noise.whitened(measured(rig, experiment))
        share = _beside(hidden, truth, experiment, noise) / caused
        if share <= 0.0 or abs(share / wanted - 1) < CLOSE:
            break
        # Laws may add up or cancel, and what is gross is not of first order.
        targets = targets * wanted / share
    if not LEAST <= share <= MOST:
        raise errors.SimulationFailed(errors.conceal_remainder())
    explained = Candidate(tuple(effects), scales, experiment, noise, Rig())
    start = np.array([base.length, base.damping,
                      *(size[q.name] for e, size in zip(effects, sizes, strict=True)
                        for q in e.quantities)])
    return Remainder(values, rig, share, explained.refitted(truth, start).distance / caused)


def _beside(hidden: Rig, truth: Array, experiment: Experiment, noise: Noise) -> float:
    """Distance of a whitened truth (N,) from the rig with the effects, l and d refitted."""
    def response(v: Array) -> Array:
        rig = hidden._replace(length=float(v[0]), damping=float(v[1]))
        return noise.whitened(measured(rig, experiment))

    start = np.array([hidden.length, hidden.damping])
    return refit(response, truth, start, BASE_LOW, BASE_HIGH, BASE_SCALE).distance
