"""Names and parts of a model, looked up by name."""

from __future__ import annotations

from pikanid.model_checks import find
from pikanid.model_parts import Input, Output, Parameter, State


class Lookup:
    """What `Model` answers about its parts."""

    states: tuple[State, ...]
    inputs: tuple[Input, ...]
    parameters: tuple[Parameter, ...]
    outputs: tuple[Output, ...]

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
        return {p.name: p.value for p in self.parameters}

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
