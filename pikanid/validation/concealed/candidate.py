"""A rig with free parameters, adjusted to a truth: what could explain a recording."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np

from pikanid.validation.concealed.arrays import Array
from pikanid.validation.concealed.effect import Effect, Scales
from pikanid.validation.concealed.experiment import Experiment
from pikanid.validation.concealed.fisher import MOST_STEPS, Refit, at, refit
from pikanid.validation.concealed.noise import Noise
from pikanid.validation.concealed.rig import Rig
from pikanid.validation.concealed.simulate import measured

# Of l [m] and d [N s/m].
# Of l [m] and d [N s/m].
BASE_LOW, BASE_HIGH = np.array([0.003, 0.0]), np.array([1.0, 20.0])  # definition: their bounds
BASE_SCALE = np.array([0.005, 0.1])  # definition: a typical change of these


@dataclass(frozen=True)
class Candidate:
    """A rig with free l and d and one or more effects with free quantities."""

    effects: tuple[Effect, ...]
    scales: Scales
    experiment: Experiment
    noise: Noise
    base: Rig

    def response(self, v: Array) -> Array:
        """(N,) whitened response at v = (l, d, quantities of each effect)."""
        return self.noise.whitened(measured(self.rig(v), self.experiment))

    def rig(self, v: Array) -> Rig:
        """The rig at v."""
        rig = self.base._replace(length=float(v[0]), damping=float(v[1]))
        position = 2
        for effect in self.effects:
            values = {}
            for quantity in effect.quantities:
                values[quantity.name] = float(v[position])
                position += 1
            rig = effect.applied(rig, values)
        return rig

    def _columns(self) -> list[tuple[float, float, float]]:
        found = []
        for effect in self.effects:
            for q in effect.quantities:
                unit = self.scales.of(q.relative)
                low, high = (bound * unit for bound in q.bounds)
                typical = abs(q.starts[0] - q.neutral) * unit
                found.append((low, high, typical))
        return found

    def at(self, target: Array, values: Array) -> Refit:
        """As it is at values (p,), not adjusted to a whitened target (N,)."""
        low, high, scale = self._box()
        return at(self.response, target, np.clip(values, low, high), high, scale)

    def refitted(self, target: Array, start: Array, steps: int = MOST_STEPS) -> Refit:
        """Adjusted to a whitened target (N,) in at most so many steps."""
        return refit(self.response, target, start, *self._box(), steps)

    def _box(self) -> tuple[Array, Array, Array]:
        """(p,) lower and upper bounds and scales."""
        low, high, scale = np.array(self._columns()).reshape(-1, 3).T
        return np.r_[BASE_LOW, low], np.r_[BASE_HIGH, high], np.r_[BASE_SCALE, scale]


def starts(effect: Effect, scales: Scales) -> Iterator[Array]:
    """Quantities (k,) from where a fit of an effect may start."""
    choices = [[s * scales.of(q.relative) for s in q.starts] for q in effect.quantities]
    for choice in product(*choices):
        yield np.array(choice, dtype=float)


def nominal_fit(truth: Array, experiment: Experiment, noise: Noise, base: Rig) -> Refit:
    """The nominal pendulum adjusted to a whitened truth (N,), starting at the true l and d."""
    candidate = Candidate((), Scales(1.0, 1.0, 1.0, 1.0), experiment, noise, Rig())
    return candidate.refitted(truth, np.array([base.length, base.damping]))
