"""The model file: TOML in, `Model` out, and back without loss.

Sections: ``name``, ``[states]``, ``[inputs]``, ``[parameters]``, ``[equations]``, ``[outputs]``
and, for models with spline edges, ``[splines]``.  Inputs and outputs also take the keys of
`pikanid.channel_maps` (``delay``, ``gain``, ``lag``, ...), each a formula of parameters.
"""

from __future__ import annotations

import difflib
import math
import os
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import sympy as sp

from pikanid import errors
from pikanid.channel_maps import INPUT_MAPS, OUTPUT_MAPS, map_input, map_output
from pikanid.expressions import RESERVED, check_name, parse, symbol, to_text
from pikanid.model import Input, Model, Output, Parameter, Spline, State
from pikanid.writing import atomically

SECTIONS = ("name", "states", "inputs", "parameters", "equations", "outputs", "splines")
KEYS = {
    "states": ("unit", "initial", "guess", "bounds", "scope", "description"),
    "inputs": ("unit", "hold", "default", *INPUT_MAPS),
    "parameters": ("unit", "guess", "value", "bounds", "scope", "description"),
    "outputs": ("unit", "expression", "sigma", *OUTPUT_MAPS),
    "splines": ("degree", "knots"),
}


def load(path: str | os.PathLike[str]) -> Model:
    """Read a model file.

    Raises
    ------
    pikanid.errors.BadModel : not a file, not TOML, or not a consistent model
    """
    try:
        text = Path(path).read_bytes().decode("utf-8")
        content = tomllib.loads(text)
    except UnicodeDecodeError:
        raise errors.BadModel(errors.model_file_unreadable(str(path), "it is not text")) from None
    except OSError as problem:
        detail = problem.strerror or "no access"
        raise errors.BadModel(errors.model_file_unreadable(str(path), detail)) from None
    except tomllib.TOMLDecodeError as problem:
        raise errors.BadModel(errors.model_file_unreadable(str(path), str(problem))) from None
    except RecursionError:
        raise errors.BadModel(errors.model_file_unreadable(str(path), "nested too deep")) from None
    return from_dict(content, str(path))


def save(model: Model, path: str | os.PathLike[str]) -> None:
    """Write a model file; an existing one is replaced only once the new one is complete."""
    import tomli_w

    atomically(Path(path), tomli_w.dumps(to_dict(model)).encode())


def from_dict(content: Mapping[str, Any], source: str = "model") -> Model:
    """Build a `Model` from the file's content; `source` names it in error messages."""
    if not isinstance(content, Mapping):
        raise errors.BadModel(errors.bad_value(f"The model '{source}'", content, "a table"))
    _known_keys(content, SECTIONS, source, "the file")
    tables = {section: _table(content, section, source) for section in KEYS}
    title = content.get("name", Path(source).stem)
    if not isinstance(title, str):
        raise errors.BadModel(errors.bad_value(f"'{source}': the name", title, "text in quotes"))
    if not isinstance(content.get("equations", {}), Mapping):
        raise errors.BadModel(errors.bad_value(f"'{source}': [equations]", "no table", "a table"))
    splines = tuple(_spline(n, e, source) for n, e in tables["splines"].items())
    parameters = {n: _parameter(n, e, source) for n, e in tables["parameters"].items()}
    for spline in splines:
        for name in spline.coefficient_names:
            parameters.setdefault(name, Parameter(name, 0.0))
    for name, entry in tables["states"].items():
        if entry.get("initial") == "free":
            free = Parameter(
                f"{name}_0", _number(entry.get("guess", 0.0), f"guess of state '{name}'"),
                _text(entry, "unit", name), _bounds(entry, f"state '{name}'"),
                scope=entry.get("scope", "recording"), description=f"initial {name}")
            parameters.setdefault(free.name, free)
    names = {*tables["states"], *tables["inputs"], *parameters}
    for name in names:
        check_name(name, "symbol")
    functions = [s.name for s in splines]

    def formula(value: Any, where: str) -> sp.Expr:
        if isinstance(value, str):
            return parse(value, names, where, functions)
        return sp.Float(_number(value, where)) if value else sp.Integer(0)

    model = Model(
        name=title,
        states=tuple(_state(n, e, formula) for n, e in tables["states"].items()),
        inputs=tuple(_input(n, e) for n, e in tables["inputs"].items()),
        parameters=tuple(parameters.values()),
        equations={n: formula(e, f"equation '{n}'")
                   for n, e in content.get("equations", {}).items()},
        outputs=tuple(_output(n, e, formula, source) for n, e in tables["outputs"].items()),
        splines=splines)
    for name, entry in tables["inputs"].items():
        model = map_input(model, name, **{k: v for k, v in entry.items() if k in INPUT_MAPS})
    for name, entry in tables["outputs"].items():
        model = map_output(model, name, **{k: v for k, v in entry.items() if k in OUTPUT_MAPS})
    return model


