"""A rig of one's own: a model, two experiments, what it may hide and how noisy it is seen."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pikanid import errors
from pikanid.model import Effect, EffectForm, Model
from pikanid.model.binding import Surroundings
from pikanid.model.domains import candidates_of
from pikanid.recording import Recording
from pikanid.validation.own_model.distance import Scene
from pikanid.validation.own_model.law import Law, laws
from pikanid.validation.own_model.plant import Plant

SPREAD = 0.25  # definition: of the logarithms of true parameters about the model's values
DIGITS = 4  # definition: of true parameters and noise


@dataclass(frozen=True)
class Rig:
    """What recordings are concealed in.

    Attributes:
        model: Nominal, at values near those of the rig.
        train, held_out: Experiments: the model's inputs, all on one time base each, which are put
            into the model's units.
        noise: Of each output, as a share of the range that it covers without effects.
        own: Effects and forms of the user, which a diagnosis will know as well.

    Raises:
        BadRecording: An input that the model needs is missing, or the channels of an experiment
            have several time bases.
        BadSetting: A noise out of range.
        BadUnit: The unit of an input does not fit the model's.
    """

    model: Model
    train: Recording
    held_out: Recording
    noise: float
    own: tuple[Effect | EffectForm, ...] = ()

    def __post_init__(self) -> None:
        if not 1e-6 <= self.noise <= 0.5:
            raise errors.BadSetting(errors.conceal_noise(self.noise))
        for part in ("train", "held_out"):
            experiment = _in_units(getattr(self, part), self.model)
            object.__setattr__(self, part, experiment)
            times = [experiment[n].time for n in experiment.names]
            if any(len(t) != len(times[0]) or np.any(t != times[0]) for t in times):
                raise errors.BadRecording(errors.conceal_one_time_base(experiment.name))

    @property
    def nominal(self) -> Model:
        """The model without its list of effects."""
        return self.model.replace(effects=())

    def drawn(self, rng: np.random.Generator) -> dict[str, float]:
        """True values of the free parameters."""
        found = {}
        for p in self.model.parameters:
            if p.free:
                value = p.value * float(np.exp(SPREAD * rng.uniform(-1.0, 1.0)))
                found[p.name] = float(f"{np.clip(value, *p.bounds):.{DIGITS}g}")
        return found

    def scene(self, values: Mapping[str, float]) -> Scene:
        """The train experiment, with noise in proportion to what is seen there.

        Raises:
            SimulationFailed: If the motion diverges.
            BadModel: If an output does not move.
        """
        seen = Plant(self.nominal).outputs(values, self.train)
        sigma = {n: float(f"{self.noise * np.ptp(y):.{DIGITS}g}") for n, y in seen.items()}
        for name, level in sigma.items():
            if level <= 0.0:
                raise errors.BadModel(errors.conceal_at_rest(name))
        return Scene(self.train, sigma)

    def laws(self, values: Mapping[str, float]) -> tuple[Law, ...]:
        """All that it can hide; guesses follow the ranges that the motion covers.

        Raises:
            SimulationFailed: If the motion diverges.
        """
        nominal = self.nominal
        seen, ranges = Plant(nominal).simulated(values, self.train)
        inputs = [n for n in nominal.input_names if n in self.train]
        used = {*nominal.input_names, *nominal.output_names, *nominal.state_names}
        extra = [n for n in self.train.names if n not in used]
        around = Surroundings(
            nominal, _equations(nominal), ranges,
            {n: (float(y.min()), float(y.max())) for n, y in seen.items()},
            {n: float(np.abs(self.train[n].values).max()) for n in (*inputs, *extra)
             if np.ptp(self.train[n].values) > 0},
            {n: self.train[n].unit for n in extra}, self.train.stop - self.train.start,
            self.train[self.train.names[0]].interval)
        known = {e.key: e for e in (*candidates_of(self.model), *self.own)}
        return laws(nominal, around, tuple(known.values()))


def _in_units(experiment: Recording, model: Model) -> Recording:
    """With the model's inputs in the model's units."""
    own = {i.name: experiment.as_input(i.name, i.unit or None)
           for i in model.inputs if i.name in experiment}
    return experiment.with_channels(*{**experiment.channels, **own}.values())


def _equations(model: Model) -> tuple[str, ...]:
    """States whose equations can lack something: all but those that only pass a rate on."""
    return tuple(n for n in model.state_names if not model.equations[n].is_Symbol
                 or model.equations[n].name not in model.state_names)
