"""`Model`: an ordinary differential equation with its inputs, parameters and outputs, in SymPy.

    x' = f(x, u, t; p),   y = h(x, u, t; p),   x(t0) = x0(p, u(t0))

The model is immutable and is the single source of everything generated from it: compiled
right-hand sides and sensitivities, NumPy and torch functions, LaTeX, the model file.  Every
operation (`with_term`, `map_input`, ...) returns a new model.
"""

from __future__ import annotations

import dataclasses
import difflib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from types import MappingProxyType
from typing import Any, TypeAlias

import sympy as sp

from pikanid import errors, model_units
from pikanid.expressions import parse, symbol, to_real
from pikanid.model_arguments import limits, number, parameters_of, table
from pikanid.model_checks import check_types, validate
from pikanid.model_lookup import Lookup
from pikanid.model_parts import Input, Output, Parameter, Spline, State

__all__ = ["Formula", "Input", "Model", "Output", "Parameter", "Spline", "State"]

Formula: TypeAlias = "str | float | sp.Expr"


@dataclass(frozen=True)
class Model(Lookup):
    """An immutable symbolic ODE model.

    Most users write a model file (`Model.load`) or a dictionary of the same form:

    >>> model = Model.from_dict({
    ...     "name": "decay",
    ...     "states": {"x": {"initial": 1.0}},
    ...     "parameters": {"k": {"unit": "1/s", "guess": 0.5, "bounds": [0, 10]}},
    ...     "equations": {"x": "-k*x"},
    ...     "outputs": {"x": {"expression": "x"}}})
    >>> model.with_term("x", "-q*x**2", [Parameter("q", 0.1)]).equations["x"]
    -k*x - q*x**2

    Raises
    ------
    pikanid.errors.BadModel : names used twice, unknown symbols, guesses outside their bounds
    """

    name: str
    states: tuple[State, ...]
    inputs: tuple[Input, ...]
    parameters: tuple[Parameter, ...]
    equations: Mapping[str, sp.Expr]
    outputs: tuple[Output, ...]
    splines: tuple[Spline, ...] = ()

    def __post_init__(self) -> None:
        put = object.__setattr__
        check_types(self)
        put(self, "states", tuple(
            dataclasses.replace(s, initial=_constant(s.initial, f"The initial value of '{s.name}'"))
            for s in self.states))
        put(self, "inputs", tuple(
            dataclasses.replace(i, **{
                what: _constant(getattr(i, what), f"The {what.replace('_', ' ')} of '{i.name}'")
                for what in ("delay", "backlash", "rate_limit")}) for i in self.inputs))
        put(self, "parameters", tuple(self.parameters))
        put(self, "outputs", tuple(
            dataclasses.replace(o, expression=to_real(o.expression, f"Output '{o.name}'"),
                                delay=_constant(o.delay, f"The delay of '{o.name}'"))
            for o in self.outputs))
        put(self, "splines", tuple(self.splines))
        order = [s.name for s in self.states]
        for name in self.equations:
            if name not in order:
                raise errors.BadModel(errors.stray_equation(name, order))
        for name in order:
            if name not in self.equations:
                raise errors.BadModel(errors.missing_equation(name))
        put(self, "equations", MappingProxyType({
            n: to_real(self.equations[n], f"The equation of '{n}'") for n in order}))
        validate(self)
        model_units.check((*self.states, *self.inputs, *self.parameters, *self.outputs))
        for name, value in model_units.coherent(self).items():
            put(self, name, MappingProxyType(value) if name == "equations" else value)

    def __reduce__(self) -> tuple[Any, ...]:
        return Model.from_dict, (self.to_dict(),)

    def __hash__(self) -> int:
        return hash((self.name, self.parameters, tuple(self.equations.items())))

    # --- formulas --------------------------------------------------------------------------------

    @property
    def symbols(self) -> frozenset[str]:
        """Every name that a formula of this model may use."""
        return frozenset([*self.state_names, *self.input_names, *self.parameter_names])

    def formula(self, text: Formula, where: str, extra: Iterable[str] = ()) -> sp.Expr:
        """Read a formula (text, number or SymPy) in this model's names."""
        if isinstance(text, str):
            names = self.symbols | set(extra)
            return parse(text, names, where, [s.name for s in self.splines])
        return to_real(text, where[:1].upper() + where[1:])

    # --- new models from this one ----------------------------------------------------------------

    def replace(self, **changes: Any) -> Model:
        """A copy with some of the seven fields replaced."""
        return dataclasses.replace(self, **changes)

    def with_parameters(self, *new: Parameter) -> Model:
        """Add parameters; one that exists already is replaced."""
        parameters_of(new)
        old = {p.name: p for p in self.parameters}
        return self.replace(parameters=tuple({**old, **{p.name: p for p in new}}.values()))

    def with_term(self, equation: str, term: Formula,
                  parameters: Sequence[Parameter] = ()) -> Model:
        """Add `term` to the right-hand side of a state's equation.

        Raises
        ------
        pikanid.errors.BadModel : unknown equation, or a symbol that is declared nowhere
        """
        self.state(equation)
        model = self.with_parameters(*parameters)
        added = model.formula(term, f"the term added to '{equation}'")
        return model.replace(
            equations={**model.equations, equation: model.equations[equation] + added})

    def with_state(self, state: State, equation: Formula,
                   parameters: Sequence[Parameter] = ()) -> Model:
        """Add a state with its equation."""
        model = self.with_parameters(*parameters)
        rhs = model.formula(equation, f"equation of '{state.name}'", [state.name])
        return model.replace(states=(*model.states, state),
                             equations={**model.equations, state.name: rhs})

    def substitute(self, parameters: Sequence[Parameter] = (), **formulas: Formula) -> Model:
        """Replace symbols by formulas in all equations and outputs.

        `model.substitute([Parameter("r", 0.0)], l="l*(1 + r*t)")` makes a parameter drift.
        """
        model = self.with_parameters(*parameters_of(parameters))
        swap = {}
        for name, text in formulas.items():
            if name not in model.symbols:
                known = sorted(model.symbols)
                raise errors.BadModel(errors.not_in_model(
                    "symbol", name, known, difflib.get_close_matches(name, known, 1)))
            swap[symbol(name)] = model.formula(text, f"the formula put for '{name}'")
        return model.replace(
            equations={n: e.xreplace(swap) for n, e in model.equations.items()},
            outputs=tuple(dataclasses.replace(o, expression=o.expression.xreplace(swap))
                          for o in model.outputs))

    def with_spline(self, spline: Spline, unit: str = "", scale: float = 0.0) -> Model:
        """Declare a spline function and its coefficients (guess `scale`, free)."""
        coefficients = [Parameter(n, scale, unit) for n in spline.coefficient_names]
        return self.replace(splines=(*self.splines, spline)).with_parameters(*coefficients)

    def with_edge(self, equation: str, argument: Formula, spline: Spline) -> Model:
        """Add ``spline(argument)`` to an equation: a KAN edge inside the ODE.

        The coefficients are parameters like any other: estimated, differentiated, saved.
        """
        unit = f"({self.state(equation).unit or '1'})/s"
        model = self if spline in self.splines else self.with_spline(spline, unit)
        inner = model.formula(argument, f"argument of '{spline.name}'")
        return model.with_term(equation, sp.Function(spline.name, real=True)(inner))

    def with_initial(self, **initial: Formula) -> Model:
        """Set initial values; `"free"` makes one an estimated parameter ``<state>_0``."""
        model = self
        for name, value in initial.items():
            state = model.state(name)
            if isinstance(value, str) and value == "free":
                guess = float(state.initial) if state.initial.is_number else 0.0
                model = model.with_parameters(
                    Parameter(f"{name}_0", guess, state.unit, scope="recording",
                              description=f"initial {name}"))
                value = symbol(f"{name}_0")
            formula = model.formula(value, f"initial value of '{name}'")
            new = dataclasses.replace(state, initial=formula)
            model = model.replace(states=tuple(new if s.name == name else s for s in model.states))
        return model

    def fix(self, *names: str, **values: float | str) -> Model:
        """Hold parameters fixed, at their present values or at the given ones ("50 mm", too)."""
        changes = {n: self.parameter(n).value for n in names} | values
        return self._change({n: {"value": number(self, n, v), "free": False}
                             for n, v in changes.items()})

    def free(self, *names: str, **guesses: float | str) -> Model:
        """Estimate parameters, from their present values or from the given guesses."""
        changes = {n: self.parameter(n).value for n in names} | guesses
        return self._change({n: {"value": number(self, n, v), "free": True}
                             for n, v in changes.items()})

    def with_values(self, values: Mapping[str, float | str] | None = None,
                    **more: float | str) -> Model:
        """Set guesses (free) and values (fixed) without changing which are estimated."""
        return self._change({n: {"value": number(self, n, v)}
                             for n, v in {**table(values), **more}.items()})

    def with_bounds(self, **bounds: tuple[float | str, float | str]) -> Model:
        """Set the bounds of parameters."""
        return self._change({n: {"bounds": limits(self, n, b)} for n, b in bounds.items()})

    def per_recording(self, *names: str) -> Model:
        """Give every recording of a joint fit its own value of these parameters."""
        known = [self.parameter(n).name for n in names]
        return self._change({n: {"scope": "recording"} for n in known})

    def _change(self, changes: Mapping[str, Mapping[str, Any]]) -> Model:
        for name in changes:
            self.parameter(name)
        return self.replace(parameters=tuple(
            dataclasses.replace(p, **changes.get(p.name, {})) for p in self.parameters))

    def map_input(self, name: str, parameters: Sequence[Parameter] = (), **maps: Any) -> Model:
        """Pass an input through gain, saturation, lag, delay ...: see `pikanid.channel_maps`."""
        from pikanid.channel_maps import map_input

        return map_input(self, name, parameters, **maps)

    def map_output(self, name: str, parameters: Sequence[Parameter] = (), **maps: Any) -> Model:
        """Pass an output through gain, drift, clipping, lag ...: see `pikanid.channel_maps`."""
        from pikanid.channel_maps import map_output

        return map_output(self, name, parameters, **maps)

    def with_half_derivative(self, of: Formula, name: str, band: tuple[float, float],
                             order: int = 10) -> tuple[Model, sp.Expr]:
        """Add states that realise D^½ of a formula: see `pikanid.half_derivative`."""
        from pikanid.half_derivative import with_half_derivative

        return with_half_derivative(self, of, name, band, order)

    # --- the file form ---------------------------------------------------------------------------

    @staticmethod
    def from_dict(content: Mapping[str, Any], source: str = "model") -> Model:
        """Build a model from a dictionary of the model file's form."""
        from pikanid.model_file import from_dict

        return from_dict(content, source)

    @staticmethod
    def load(path: str | PathLike[str]) -> Model:
        """Read a model file (TOML)."""
        from pikanid.model_file import load

        return load(path)

    def to_dict(self) -> dict[str, Any]:
        """The model file's content as a dictionary."""
        from pikanid.model_file import to_dict

        return to_dict(self)

    def save(self, path: str | PathLike[str]) -> None:
        """Write a model file (TOML), atomically."""
        from pikanid.model_file import save

        save(self, path)

    def latex(self) -> str:
        """The equations as LaTeX."""
        from pikanid.model_file import latex

        return latex(self)

    def _repr_latex_(self) -> str:
        return f"$${self.latex()}$$"


def _constant(formula: Formula, where: str) -> sp.Expr:
    """The formula, a plain number in one form: SymPy holds 1 and 1.0 for different."""
    expr = to_real(formula, where)
    if not (expr.is_Integer or expr.is_Float):
        return expr
    return sp.Float(float(expr)) if expr != 0 else sp.Integer(0)
