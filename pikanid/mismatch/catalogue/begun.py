"""What no output shows need not be in balance, or begin with the recording, when that begins."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from pikanid.formula.expressions import symbol
from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.model import Model
from pikanid.model.parts import Parameter


def begun(effect: Candidate, name: str, unit: str) -> Candidate:
    """The same effect, whose one state begins above where it would: by a parameter of each
    recording, of this name and unit.
    """
    above = Parameter(name, 0.0, unit, scope="recording")
    return replace(
        effect, parameters=(*effect.parameters, above), begins=(*effect.begins, name),
        extend=_raised(effect.extend, name), covers={effect.key: {name: 0.0}},
        variant=",".join(filter(None, ("begun", effect.variant))),
        expression=f"{effect.expression}, {name} above it at first")


def _raised(extend: Callable[[Model], Model], above: str) -> Callable[[Model], Model]:
    def extended(model: Model) -> Model:
        model = extend(model)
        state = model.states[-1]
        return model.with_initial(**{state.name: state.initial + symbol(above)})

    return extended
