"""Catalogue: a parameter that stands in outputs alone changes with time.

In the equations it is `forces.parameter_drift`; what only adds to an output drifts as the sensor
does.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from pikanid.formula.expressions import symbol
from pikanid.formula.names import free_name
from pikanid.model import Effect, Model
from pikanid.model.parts import Parameter

CHANGED = 0.1  # numerical: of a parameter, in a recording, from where a fit begins


def output_drifts(model: Model, duration: float, taken: Iterable[str] = ()) -> Iterator[Effect]:
    """For each free parameter that only outputs hold: it changes steadily.

    Args:
        model: Whose outputs.
        duration: Of a recording [s].
        taken: Names, beside the model's own, that the parameters must not have.

    >>> cell = Model.from_dict({
    ...     "states": {"v": {}}, "inputs": {"I": {}}, "equations": {"v": "(I - v)/tau"},
    ...     "parameters": {"tau": {"guess": 30.0}, "R": {"guess": 0.03}, "zero": {"guess": 0.1}},
    ...     "outputs": {"U": {"expression": "v + R*I + zero"}}})
    >>> [e.name for e in output_drifts(cell, 100.0)]
    ['drift of R']
    """
    used = {*model.symbols, *taken}
    held = {s.name for e in (*model.equations.values(), *(s.initial for s in model.states),
                             *(d for i in model.inputs for d in i.formulas.values()))
            for s in e.free_symbols}
    moving = {symbol(n) for n in (*model.state_names, *model.input_names)}
    for p in model.free_names:
        slopes = [o.expression.diff(symbol(p)) for o in model.outputs]
        if p in held or not any(slope.free_symbols & moving for slope in slopes):
            continue
        rate = free_name(f"r_{p}", used)
        yield Effect("drift_in_output", f"drift of {p}",
                     (Parameter(rate, CHANGED / duration, "1/s"),), (rate, 0.0),
                     replace={p: f"{p}*(1 + {rate}*t)"}, family="slow change", variant=p)
