"""What compiled functions depend on: a model's formulas, but not its parameter values."""

from __future__ import annotations

from pikanid.model import Model


class Structure:
    """A model compared by its formulas only; the key under which its functions are kept.

    Two models that differ in guesses, bounds or in which parameters are free share one structure.
    """

    def __init__(self, model: Model):
        self.model = model
        self.key = (model.state_names, model.input_names, model.parameter_names,
                    tuple(model.equations.values()),
                    tuple(o.expression for o in model.outputs), model.splines,
                    any(i.delay.free_symbols for i in model.inputs))
        self._hash = hash(self.key)

    def __hash__(self) -> int:
        return self._hash

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Structure) and self.key == other.key
