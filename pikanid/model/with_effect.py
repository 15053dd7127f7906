"""Effects added to a model: terms, replaced formulas, further states, maps of channels."""

from __future__ import annotations

import difflib
from typing import TypeVar

import sympy as sp

from pikanid import errors
from pikanid.formula.expressions import symbol
from pikanid.model.channel_maps import map_input, map_output
from pikanid.model.effect import Effect
from pikanid.model.effect_form import EffectForm
from pikanid.model.operations import Operations
from pikanid.model.parts import Input, State

M = TypeVar("M", bound=Operations)


def with_effect(model: M, effect: Effect, nominal: M | None = None) -> M:
    """The model with an effect, which it does not list as one that may be missing any more.

    Args:
        model: To add it to; parameters of the effect that it has already stay as they are.
        effect: In the model's names.
        nominal: Without any effect: what the effect puts in the place of a right-hand side is added
            to `model` as the difference from there, so that several effects stand side by side.

    Raises:
        BadModel: A symbol, state or channel that the model does not have.
    """
    nominal, known = nominal or model, {*model.parameter_names}
    model = model.with_parameters(*(p for p in effect.parameters if p.name not in known)).replace(
        effects=tuple(e for e in model.effects if e.key != effect.key))
    model = model.replace(inputs=(*model.inputs, *(
        Input(n, unit) for n, unit in effect.channels.items() if n not in model.input_names)))
    where, own = f"effect '{effect.key}'", [*effect.states]
    terms: dict[str, sp.Expr] = {}
    for name, text in effect.add.items():
        terms[model.state(name).name] = model.formula(text, f"term of '{name}' in {where}", own)
    swap: dict[sp.Expr, sp.Expr] = {}
    for name, text in effect.replace.items():
        new = model.formula(text, f"replacement of '{name}' in {where}", own)
        if name in model.state_names:
            terms[name] = terms.get(name, sp.S.Zero) + new - nominal.equations[name]
        elif name in model.symbols:
            swap[symbol(name)] = new
        else:
            names = sorted(model.symbols)
            raise errors.BadModel(errors.not_in_model(
                "symbol", name, names, difflib.get_close_matches(name, names, 1)))
    equations = {n: e.xreplace(swap) + terms.get(n, sp.S.Zero) for n, e in model.equations.items()}
    outputs = tuple(o.with_swapped(swap) for o in model.outputs)
    equations |= {n: model.formula(s.equation, f"equation of '{n}' in {where}", own)
                  for n, s in effect.states.items()}
    states = tuple(State(n, s.unit, model.formula(s.initial, f"start of '{n}' in {where}"))
                   for n, s in effect.states.items())
    model = model.replace(states=(*model.states, *states), equations=equations, outputs=outputs)
    if effect.initial:
        model = model.with_initial(**effect.initial)
    for name, maps in effect.inputs.items():
        model = map_input(model, name, **maps)
    for name, maps in effect.outputs.items():
        model = map_output(model, name, **maps)
    return model


def with_candidates(model: M, *effects: Effect | EffectForm) -> M:
    """The model that lists further effects as what it may lack.

    Raises:
        BadModel: An effect that is listed already, or does not suit the model.
    """
    keys = {e.key for e in model.effects}
    names = {n: "the model" for n in (*model.symbols, *model.output_names)}
    for effect in (*model.effects, *effects):
        for name in effect.names if isinstance(effect, Effect) else ():
            if name in names:
                raise errors.BadModel(errors.effect_name_taken(effect.key, name, names[name]))
            names[name] = f"effect '{effect.key}'"
    for effect in effects:
        if effect.key in keys:
            raise errors.BadModel(errors.effect_twice(effect.key))
        keys.add(effect.key)
        if isinstance(effect, Effect):
            with_effect(model, effect)  # which is refused here, not in the middle of a diagnosis
    return model.replace(effects=(*model.effects, *effects)) if effects else model
