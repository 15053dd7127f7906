"""Models in which the rate of a coordinate is another state but for a factor, in terms of that
rate: q' = p/m becomes q' = q_dot, q_dot = p/m.

Forces are then what they are in every model of mechanics, whatever momentum or scaled speed the
equations were written with.
"""

from __future__ import annotations

import sympy as sp

from pikanid.formula import units
from pikanid.formula.expanding import expanded
from pikanid.formula.expressions import symbol
from pikanid.model.effect import Effect
from pikanid.model.model import Model
from pikanid.model.parts import State
from pikanid.model.shown_rates import rate_of


def in_rates(model: Model) -> tuple[Model, list[str]]:
    """The same system, with the rates of coordinates as states; and a sentence for each change.

    Coordinates are lengths and angles that their own rate's equation depends on.  A factor may hold
    parameters, but no state, input or time.  What is a rate already stays as it is, and so does a
    model that lists effects, which are written in its own states.

    >>> model = Model.from_dict({
    ...     "states": {"q": {"initial": 0.1}, "p": {"initial": 0.0}},
    ...     "parameters": {"m": {"guess": 2.0}, "k": {"guess": 8.0}},
    ...     "equations": {"q": "p/m", "p": "-k*q"}, "outputs": {"y": {"expression": "q"}}})
    >>> found, said = in_rates(model)
    >>> dict(found.equations), said
    ({'q': q_dot, 'q_dot': -k*q/m}, ["The rate of 'q' is 'q_dot' = p/m: laws are told in it."])
    """
    said: list[str] = []
    if any(isinstance(e, Effect) for e in model.effects):
        return model, said
    for state in model.states:
        right = model.equations.get(state.name, sp.S.Zero)  # of a rate that is gone, nothing
        moved = [n for n in model.state_names if right.has(symbol(n))]
        if len(moved) != 1 or right == symbol(moved[0]) or moved[0] == state.name:
            continue
        factor = _constant(model, right, moved[0])
        if (factor is not None and _is_place(model, state, moved[0])
                and symbol(moved[0]) not in model.equations.values()):
            model = _in_rate(model, state, moved[0], factor)
            said.append(f"The rate of '{state.name}' is '{model.equations[state.name]}' = {right}: "
                        "laws are told in it.")
    return model, said


def _is_place(model: Model, state: State, moved: str) -> bool:
    """Whether a state is a length or an angle, or has no unit, and what moves it is held by it: the
    product of a reaction is no coordinate, and a voltage none of mechanics.
    """
    held = model.equations[moved].has(symbol(state.name))
    return held and (not state.unit or any(units.convertible(state.unit, u) for u in ("m", "rad")))


def _constant(model: Model, right: sp.Expr, moved: str) -> sp.Expr | None:
    """What a state is multiplied by in an equation that holds nothing but parameters besides."""
    factor = right.diff(symbol(moved))
    known = {symbol(n) for n in model.parameter_names}
    alone = expanded(right - factor * symbol(moved)) == 0 and factor.free_symbols <= known
    return factor if alone else None


def _in_rate(model: Model, coordinate: State, moved: str, factor: sp.Expr) -> Model:
    name = f"{coordinate.name}_dot"
    while name in model.symbols:
        name += "_"
    swap = {symbol(moved): symbol(name) / factor}
    unit = units.product((coordinate.unit, 1), ("s", -1)) if coordinate.unit else ""
    equations = {n: e.xreplace(swap) for n, e in model.equations.items()}
    equations[coordinate.name] = symbol(name)
    own = expanded(factor * equations.pop(moved))
    return model.replace(
        states=tuple(State(name, unit, factor * s.initial) if s.name == moved else s
                     for s in model.states),
        equations={(name if n == moved else n): own if n == moved else equations[n]
                   for n in model.equations},
        outputs=tuple(o.with_swapped(swap | {
            rate_of(moved): rate_of(name) / factor}) for o in model.outputs))
