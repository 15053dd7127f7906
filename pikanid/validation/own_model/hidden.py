"""A law at the size at which it is as visible as wanted, and what else could explain it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType

import numpy as np

from pikanid import errors
from pikanid.model import Model
from pikanid.recording import Recording
from pikanid.validation.concealed.arrays import Array
from pikanid.validation.concealed.visibility import FROM_NOMINAL, FROM_RIVAL
from pikanid.validation.own_model.distance import Fit, Scene, beyond, refit, sensitivities
from pikanid.validation.own_model.law import Law
from pikanid.validation.own_model.plant import Plant

FAINTEST, GROSSEST = 3.0, 600.0  # definition: [σ] that a law is aimed at
SHARE = 0.15  # definition: RMS of what a law changes, at most, in ranges of the output
LADDER = np.geomspace(1e-4, 1e3, 15)  # numerical: times the guess of a size
HALVINGS = 8  # numerical: of the logarithm between two rungs
SHAPES = 2  # numerical: values of a rival's shape to first order
NOWHERE: Mapping[str, float] = MappingProxyType({})
FULL = 5  # numerical: rivals that are refitted; the nearest one then along any valley


@dataclass(frozen=True, eq=False)
class Hidden:
    """A law with the values of all its parameters."""

    law: Law
    values: Mapping[str, float]


@dataclass(frozen=True, eq=False)
class Workbench:
    """The nominal model at true values in a scene, and what it costs to know there."""

    model: Model
    values: Mapping[str, float]
    scene: Scene

    @cached_property
    def plant(self) -> Plant:
        """The nominal one."""
        return self.simulator([])

    @cached_property
    def clean(self) -> Array:
        """(rows,) whitened outputs without any law."""
        return self.scene.whitened(self.plant.outputs(self.values, self.scene.experiment))

    @cached_property
    def directions(self) -> Array:
        """(rows, n) derivatives to the free parameters."""
        return sensitivities(self.plant, self.scene, self.values, self.model.free_names, self.clean)

    def extended(self, hidden: Sequence[Hidden]) -> Model:
        """The model with laws, at their guesses.

        Raises:
            SimulationFailed: If they cannot be put together: a scale error of a temperature in degC
                and a law that needs it in K.
        """
        model = self.model
        for one in hidden:
            try:
                model = model.with_effect(one.law.effect, self.model)
            except (errors.BadModel, errors.BadUnit) as failure:
                raise errors.SimulationFailed(str(failure)) from None
        return model

    def simulator(self, hidden: Sequence[Hidden]) -> Plant:
        """Of the model with laws; a sensor that is late shows a motion that may be under way."""
        return Plant(self.extended(hidden), under_way=True)

    def at(self, hidden: Sequence[Hidden]) -> dict[str, float]:
        """Values of the free parameters and of those of the laws."""
        return {**self.values, **{n: v for one in hidden for n, v in one.values.items()}}

    def outputs(self, hidden: Sequence[Hidden], experiment: Recording) -> dict[str, Array]:
        """Of the model with laws in an experiment.

        Raises:
            SimulationFailed: If the motion diverges.
        """
        return self.simulator(hidden).outputs(self.at(hidden), experiment)

    def seen(self, hidden: Sequence[Hidden]) -> Array:
        """(rows,) whitened outputs.

        Raises:
            SimulationFailed: If the motion diverges.
        """
        return self.scene.whitened(self.outputs(hidden, self.scene.experiment))

    def missed(self, hidden: Sequence[Hidden]) -> float:
        """Distance of the nominal model [σ], to first order in what it can absorb."""
        return beyond(self.seen(hidden) - self.clean, self.directions)[0]

    def sized(self, law: Law, rng: np.random.Generator) -> Hidden:
        """A law at a size whose distance is drawn evenly in its logarithm.

        Raises:
            SimulationFailed: If it does not reach what is wanted.
        """
        shape, size = law.drawn(rng), law.size
        null = law.effect.null[1]
        signs = [s for s in (1.0, -1.0) if size.bounds[0] <= null + s * 1e-12 <= size.bounds[1]]
        unit = float(rng.choice(signs)) * abs(law.effect.start - null)
        rows = len(self.clean)
        noise = min(s / np.ptp(y) for s, y in zip(
            self.scene.sigma.values(), self.outputs([], self.scene.experiment).values(),
            strict=True))
        most = min(GROSSEST, SHARE / noise * rows**0.5)
        wanted = float(np.exp(rng.uniform(np.log(FAINTEST), np.log(max(most, 2 * FAINTEST)))))

        def at(times: float) -> Hidden:
            value = float(np.clip(null + unit * times, *size.bounds))
            return Hidden(law, {**shape, size.name: float(f"{value:.4g}")})

        def far(times: float) -> float:
            try:
                return self.missed([at(times)])
            except errors.SimulationFailed:
                return np.inf

        rung = next((k for k, times in enumerate(LADDER) if far(float(times)) >= wanted), None)
        if rung is None:
            raise errors.SimulationFailed(errors.conceal_faint())
        low, high = np.log(LADDER[max(rung - 1, 0)]), np.log(LADDER[rung])
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if far(float(np.exp(middle))) < wanted else (low, middle)
        return at(float(np.exp(low)))

    def nearest(self, truth: Array, hidden: Sequence[Hidden], without: Sequence[Fit],
                laws: Sequence[Law], rng: np.random.Generator) -> tuple[tuple[str, ...], float]:
        """Ids and distance [σ] of the best explanation that is not the truth: another known law in
        the place of one that hides, beside the others.

        Args:
            truth: Whitened outputs.
            hidden: What hides.
            without: The fits without each of them: rivals are weighed to first order from there.
            laws: To choose rivals from.
            rng: Of the rivals' shapes.
        """
        rivals = [Hidden(law, {**law.drawn(rng), law.size.name: law.effect.start})
                  for law in laws if law.known and not any(_same(law, h.law) for h in hidden)
                  for _ in range(SHAPES if law.shapes else 1)]
        ranked: list[tuple[float, list[Hidden], dict[str, float]]] = []
        for out, fit in zip(hidden, without, strict=True):
            beside = [h for h in hidden if h is not out]
            free, plant = self._free(beside), self.simulator(beside)
            there = self.scene.whitened(plant.outputs(fit.values, self.scene.experiment))
            directions = sensitivities(plant, self.scene, fit.values, free, there)
            for rival in rivals:
                size, start = rival.law.size.name, {**rival.values, **fit.values}
                try:
                    seen = self.simulator([*beside, rival])
                    moved = self.scene.whitened(seen.outputs(start, self.scene.experiment)) - there
                except errors.SimulationFailed:
                    continue
                far, steps = beyond(truth - there, np.column_stack([directions, moved]))
                start |= stepped(fit.values, free, steps)
                null = rival.law.effect.null[1]
                start[size] = null + float(steps[-1]) * (rival.law.effect.start - null)
                ranked.append((far, [*beside, rival], start))
        ranked.sort(key=lambda found: found[0])
        found = sorted(((self.fitted(truth, explanation, start), explanation)
                        for _, explanation, start in ranked[:FULL]), key=lambda o: o[0].distance)
        if not found:
            return (), np.inf
        fit, explanation = found[0]
        further = refit(self.extended(explanation), self.scene, truth, [fit.values],
                        self._free(explanation), sure=True)
        return tuple(h.law.id for h in explanation), min(fit.distance, further.distance)

    def fitted(self, truth: Array, hidden: Sequence[Hidden],
               start: Mapping[str, float] = NOWHERE, sure: bool = False) -> Fit:
        """The model with these laws, all of them refitted to a truth, from their values or from a
        `start`; `sure`: along any valley, from both, and from where a first step leads.
        """
        known, free = self.at(hidden), self._free(hidden)
        starts = [known, *([{**known, **start}] if start else [])]
        if sure and free:
            plant = self.simulator(hidden)
            there = self.scene.whitened(plant.outputs(known, self.scene.experiment))
            directions = sensitivities(plant, self.scene, known, free, there)
            starts.append(stepped(known, free, beyond(truth - there, directions)[1]))
        return refit(self.extended(hidden), self.scene, truth, starts, free, sure)

    def _free(self, hidden: Sequence[Hidden]) -> list[str]:
        """Names of what is fitted with these laws."""
        return [*self.model.free_names,
                *(p.name for h in hidden for p in h.law.effect.parameters if p.free)]


def stepped(values: Mapping[str, float], names: Sequence[str], steps: Array) -> dict[str, float]:
    """Values, those of these names a relative step (n,) further; steps that are left over are
    another parameter's.
    """
    return {**values, **{n: values[n] + float(d) * (abs(values[n]) or 1.0)
                         for n, d in zip(names, steps, strict=False)}}


def _same(a: Law, b: Law) -> bool:
    """Whether naming one for the other is right."""
    return a.id == b.id or a.id in b.twins


def nameable(hidden: Sequence[Hidden], nominal: float, rival: float) -> bool:
    """Whether a diagnosis could tell: every law known, far enough from what else there is."""
    return (bool(hidden) and all(h.law.known for h in hidden) and nominal >= FROM_NOMINAL
            and rival >= FROM_RIVAL)
