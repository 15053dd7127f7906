"""`Model`: an ordinary differential equation with its inputs, parameters and outputs, in SymPy.

    x' = f(x, u, t; p),   y = h(x, u, t; p),   x(t0) = x0(p, u(t0))

The model is immutable and is the single source of everything generated from it: compiled
right-hand sides and sensitivities, NumPy and torch functions, LaTeX, the model file.  Every
operation (`with_term`, `map_input`, ...) returns a new model.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from types import MappingProxyType
from typing import Any

import sympy as sp

from pikanid import errors
from pikanid.formula.expressions import to_real
from pikanid.model import channel_maps
from pikanid.model import file as model_file
from pikanid.model import units as model_units
from pikanid.model.checks import Checked, check_types, validate
from pikanid.model.effect import Effect
from pikanid.model.effect_form import EffectForm
from pikanid.model.effects_file import domain_of
from pikanid.model.half_derivative import with_half_derivative
from pikanid.model.operations import Operations
from pikanid.model.parts import Formula, Input, Output, Parameter, Spline, State
from pikanid.model.with_effect import with_candidates, with_effect

__all__ = ["Formula", "Input", "Model", "Output", "Parameter", "Spline", "State"]


@dataclass(frozen=True)
class Model(Operations):
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

    `effects` are kinds of physics that it may lack, for `pikanid.diagnose` to look for, and
    `domain` names catalogues of them; without it the units of the states tell which
    (`pikanid.model.domains`).

    Raises:
        BadModel: Names used twice, unknown symbols, guesses outside their bounds.
    """

    name: str
    states: tuple[State, ...]
    inputs: tuple[Input, ...]
    parameters: tuple[Parameter, ...]
    equations: Mapping[str, sp.Expr]
    outputs: tuple[Output, ...]
    splines: tuple[Spline, ...] = ()
    effects: tuple[Effect | EffectForm, ...] = ()
    domain: tuple[str, ...] | None = None

    def __post_init__(self) -> None:
        self.settle(Checked())

    def settle(self, checked: Checked) -> None:
        """Check all that is new, and put it into one form."""
        put = object.__setattr__
        check_types(self, checked)
        put(self, "states", tuple(
            s if checked.holds(s) else dataclasses.replace(
                s, initial=_constant(s.initial, f"The initial value of '{s.name}'"))
            for s in self.states))
        put(self, "inputs", tuple(
            i if checked.holds(i) else dataclasses.replace(i, **{
                what: _constant(e, f"The {what.replace('_', ' ')} of '{i.name}'")
                for what, e in i.formulas.items()}) for i in self.inputs))
        put(self, "parameters", tuple(self.parameters))
        put(self, "outputs", tuple(
            o if checked.holds(o) else dataclasses.replace(
                o, expression=to_real(o.expression, f"Output '{o.name}'"),
                delay=_constant(o.delay, f"The delay of '{o.name}'"))
            for o in self.outputs))
        put(self, "splines", tuple(self.splines))
        put(self, "effects", tuple(self.effects))
        put(self, "domain", domain_of(self.domain))
        order = [s.name for s in self.states]
        for name in self.equations:
            if name not in order:
                raise errors.BadModel(errors.stray_equation(name, order))
        for name in order:
            if name not in self.equations:
                raise errors.BadModel(errors.missing_equation(name))
        put(self, "equations", MappingProxyType({
            n: e if checked.holds(e := self.equations[n]) else to_real(e, f"The equation of '{n}'")
            for n in order}))
        validate(self, checked)
        parts: tuple[State | Input | Parameter | Output, ...] = (
            *self.states, *self.inputs, *self.parameters, *self.outputs)
        model_units.check(part for part in parts if not checked.holds(part))
        for name, value in model_units.coherent(self, checked).items():
            put(self, name, MappingProxyType(value) if name == "equations" else value)

    def __reduce__(self) -> tuple[Any, ...]:
        return Model.from_dict, (self.to_dict(),)

    def __hash__(self) -> int:
        return hash((self.name, self.parameters, tuple(self.equations.items())))

    @functools.cached_property
    def unit_disagreements(self) -> tuple[str, ...]:
        """Where its units do not fit its formulas: see `pikanid.model.units.disagreements`."""
        return model_units.disagreements(self)

    def map_input(self, name: str, parameters: Sequence[Parameter] = (), **maps: Any) -> Model:
        """Pass an input through gain, saturation, lag ...: see `pikanid.model.channel_maps`."""
        return channel_maps.map_input(self, name, parameters, **maps)

    def map_output(self, name: str, parameters: Sequence[Parameter] = (), **maps: Any) -> Model:
        """Pass an output through gain, drift, clipping ...: see `pikanid.model.channel_maps`."""
        return channel_maps.map_output(self, name, parameters, **maps)

    def with_effect(self, effect: Effect, nominal: Model | None = None) -> Model:
        """Add an effect that is described as text: see `pikanid.model.with_effect`."""
        return with_effect(self, effect, nominal)

    def with_candidates(self, *effects: Effect | EffectForm) -> Model:
        """List effects that the model may lack; `pikanid.diagnose` looks for them."""
        return with_candidates(self, *effects)

    def with_half_derivative(self, of: Formula, name: str, band: tuple[float, float],
                             order: int = 10) -> tuple[Model, sp.Expr]:
        """Add states that realise D^½ of a formula: see `pikanid.model.half_derivative`."""
        return with_half_derivative(self, of, name, band, order)

    # --- the file form ---------------------------------------------------------------------------

    @classmethod
    def from_dict(cls, content: Mapping[str, Any], source: str = "model") -> Model:
        """Build a model from a dictionary of the model file's form."""
        return model_file.from_dict(content, source, cls)

    @classmethod
    def load(cls, path: str | PathLike[str]) -> Model:
        """Read a model file (TOML)."""
        return model_file.load(path, cls)

    def to_dict(self) -> dict[str, Any]:
        """The model file's content as a dictionary."""
        return model_file.to_dict(self)

    def to_toml(self) -> str:
        """The text of a model file (TOML)."""
        return model_file.to_toml(self)

    def save(self, path: str | PathLike[str]) -> None:
        """Write a model file (TOML), atomically."""
        model_file.save(self, path)

    def latex(self) -> str:
        """The equations as LaTeX."""
        return model_file.latex(self)

    def _repr_latex_(self) -> str:
        return f"$${self.latex()}$$"


def _constant(formula: Formula, where: str) -> sp.Expr:
    """The formula, a plain number in one form: SymPy holds 1 and 1.0 for different."""
    expr = to_real(formula, where)
    if not (expr.is_Integer or expr.is_Float):
        return expr
    return sp.Float(float(expr)) if expr != 0 else sp.Integer(0)
