"""Names and parts of a model, looked up by name."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping
from typing import Any

import sympy as sp

from pikanid import errors
from pikanid.model.effect import Effect
from pikanid.model.effect_form import EffectForm
from pikanid.model.parts import Input, Output, Parameter, Spline, State


def find(items: Iterable[Any], name: str, what: str) -> Any:
    """The item of that name; a `BadModel` that lists the names if there is none."""
    if not isinstance(name, str):
        raise errors.BadModel(errors.not_of_kind(
            f"The name of the {what}", type(name).__name__, "text"))
    names = []
    for item in items:
        if item.name == name:
            return item
        names.append(item.name)
    close = difflib.get_close_matches(name, names, 1)
    raise errors.BadModel(errors.not_in_model(what, name, names, close))


class Lookup:
    """What `Model` answers about its parts."""

    name: str
    states: tuple[State, ...]
    inputs: tuple[Input, ...]
    parameters: tuple[Parameter, ...]
    equations: Mapping[str, sp.Expr]
    outputs: tuple[Output, ...]
    splines: tuple[Spline, ...]
    effects: tuple[Effect | EffectForm, ...]
    domain: tuple[str, ...] | None

    @property
    def symbols(self) -> frozenset[str]:
        """Every name that a formula of this model may use."""
        return frozenset([*self.state_names, *self.input_names, *self.parameter_names])

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the states, in order."""
        return tuple(s.name for s in self.states)

    @property
    def input_names(self) -> tuple[str, ...]:
        """Names of the inputs, in order."""
        return tuple(i.name for i in self.inputs)

    @property
    def output_names(self) -> tuple[str, ...]:
        """Names of the outputs, in order."""
        return tuple(o.name for o in self.outputs)

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of all parameters, in order; the order of every parameter vector p (P,)."""
        return tuple(p.name for p in self.parameters)

    @property
    def free_names(self) -> tuple[str, ...]:
        """Names of the parameters that are estimated."""
        return tuple(p.name for p in self.parameters if p.free)

    @property
    def values(self) -> dict[str, float]:
        """Guess or fixed value of every parameter."""
        return {p.name: float(p.value) for p in self.parameters}

    def parameter(self, name: str) -> Parameter:
        """The parameter of that name (raises `BadModel`, naming the close ones)."""
        return find(self.parameters, name, "parameter")

    def state(self, name: str) -> State:
        """The state of that name."""
        return find(self.states, name, "state")

    def input(self, name: str) -> Input:
        """The input of that name."""
        return find(self.inputs, name, "input")

    def output(self, name: str) -> Output:
        """The output of that name."""
        return find(self.outputs, name, "output")
