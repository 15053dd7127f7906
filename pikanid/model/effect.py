"""An effect that a user describes as text: physics that a model may leave out."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from pikanid.model.parts import Parameter

STEP = 0.1  # numerical: share of a range, from no effect to an effect


@dataclass(frozen=True)
class NewState:
    """A state that an effect brings along: unit, initial value and equation, as text."""

    unit: str
    initial: str
    equation: str


@dataclass(frozen=True)
class Effect:
    """One kind of physics that a model may lack, in the model's own names.

    Attributes:
        key: Its id: short, as a name.
        name: For people.
        parameters: Added; `value` is the guess around which a free one is looked for.
        null: Name of the one parameter that measures the size, and its value at no effect.
        add: Terms added to the right-hand sides of states.
        replace: New right-hand sides of states; of other symbols, formulas put in their place.
        states: Further states.
        inputs: Maps of inputs (gain, saturation, delay, ...: `Model.map_input`).
        outputs: Maps of outputs (`Model.map_output`).
        initial: New initial values of states.
        channels: Recorded channels that it takes as inputs, each with its unit.
        family: Of physics, as in the catalogue; may be empty.
        twins: Ids of effects that no experiment of this kind tells from it.
        variant: Distinguishes effects of one key, as where a form was bound several times.

    >>> from pikanid.model import systems
    >>> drag = Effect("rotor_drag", "drag of the rotor", (Parameter("c2", 0.1, "1/rad"),),
    ...               ("c2", 0.0), add={"theta_dot": "-c2*theta_dot*abs(theta_dot)"})
    >>> systems.sloshing().with_effect(drag).parameter_names[-1]
    'c2'
    """

    key: str
    name: str
    parameters: tuple[Parameter, ...]
    null: tuple[str, float]
    add: Mapping[str, str] = field(default_factory=dict)
    replace: Mapping[str, str] = field(default_factory=dict)
    states: Mapping[str, NewState] = field(default_factory=dict)
    inputs: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    outputs: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    initial: Mapping[str, str] = field(default_factory=dict)
    channels: Mapping[str, str] = field(default_factory=dict)
    family: str = ""
    twins: tuple[str, ...] = ()
    variant: str = ""

    @property
    def names(self) -> tuple[str, ...]:
        """Of the parameters and states that it adds."""
        return (*(p.name for p in self.parameters), *self.states)

    @property
    def size(self) -> Parameter:
        """The parameter that measures the effect, its value that at no effect."""
        found = next(p for p in self.parameters if p.name == self.null[0])
        return dataclasses.replace(found, value=self.null[1])

    @property
    def guess(self) -> float:
        """Of the size."""
        return next(p.value for p in self.parameters if p.name == self.null[0])

    @property
    def start(self) -> float:
        """Size at which the effect is there: its guess, or, where that is no effect, a step from it
        into the range of the size.
        """
        none, high = self.null[1], self.size.bounds[1]
        if self.guess != none:
            return self.guess
        return none + (STEP * (high - none) if none < high < math.inf else 1.0)

    @property
    def expression(self) -> str:
        """All that it changes, in one line."""
        said = [f"{n}' += {t}" for n, t in self.add.items()]
        said += [f"{n} -> {t}" for n, t in self.replace.items()]
        said += [f"{n}' = {s.equation}" for n, s in self.states.items()]
        said += [f"{what} of {n}: {t}" for maps in (self.inputs, self.outputs)
                 for n, table in maps.items() for what, t in table.items()]
        return ", ".join(said + [f"{n}(0) = {t}" for n, t in self.initial.items()])
