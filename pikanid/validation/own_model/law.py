"""Laws that a concealed recording of any model may hide, and where they act in it."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from pikanid import errors
from pikanid.formula.expressions import symbol
from pikanid.model import Effect, EffectForm, Model
from pikanid.model.binding import Surroundings, bound
from pikanid.model.effects_file import read_effects
from pikanid.model.parts import Parameter
from pikanid.validation.concealed.families import families_of

TWINS = {"input_delay": "sensor_delay", "sensor_delay": "input_delay"}
HERE = Path(__file__).parent


@dataclass(frozen=True)
class Law:
    """An effect in a model's own names that can be hidden there.

    Attributes:
        effect: As text.
        known: Whether a diagnosis can know it.
        channel: Through which it acts.
        places: State, input or output; of a parameter that changes, all states whose equations
            hold it.
        twins: Ids that no experiment of this kind tells from it.
    """

    effect: Effect
    known: bool
    channel: Literal["dynamics", "input", "sensor"]
    places: tuple[str, ...]
    twins: tuple[str, ...] = ()

    @property
    def id(self) -> str:
        """Of the effect, without what tells its variants apart."""
        return self.effect.key

    @property
    def where(self) -> str:
        """The first of its places."""
        return self.places[0]

    @property
    def families(self) -> set[str]:
        """Of physics, by any of which it is rightly called."""
        return {*families_of(self.id), self.effect.family or self.effect.name}

    @property
    def size(self) -> Parameter:
        """That measures it, at no effect."""
        return self.effect.size

    @property
    def shapes(self) -> tuple[Parameter, ...]:
        """Its parameters that are drawn: those with bounds on both sides."""
        return tuple(p for p in self.effect.parameters if p.name != self.effect.null[0]
                     and all(map(math.isfinite, p.bounds)))

    def drawn(self, rng: np.random.Generator) -> dict[str, float]:
        """Values of everything but the size; what has no bounds keeps its guess."""
        fixed = {p.name: p.value for p in self.effect.parameters if p.name != self.size.name}
        return fixed | {p.name: float(f"{rng.uniform(*p.bounds):.4g}") for p in self.shapes}


def laws(model: Model, around: Surroundings,
         own: Iterable[Effect | EffectForm]) -> tuple[Law, ...]:
    """All that can be hidden in a model: its own effects, what the catalogue knows, and what none
    of both describes.

    Args:
        model: Nominal, without effects.
        around: What forms can be bound to.
        own: Users' effects and forms, which a diagnosis will know.
    """
    own = tuple(own)
    mine = {e.key for e in own}
    single = len(model.outputs) == 1 == sum(n in around.sizes for n in model.input_names)
    found = []
    for known, listed in ((True, own), (True, read_effects(HERE / "known.toml")),
                          (False, read_effects(HERE / "outside.toml"))):
        for one in listed:
            if listed is not own and one.key in mine:
                continue
            effects = bound(one, around) if isinstance(one, EffectForm) else (one,)
            found += [law for e in effects if (law := _law(e, model, known, single)) is not None]
    return tuple(found)


def _law(effect: Effect, model: Model, known: bool, single: bool) -> Law | None:
    """Of an effect that the model's units and the simulator allow."""
    try:
        model.with_effect(effect)
    except errors.BadUnit:
        return None
    twins = (*effect.twins, *([TWINS[effect.key]] if single and effect.key in TWINS else []))
    if effect.inputs:
        return Law(effect, known, "input", (next(iter(effect.inputs)),), twins)
    if effect.outputs:
        return Law(effect, known, "sensor", (next(iter(effect.outputs)),), twins)
    acts = (*effect.add, *effect.replace, *effect.initial)
    states = [n for n in acts if n in model.state_names]
    changed = {symbol(n) for n in acts if n in model.parameter_names}
    return Law(effect, known, "dynamics", tuple(states[:1] or [
        n for n in model.state_names if changed & model.equations[n].free_symbols]), twins)
