"""The model file: TOML in, `Model` out, and back without loss.

Sections: ``name``, ``domain`` (`pikanid.model.domains`), ``[states]``, ``[inputs]``,
``[parameters]``, ``[equations]``, ``[outputs]``, for models with spline edges ``[splines]``, and
``[effects]`` (`pikanid.model.effects_file`).
Inputs and outputs also take the keys of `pikanid.model.channel_maps` (``delay``, ``gain``, ``lag``,
...), each a formula of parameters.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

import sympy as sp

from pikanid import errors
from pikanid.formula.expressions import check_name, parse, symbol, to_text
from pikanid.formula.limits import Work
from pikanid.model.channel_maps import INPUT_MAPS, OUTPUT_MAPS, map_input, map_output
from pikanid.model.checks import MOST
from pikanid.model.effects_file import from_table, to_table
from pikanid.model.file_keys import KEYS, OWN, SECTIONS, check_keys
from pikanid.model.lookup import Lookup
from pikanid.model.operations import Operations
from pikanid.model.parts import Input, Output, Parameter, Spline, State
from pikanid.model.shown_rates import DERIVATIVE, showing, with_derivatives
from pikanid.model.with_effect import with_candidates
from pikanid.storage.entries import Entry
from pikanid.storage.limits import toml_content
from pikanid.storage.outputs import atomically

M = TypeVar("M", bound=Operations)


def load(path: str | os.PathLike[str], kind: Callable[..., M]) -> M:
    """Read a model file; `kind` makes the model of its fields.

    Raises:
        BadModel: Not a file, not TOML, or not a consistent model.
    """
    def wrong(detail: str) -> errors.BadModel:
        return errors.BadModel(errors.unreadable("model file", str(path), detail))

    return from_dict(toml_content(path, wrong), str(path), kind)


def to_toml(model: Lookup) -> str:
    """The text of a model file."""
    import tomli_w

    return tomli_w.dumps(to_dict(model))


def save(model: Lookup, path: str | os.PathLike[str]) -> None:
    """Write a model file; an existing one is replaced only once the new one is complete."""
    if not isinstance(path, str | os.PathLike):
        raise errors.BadModel(errors.no_path(type(path).__name__))
    atomically(Path(path), to_toml(model).encode())


def from_dict(content: Mapping[str, Any], source: str, kind: Callable[..., M]) -> M:
    """Build a model from the file's content; `source` names it in error messages, `kind` makes it.

    Raises:
        BadModel: Anything in it is of another type, unknown or inconsistent.
    """
    if not isinstance(content, Mapping):
        raise errors.BadModel(errors.not_of_kind(
            f"The model '{source}'", type(content).__name__, "a table"))
    check_keys(content, SECTIONS, source, "the file")
    tables = {section: _table(content, section, source) for section in KEYS}
    equations = content.get("equations", {})
    if not isinstance(equations, Mapping):
        raise errors.BadModel(errors.no_section(source, "equations"))
    for key in OWN:
        if key in equations and key not in tables["states"]:
            raise errors.BadModel(errors.misplaced_key(source, "equations", key))
    splines = tuple(_spline(n, e, source) for n, e in tables["splines"].items())
    parameters = {n: _parameter(n, e, source) for n, e in tables["parameters"].items()}
    for spline in splines:
        for name in spline.coefficient_names:
            parameters.setdefault(name, Parameter(name, 0.0))
    for name, entry in tables["states"].items():
        if entry.get("initial") == "free":
            if f"{name}_0" in tables["parameters"]:
                raise errors.BadModel(errors.initial_clash(source, name))
            free = Parameter(
                f"{name}_0", entry.get("guess", 0.0), entry.get("unit", ""), _bounds(entry),
                scope=entry.get("scope", "recording"), description=f"initial {name}")
            parameters[free.name] = free
    names = {*tables["states"], *tables["inputs"], *parameters}
    functions = [s.name for s in splines]
    work = Work()

    def formula(value: Any, where: str, extra: Iterable[str] = (), *more: str) -> sp.Expr:
        if isinstance(value, str):
            return parse(value, names.union(extra), where, (*functions, *more), work)
        number = Entry(value, f"The {where}", errors.BadModel).number()
        return sp.Float(number) if number else sp.Integer(0)

    right = {n: formula(e, f"equation '{n}'") for n, e in equations.items()}

    def shown(value: Any, where: str) -> sp.Expr:
        text = with_derivatives(value) if isinstance(value, str) else value
        return formula(text, where, (), DERIVATIVE)

    model = kind(
        name=content.get("name", Path(source).stem),
        states=tuple(_state(n, e, formula) for n, e in tables["states"].items()),
        inputs=tuple(Input(n, e.get("unit", ""), e.get("hold", "zero"), e.get("default"))
                     for n, e in tables["inputs"].items()),
        parameters=tuple(parameters.values()),
        equations=right,
        outputs=tuple(_output(n, e, shown, right, source) for n, e in tables["outputs"].items()),
        splines=splines, domain=content.get("domain"))
    for name, entry in tables["inputs"].items():
        if maps := _maps(entry, INPUT_MAPS, f"of input '{name}'", formula, ()):
            model = map_input(model, name, **maps)
    for name, entry in tables["outputs"].items():
        if maps := _maps(entry, OUTPUT_MAPS, f"of output '{name}'", formula, (name,)):
            model = map_output(model, name, **maps)
    return with_candidates(model, *from_table(content.get("effects", {}), source))


def to_dict(model: Lookup) -> dict[str, Any]:
    """The content of the model file.  Maps of channels stand in the equations that they became."""
    content: dict[str, Any] = {"name": model.name}
    if model.domain is not None:
        content["domain"] = model.domain[0] if len(model.domain) == 1 else [*model.domain]
    content["states"] = {s.name: _drop({"unit": s.unit, "initial": _plain(s.initial)})
                         for s in model.states}
    if model.inputs:
        content["inputs"] = {i.name: _drop({
            "unit": i.unit, "hold": i.hold, "default": i.default,
            "delay": None if i.delay == 0 else _plain(i.delay),
            "backlash": None if i.backlash == 0 else _plain(i.backlash),
            "backlash_start": None if i.backlash_start is None else _plain(i.backlash_start),
            "rate_limit": None if i.rate_limit == 0 else _plain(i.rate_limit),
            "past": None if i.past is None else _plain(i.past)})
            for i in model.inputs}
    if model.parameters:
        content["parameters"] = {p.name: _drop({
            "unit": p.unit, ("guess" if p.free else "value"): float(p.value),
            "bounds": None if p.bounds == (-math.inf, math.inf) else [float(b) for b in p.bounds],
            "scope": None if p.scope == "shared" else p.scope,
            "description": p.description}) for p in model.parameters}
    content["equations"] = {n: to_text(e) for n, e in model.equations.items()}
    content["outputs"] = {o.name: _drop({
        "unit": o.unit, "expression": to_text(o.formula), "sigma": o.sigma,
        "delay": None if o.delay == 0 else _plain(o.delay)}) for o in model.outputs}
    if model.splines:
        content["splines"] = {s.name: {"degree": s.degree, "knots": [float(k) for k in s.knots]}
                              for s in model.splines}
    if model.effects:
        content["effects"] = to_table(model.effects)
    return content


def latex(model: Lookup) -> str:
    """The equations and outputs as LaTeX."""
    rows = [rf"\dot{{{sp.latex(symbol(n))}}} &= {sp.latex(e)}" for n, e in model.equations.items()]
    rows += [rf"y_{{\mathrm{{{o.name.replace('_', ' ')}}}}} &= {sp.latex(o.expression)}"
             for o in model.outputs]
    return r"\begin{aligned}" + r" \\ ".join(rows) + r"\end{aligned}"


def _plain(expr: sp.Expr) -> float | str:
    return float(expr) if expr.is_Float or expr.is_Integer else to_text(expr)


def _drop(entry: dict[str, Any]) -> dict[str, Any]:
    return {k: v for k, v in entry.items() if v is not None and v != ""}


def _table(content: Mapping[str, Any], name: str, source: str) -> dict[str, Mapping[str, Any]]:
    table = content.get(name, {})
    if not isinstance(table, Mapping):
        raise errors.BadModel(errors.no_section(source, name))
    for key, entry in table.items():
        if not isinstance(entry, Mapping):
            raise errors.BadModel(errors.misplaced_key(source, name, str(key)) if key in OWN
                                  else errors.no_table_entry(source, name, str(key)))
    if len(table) > MOST[name]:
        raise errors.BadModel(errors.too_many_entries(
            f"'{source}': [{name}]", len(table), MOST[name]))
    for key, entry in table.items():
        check_name(key, name.rstrip("s"))
        check_keys(entry, KEYS[name], source, f"{name}.{key}")
    return dict(table)


def _maps(entry: Mapping[str, Any], known: Sequence[str], where: str, formula: Any,
          extra: Iterable[str]) -> dict[str, Any]:
    """The maps of a channel, each an expression or a number."""
    def read(value: Any, what: str) -> Any:
        if not isinstance(value, str):
            Entry(value, f"The {what}", errors.BadModel).number()
            return value
        return formula(value, what, extra)

    maps: dict[str, Any] = {}
    for key in known:
        if key not in entry:
            continue
        what = f"{key.replace('_', ' ')} {where}"
        if key == "clip":
            if not isinstance(entry[key], list | tuple) or len(entry[key]) != 2:
                raise errors.BadModel(errors.bad_value(f"The {what}", entry[key], "[lo, hi]"))
            maps[key] = [read(limit, what) for limit in entry[key]]
        else:
            maps[key] = read(entry[key], what)
    return maps


def _bounds(entry: Mapping[str, Any]) -> Any:
    bounds = entry.get("bounds", (-math.inf, math.inf))
    return tuple(bounds) if isinstance(bounds, list) and len(bounds) < 9 else bounds


def _parameter(name: str, entry: Mapping[str, Any], source: str) -> Parameter:
    if "guess" in entry and "value" in entry:
        raise errors.BadModel(errors.guess_and_value(source, name))
    if "guess" not in entry and "value" not in entry:
        raise errors.BadModel(errors.model_file_missing(
            source, f"parameter '{name}'", "either 'guess' (estimated) or 'value' (fixed)"))
    free = "guess" in entry
    return Parameter(
        name, entry["guess" if free else "value"], entry.get("unit", ""), _bounds(entry), free,
        entry.get("scope", "shared"), entry.get("description", ""))


def _state(name: str, entry: Mapping[str, Any], formula: Any) -> State:
    initial = entry.get("initial", 0.0)
    expr = symbol(f"{name}_0") if initial == "free" else formula(initial, f"initial of '{name}'")
    return State(name, entry.get("unit", ""), expr)


def _output(name: str, entry: Mapping[str, Any], formula: Any, equations: Mapping[str, sp.Expr],
            source: str) -> Output:
    if "expression" not in entry:
        raise errors.BadModel(errors.model_file_missing(source, f"output '{name}'", "'expression'"))
    shown = formula(entry["expression"], f"output '{name}'")
    return showing(Output(name, shown, entry.get("unit", ""), entry.get("sigma")), shown, equations)


def _spline(name: str, entry: Mapping[str, Any], source: str) -> Spline:
    degree, knots = entry.get("degree", 3), entry.get("knots")
    wrong = isinstance(degree, bool) or not isinstance(degree, int) or abs(degree) > MOST["knots"]
    if wrong or not isinstance(knots, list) or len(knots) > MOST["knots"]:
        raise errors.BadModel(errors.model_file_missing(
            source, f"spline '{name}'",
            f"an integer 'degree' and a list of at most {MOST['knots']} 'knots'"))
    return Spline(name, degree, tuple(knots))