def to_dict(model: Model) -> dict[str, Any]:
    """The content of the model file.  Maps of channels stand in the equations that they became."""
    content: dict[str, Any] = {"name": model.name}
    content["states"] = {s.name: _drop({"unit": s.unit, "initial": _plain(s.initial)})
                         for s in model.states}
    if model.inputs:
        content["inputs"] = {i.name: _drop({
            "unit": i.unit, "hold": i.hold, "default": i.default,
            "delay": None if i.delay == 0 else _plain(i.delay),
            "backlash": None if i.backlash == 0 else _plain(i.backlash),
            "rate_limit": None if i.rate_limit == 0 else _plain(i.rate_limit)})
            for i in model.inputs}
    if model.parameters:
        content["parameters"] = {p.name: _drop({
            "unit": p.unit, ("guess" if p.free else "value"): float(p.value),
            "bounds": None if p.bounds == (-math.inf, math.inf) else [float(b) for b in p.bounds],
            "scope": None if p.scope == "shared" else p.scope,
            "description": p.description}) for p in model.parameters}
    content["equations"] = {n: to_text(e) for n, e in model.equations.items()}
    content["outputs"] = {o.name: _drop({
        "unit": o.unit, "expression": to_text(o.expression), "sigma": o.sigma,
        "delay": None if o.delay == 0 else _plain(o.delay)}) for o in model.outputs}
    if model.splines:
        content["splines"] = {s.name: {"degree": s.degree, "knots": [float(k) for k in s.knots]}
                              for s in model.splines}
    return content


def latex(model: Model) -> str:
    """The equations and outputs as LaTeX."""
    rows = [rf"\dot{{{sp.latex(symbol(n))}}} &= {sp.latex(e)}" for n, e in model.equations.items()]
    rows += [rf"y_{{\mathrm{{{o.name.replace('_', ' ')}}}}} &= {sp.latex(o.expression)}"
             for o in model.outputs]
    return r"\begin{aligned}" + r" \\ ".join(rows) + r"\end{aligned}"


def _plain(expr: sp.Expr) -> float | str:
    return float(expr) if expr.is_Float or expr.is_Integer else to_text(expr)


def _drop(entry: dict[str, Any]) -> dict[str, Any]:
    return {k: v for k, v in entry.items() if v is not None and v != ""}


def _known_keys(table: Mapping[str, Any], known: tuple[str, ...], source: str, where: str) -> None:
    for key in table:
        if key not in known:
            close = difflib.get_close_matches(key, known, 1)
            raise errors.BadModel(errors.model_file_key(source, where, key, close or known))


def _table(content: Mapping[str, Any], name: str, source: str) -> dict[str, Mapping[str, Any]]:
    table = content.get(name, {})
    if not isinstance(table, Mapping) or not all(isinstance(e, Mapping) for e in table.values()):
        raise errors.BadModel(errors.bad_value(
            f"'{source}': [{name}]", "not a table of tables", "lines like  x = { unit = \"m\" }"))
    for key, entry in table.items():
        _known_keys(entry, KEYS[name], source, f"{name}.{key}")
        if key in RESERVED:
            check_name(key, name.rstrip("s"))
    return dict(table)


def _number(value: Any, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise errors.BadModel(errors.bad_value(f"The {where}", value, "a number"))
    try:
        return float(value)
    except OverflowError:
        raise errors.BadModel(errors.bad_value(f"The {where}", "too large", "a number")) from None


def _text(entry: Mapping[str, Any], key: str, name: str) -> str:
    value = entry.get(key, "")
    if not isinstance(value, str):
        raise errors.BadModel(errors.bad_value(f"The {key} of '{name}'", value, "text in quotes"))
    return value


def _bounds(entry: Mapping[str, Any], where: str) -> tuple[float, float]:
    bounds = entry.get("bounds", [-math.inf, math.inf])
    if not isinstance(bounds, list | tuple) or len(bounds) != 2:
        raise errors.BadModel(errors.bad_value(f"The bounds of {where}", bounds, "[lower, upper]"))
    return (_number(bounds[0], f"bounds of {where}"), _number(bounds[1], f"bounds of {where}"))


def _parameter(name: str, entry: Mapping[str, Any], source: str) -> Parameter:
    if ("guess" in entry) == ("value" in entry):
        raise errors.BadModel(errors.model_file_missing(
            source, f"parameter '{name}'", "either 'guess' (estimated) or 'value' (fixed)"))
    free = "guess" in entry
    return Parameter(
        name, _number(entry["guess" if free else "value"], f"value of parameter '{name}'"),
        _text(entry, "unit", name), _bounds(entry, f"parameter '{name}'"), free,
        entry.get("scope", "shared"), _text(entry, "description", name))


def _state(name: str, entry: Mapping[str, Any], formula: Any) -> State:
    initial = entry.get("initial", 0.0)
    expr = symbol(f"{name}_0") if initial == "free" else formula(initial, f"initial of '{name}'")
    return State(name, _text(entry, "unit", name), expr)


def _input(name: str, entry: Mapping[str, Any]) -> Input:
    default = entry.get("default")
    return Input(name, _text(entry, "unit", name), entry.get("hold", "zero"),
                 None if default is None else _number(default, f"default of input '{name}'"))


def _output(name: str, entry: Mapping[str, Any], formula: Any, source: str) -> Output:
    if "expression" not in entry:
        raise errors.BadModel(errors.model_file_missing(source, f"output '{name}'", "'expression'"))
    sigma = entry.get("sigma")
    if sigma is not None and _number(sigma, f"sigma of output '{name}'") <= 0:
        raise errors.BadModel(errors.bad_value(
            f"The sigma of output '{name}'", sigma, "positive (or left out)"))
    expression = formula(entry["expression"], f"output '{name}'")
    return Output(name, expression, _text(entry, "unit", name),
                  None if sigma is None else float(sigma))


def _spline(name: str, entry: Mapping[str, Any], source: str) -> Spline:
    degree, knots = entry.get("degree", 3), entry.get("knots")
    if not isinstance(knots, list) or isinstance(degree, bool) or not isinstance(degree, int):
        raise errors.BadModel(errors.model_file_missing(
            source, f"spline '{name}'", "an integer 'degree' and a list of 'knots'"))
    return Spline(name, degree, tuple(_number(k, f"knots of spline '{name}'") for k in knots))
