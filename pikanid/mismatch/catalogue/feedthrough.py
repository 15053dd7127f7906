"""Catalogue: an output shows a part of an input beside what it is taken to.

An inclinometer leans with the acceleration of what carries it: what follows an input at once is no
state.  A mode that is faster than the sampling, driven by the input, looks the same.  Where the
input enters the rate of what is seen, a part of it in the output is to first order what a delay or
a lag does there, and nothing of its own: T(t - τ) ≈ T - τ T'.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from pikanid.formula import units
from pikanid.formula.expressions import symbol
from pikanid.formula.names import free_name
from pikanid.model import Effect, Model
from pikanid.model.parts import Parameter

SHARE = 0.05  # numerical: of an output's range, which an input makes up where a fit begins


def feedthroughs(model: Model, sizes: Mapping[str, float], ranges: Mapping[str, float],
                 taken: Iterable[str] = ()) -> Iterator[Effect]:
    """For each recorded input and each output that holds neither it nor a state whose rate does.

    Args:
        model: Whose outputs.
        sizes: Largest value of each recorded input.
        ranges: Of each recorded output, from lowest to highest.
        taken: Names, beside the model's own, that the parameters must not have.

    >>> from pikanid.model import systems
    >>> [e.expression for e in feedthroughs(systems.sloshing(), {"u_x": 2.0}, {"theta": 0.4})]
    ['offset of theta: part_u_x*u_x']
    """
    used = {*model.symbols, *taken}
    for output in (o for o in model.outputs if o.name in ranges):
        for u in (i for i in model.inputs if sizes.get(i.name)):
            rates = [model.equations[x] for x in model.state_names
                     if output.expression.has(symbol(x))]
            if any(e.has(symbol(u.name)) for e in (output.expression, *rates)):
                continue
            several = len(model.outputs) > 1
            share = free_name(f"part_{u.name}" + (f"_{output.name}" if several else ""), used)
            start = SHARE * (ranges[output.name] or 1.0) / sizes[u.name]
            unit = units.product((output.unit or "1", 1), (u.unit or "1", -1))
            yield Effect(
                "feedthrough", f"a part of {u.name} in {output.name}",
                (Parameter(share, start, unit),), (share, 0.0), family="coupling",
                variant=f"{u.name},{output.name}",
                outputs={output.name: {"offset": f"{share}*{u.name}"}})
