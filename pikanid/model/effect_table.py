"""One effect and its table in a file."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from pikanid import errors
from pikanid.formula.expressions import check_name
from pikanid.model.channel_maps import INPUT_MAPS, OUTPUT_MAPS
from pikanid.model.effect import Effect, NewState
from pikanid.model.parts import Parameter
from pikanid.storage.entries import Entry

MOST_PARTS = 50  # limit: entries of one table of an effect
_FORMULAS = ("add", "replace", "initial")
_KEYS = ("name", "states", "inputs", "outputs", "channels", "family", "twins", *_FORMULAS)


def content_of(effect: Effect) -> dict[str, Any]:
    """The table of an effect."""
    usual = Parameter("", math.nan)
    parameters = {p.name: {
        "guess" if p.free else "value": float(p.value),
        **{k: list(v) if k == "bounds" else v for k in ("unit", "bounds", "scope", "description")
           if (v := getattr(p, k)) != getattr(usual, k)}} for p in effect.parameters}
    content: dict[str, Any] = {
        "name": effect.name, "parameters": parameters, "null": dict([effect.null]),
        **{key: dict(getattr(effect, key)) for key in _FORMULAS},
        "states": {n: {"unit": s.unit, "initial": s.initial, "equation": s.equation}
                   for n, s in effect.states.items()},
        "inputs": {n: dict(maps) for n, maps in effect.inputs.items()},
        "outputs": {n: dict(maps) for n, maps in effect.outputs.items()},
        "channels": dict(effect.channels), "family": effect.family, "twins": list(effect.twins)}
    return {k: v for k, v in content.items() if v}


def effect_of(key: str, entry: Entry) -> Effect:
    """The effect that a table describes.

    Raises:
        BadModel: Anything in it is of another type, unknown or missing.
    """
    check_name(key, "effect")
    table = entry.table(["parameters", "null"], _KEYS)
    where = entry.where

    def part(name: str) -> dict[str, Entry]:
        if name not in table:
            return {}
        return table[name].called(f"{where}: '{name}'").table(optional=None, most=MOST_PARTS)

    def texts(name: str) -> dict[str, str]:
        return {n: _formula(e.called(f"{where}: '{name}' of '{n}'")) for n, e in part(name).items()}

    parameters = tuple(_parameter(n, e.called(f"{where}: parameter '{n}'"))
                       for n, e in part("parameters").items())
    null = part("null")
    estimated = [p.name for p in parameters if p.free]
    if len(null) != 1 or (size := next(iter(null))) not in estimated:
        raise errors.BadModel(errors.effect_without_size(where, estimated))
    states = {check_name(n, "state"): _state(e.called(f"{where}: state '{n}'"))
              for n, e in part("states").items()}

    def maps(section: str, known: Sequence[str]) -> dict[str, dict[str, Any]]:
        return {n: _maps(e.called(f"{where}: {section[:-1]} '{n}'"), known)
                for n, e in part(section).items()}

    made = Effect(
        key, (table["name"].text() if "name" in table else "") or key.replace("_", " "), parameters,
        (size, null[size].called(f"{where}: null of '{size}'").number()),
        texts("add"), texts("replace"), states, maps("inputs", INPUT_MAPS),
        maps("outputs", OUTPUT_MAPS), texts("initial"),
        {check_name(n, "channel"): e.text() for n, e in part("channels").items()},
        table["family"].text() if "family" in table else "",
        tuple(e.text() for e in table["twins"].items(most=MOST_PARTS)) if "twins" in table else ())
    low, high = made.size.bounds
    if not low <= made.size.value <= high:
        raise errors.BadModel(errors.bad_bounds(size, made.size.value, (low, high)))
    if not made.expression:
        raise errors.BadModel(errors.effect_changes_nothing(
            where, [*_FORMULAS, "states", "inputs", "outputs"]))
    return made


def _formula(entry: Entry) -> str:
    """Text of a formula; a number counts as one."""
    return entry.text() if isinstance(entry.value, str) else repr(entry.number())


def _parameter(name: str, entry: Entry) -> Parameter:
    check_name(name, "parameter")
    free = "guess" in entry.table(optional=None)
    table = entry.table(["guess"] if free else ["value"],
                        ["unit", "bounds", "scope", "description"] if free else
                        ["unit", "description"])
    bounds = (-math.inf, math.inf)
    if "bounds" in table:
        low, high = table["bounds"].pair()
        bounds = (low.number(finite=False), high.number(finite=False))
    unit, scope, description = (table[k].text() if k in table else usual for k, usual in (
        ("unit", ""), ("scope", "shared"), ("description", "")))
    if scope not in ("shared", "recording"):
        raise table["scope"].fail("'shared' or 'recording'")
    value = table["guess" if free else "value"].number()
    if not bounds[0] <= value <= bounds[1] or not bounds[0] < bounds[1]:
        raise errors.BadModel(errors.bad_bounds(name, value, bounds))
    return Parameter(name, value, unit, bounds, free, scope=scope,  # type: ignore[arg-type]  # checked
                     description=description)


def _state(entry: Entry) -> NewState:
    table = entry.table(["equation"], ["unit", "initial"])
    return NewState(table["unit"].text() if "unit" in table else "",
                    _formula(table["initial"]) if "initial" in table else "0",
                    _formula(table["equation"]))


def _maps(entry: Entry, known: Sequence[str]) -> dict[str, Any]:
    table = entry.table(optional=known)
    return {what: [_formula(part) for part in e.pair()] if what == "clip" else _formula(e)
            for what, e in table.items()}
