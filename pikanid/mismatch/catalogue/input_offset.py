"""Catalogue: an offset of an input that acts in several places at once, or not always alike.

In one equation alone, where it always acts alike, it is a constant force there.  A current that
charges a cell, drives its overpotentials and drops over its resistance acts on all of them: what
its sensor's zero does is no force of any one equation.  The acceleration of a crane acts the more
the shorter its cable is: what its sensor's zero does is no constant force.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping

import sympy as sp

from pikanid.formula.expressions import TIME, symbol
from pikanid.formula.names import free_name
from pikanid.model import Effect, Model
from pikanid.model.parts import Parameter

SHARE = 0.05  # numerical: of an input's largest value, at which its offset is looked for first
VARIES = 0.2  # limit: share by which what an offset does changes, from which on it is no constant
Ranges = Mapping[str, tuple[float, float]]


def input_offsets(model: Model, sizes: Mapping[str, float], taken: Iterable[str] = (),
                  ranges: Callable[[], Ranges] = dict) -> Iterator[Effect]:
    """For each recorded input that several equations or outputs hold, or one that it does not
    always act alike in.

    Args:
        model: Whose inputs.
        sizes: Largest value of each recorded input.
        taken: Names, beside the model's own, that the parameters must not have.
        ranges: Of states and inputs; asked where what an input does depends on them.

    >>> from pikanid.model import systems
    >>> [e.expression for e in input_offsets(systems.cart_pole(), {"F": 4.0})]
    ['offset of F: F_zero']
    >>> [*input_offsets(systems.sloshing(), {"u_x": 1.0})]
    []
    """
    used = {*model.symbols, *taken}
    formulas = [*model.equations.values(), *(o.expression for o in model.outputs)]
    for u in (i for i in model.inputs if i.name in sizes):
        held = [f for f in formulas if f.has(symbol(u.name))]
        if len(held) > 1 or (held and _varies(model, held[0].diff(symbol(u.name)), ranges)):
            size = Parameter(
                free_name(f"{u.name}_zero", used), SHARE * (sizes[u.name] or 1.0), u.unit)
            yield Effect("input_offset", f"an offset of {u.name}", (size,), (size.name, 0.0),
                         family="input curve", variant=u.name,
                         inputs={u.name: {"offset": size.name}})


def _varies(model: Model, slope: sp.Expr, ranges: Callable[[], Ranges]) -> bool:
    """Whether a formula changes along a motion, one variable at a time about the middle."""
    names = {*model.state_names, *model.input_names} & {q.name for q in slope.free_symbols}
    if not names:
        return False
    known = {n: ends for n, ends in ranges().items() if n in names}
    middle = {n: sum(ends) / 2 for n, ends in known.items()}
    at = {symbol(n): value for n, value in model.values.items()} | {TIME: sp.S.Zero}
    found = [slope.subs(at | {symbol(n): v for n, v in (middle | {m: end}).items()}).doit()
             for m, ends in known.items() for end in ends]
    sizes = [abs(float(value)) for value in found if value.is_finite and value.is_real]
    return bool(sizes) and max(sizes) - min(sizes) > VARIES * max(sizes)
