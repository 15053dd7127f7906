"""Catalogue: an offset of an input that acts in several places at once.

In one equation alone it is a constant force there.  A current that charges a cell, drives its
overpotentials and drops over its resistance acts on all of them: what its sensor's zero does is no
force of any one equation.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from pikanid.formula.expressions import symbol
from pikanid.formula.names import free_name
from pikanid.model import Effect, Model
from pikanid.model.parts import Parameter

SHARE = 0.05  # numerical: of an input's largest value, at which its offset is looked for first


def input_offsets(model: Model, sizes: Mapping[str, float], taken: Iterable[str] = ()
                  ) -> Iterator[Effect]:
    """For each recorded input that several equations or outputs hold.

    Args:
        model: Whose inputs.
        sizes: Largest value of each recorded input.
        taken: Names, beside the model's own, that the parameters must not have.

    >>> from pikanid.model import systems
    >>> [e.expression for e in input_offsets(systems.cart_pole(), {"F": 4.0})]
    ['offset of F: F_zero']
    >>> [*input_offsets(systems.sloshing(), {"u_x": 1.0})]
    []
    """
    used = {*model.symbols, *taken}
    formulas = [*model.equations.values(), *(o.expression for o in model.outputs)]
    for u in (i for i in model.inputs if i.name in sizes):
        if sum(f.has(symbol(u.name)) for f in formulas) > 1:
            size = Parameter(
                free_name(f"{u.name}_zero", used), SHARE * (sizes[u.name] or 1.0), u.unit)
            yield Effect("input_offset", f"an offset of {u.name}", (size,), (size.name, 0.0),
                         family="input curve", variant=u.name,
                         inputs={u.name: {"offset": size.name}})
