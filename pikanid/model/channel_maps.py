"""What lies between the physics and the recording: maps of inputs and outputs, as model operations.

Each map is exact: gains and non-linearities become part of the equations, lags become states,
delays stay continuous (sub-sample) and are differentiated by the simulator.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any, TypeVar

import sympy as sp

from pikanid import errors
from pikanid.formula import functions as expression_functions
from pikanid.formula.expressions import TIME, symbol
from pikanid.model.operations import Operations
from pikanid.model.parts import Formula, Hold, Parameter, State
from pikanid.model.shown_rates import showing

M = TypeVar("M", bound=Operations)
INPUT_MAPS = ("backlash", "backlash_start", "rate_limit", "gain", "offset", "saturation",
              "dead_zone", "function", "lag", "delay", "past")
OUTPUT_MAPS = ("lag", "gain", "offset", "drift", "function", "clip", "delay")


def map_input(model: M, name: str, parameters: Sequence[Parameter] = (), *,
              hold: Hold | None = None, backlash: Formula | None = None,
              backlash_start: Formula | None = None, rate_limit: Formula | None = None,
              gain: Formula | None = None, offset: Formula | None = None,
              saturation: Formula | None = None, dead_zone: Formula | None = None,
              function: Formula | None = None, lag: Formula | None = None,
              delay: Formula | None = None, past: Formula | None = None) -> M:
    """The model whose input `name` passes through the given maps before it acts.

    They apply in the order of the keywords: u -> behind a play of ±backlash, at backlash_start in
    it (-1 to 1) when the record begins, by default as on a rig at rest -> changing no faster than
    rate_limit [1/s] -> gain·u -> + offset -> limited to ±saturation -> dead zone of ±dead_zone ->
    function (a formula of the input's name) -> first-order lag [s]; `delay` [s] shifts the recorded
    signal, and `past` is what acted before it begins (by default its first value); `hold` ("zero",
    "first", "cubic") says how it runs between samples.  Play, limited rate and delay act on the
    recorded signal, before all other maps.

    Raises:
        BadModel: Unknown input or symbol, or a second backlash, rate limit or past.

    >>> from pikanid.model import Input, Model, Output, Parameter, State
    >>> import sympy as sp
    >>> u, x, k = sp.symbols("u x k", real=True)
    >>> m = Model("m", (State("x"),), (Input("u"),), (), {"x": u - x}, (Output("x", x),))
    >>> m.map_input("u", parameters=[Parameter("k", 1.0)], gain="k").equations["x"]
    k*u - x
    """
    model = model.with_parameters(*parameters)
    item = model.input(name)
    where = f"input '{name}'"
    u = value = symbol(name)

    def read(formula: Formula, what: str) -> sp.Expr:
        return model.formula(formula, f"the {what} of {where}")

    if gain is not None:
        value = read(gain, "gain") * value
    if offset is not None:
        value = value + read(offset, "offset")
    if saturation is not None:
        level = read(saturation, "saturation")
        value = expression_functions.clip(value, -level, level)
    if dead_zone is not None:
        width = read(dead_zone, "dead zone")
        value = value - expression_functions.clip(value, -width, width)
    if function is not None:
        value = read(function, "function").xreplace({u: value})
    swap: dict[sp.Expr, sp.Expr] = {u: value}
    states = tuple(dataclasses.replace(s, initial=s.initial.xreplace({u: value}))
                   for s in model.states)
    added = {}
    if lag is not None:
        held = symbol(_fresh(model, f"{name}_lag"))
        states = (*states, State(held.name, item.unit, value))
        added = {held.name: (value - held) / read(lag, "lag")}
        swap = {u: held}
    paths = {}
    for what, formula in (("backlash", backlash), ("backlash_start", backlash_start),
                          ("rate_limit", rate_limit), ("past", past)):
        if formula is not None:
            if getattr(item, what) not in (0, None):
                raise errors.BadModel(errors.path_twice(name, what.replace("_", " ")))
            paths[what] = read(formula, what.replace("_", " "))
    changed = dataclasses.replace(
        item, hold=hold or item.hold, **paths,
        delay=item.delay if delay is None else item.delay + read(delay, "delay"))
    return model.replace(
        states=states,
        inputs=tuple(changed if i.name == name else i for i in model.inputs),
        equations={**{n: e.xreplace(swap) for n, e in model.equations.items()}, **added},
        outputs=tuple(o.with_swapped(swap) for o in model.outputs))


def map_output(model: M, name: str, parameters: Sequence[Parameter] = (), *,
               lag: Formula | None = None, gain: Formula | None = None,
               offset: Formula | None = None, drift: Formula | None = None,
               function: Formula | None = None, clip: Sequence[Any] | None = None,
               delay: Formula | None = None) -> M:
    """The model whose output `name` is seen through the given sensor maps.

    They apply in the order of the keywords: y -> first-order lag [s] -> gain·y -> + offset ->
    + drift·t -> function (a formula of the output's name) -> limited to clip = (lo, hi);
    `delay` [s] shifts the whole signal: the sample at t shows y(t - delay).  It may depend on t:
    "-e*t" is that of a clock which runs slow by a share e.

    Raises:
        BadModel: Unknown output or symbol.
    """
    model = model.with_parameters(*parameters)
    item = model.output(name)
    where = f"output '{name}'"

    def read(formula: Formula, what: str) -> sp.Expr:
        return model.formula(formula, f"the {what} of {where}", [name])

    value = item.formula
    if lag is not None:
        held = symbol(_fresh(model, f"{name}_lag"))
        start = {symbol(s.name): s.initial for s in model.states}
        state = State(held.name, item.unit,
                      item.expression.xreplace({**start, TIME: sp.Integer(0)}))
        model = model.with_state(state, (item.expression - held) / read(lag, "lag"))
        value = held
    if gain is not None:
        value = read(gain, "gain") * value
    if offset is not None:
        value = value + read(offset, "offset")
    if drift is not None:
        value = value + read(drift, "drift") * TIME
    if function is not None:
        value = read(function, "function").xreplace({symbol(name): value})
    if clip is not None:
        if not isinstance(clip, list | tuple) or len(clip) != 2:
            raise errors.BadModel(errors.bad_value(f"The clip of {where}", clip, "[lo, hi]"))
        value = expression_functions.clip(value, read(clip[0], "clip"), read(clip[1], "clip"))
    changed = dataclasses.replace(
        showing(item, value, model.equations),
        delay=item.delay if delay is None else item.delay + read(delay, "delay"))
    return model.replace(outputs=tuple(changed if o.name == name else o for o in model.outputs))


def _fresh(model: Operations, wanted: str) -> str:
    name, number = wanted, 2
    while name in model.symbols:
        name, number = f"{wanted}{number}", number + 1
    return name
