"""Models made from one: terms, states, splines, initial values, values and bounds."""

from __future__ import annotations

import dataclasses
import difflib
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Self

import sympy as sp

from pikanid import errors
from pikanid.formula.expressions import symbol, to_real
from pikanid.formula.remembered import parse_again
from pikanid.model.arguments import limits, number, parameters_of, table
from pikanid.model.checks import Checked
from pikanid.model.lookup import Lookup
from pikanid.model.parts import Formula, Parameter, Spline, State
from pikanid.model.shown_rates import followed


class Operations(Lookup):
    """What `Model` makes of itself; every operation returns a new model."""

    # --- formulas --------------------------------------------------------------------------------

    def formula(self, text: Formula, where: str, extra: Iterable[str] = ()) -> sp.Expr:
        """Read a formula (text, number or SymPy) in this model's names."""
        if isinstance(text, str):
            names = self.symbols | set(extra)
            return parse_again(text, names, where, [s.name for s in self.splines])
        return to_real(text, where[:1].upper() + where[1:])

    # --- new models from this one ----------------------------------------------------------------

    def replace(self, **changes: Any) -> Self:
        """A copy with some of the fields replaced; what stays is not checked again.

        Outputs that show the rate of a state follow its equation (`pikanid.model.shown_rates`).
        """
        fields: Any = self  # a dataclass: see `Model`
        names = fields.__dataclass_fields__
        if not changes.keys() <= names.keys():
            return dataclasses.replace(fields, **changes)  # which refuses them
        if "equations" in changes:
            changes["outputs"] = followed(
                self, changes.get("outputs", self.outputs), changes["equations"])
        new = object.__new__(type(fields))
        for name in names:
            object.__setattr__(new, name, changes.get(name, getattr(self, name)))
        new.settle(Checked.of(self))
        return new

    def with_parameters(self, *new: Parameter) -> Self:
        """Add parameters; one that exists already is replaced."""
        parameters_of(new)
        old = {p.name: p for p in self.parameters}
        return self.replace(parameters=tuple({**old, **{p.name: p for p in new}}.values()))

    def with_term(self, equation: str, term: Formula,
                  parameters: Sequence[Parameter] = ()) -> Self:
        """Add `term` to the right-hand side of a state's equation.

        Raises:
            BadModel: Unknown equation, or a symbol that is declared nowhere.
        """
        self.state(equation)
        model = self.with_parameters(*parameters)
        added = model.formula(term, f"the term added to '{equation}'")
        return model.replace(
            equations={**model.equations, equation: model.equations[equation] + added})

    def with_state(self, state: State, equation: Formula,
                   parameters: Sequence[Parameter] = ()) -> Self:
        """Add a state with its equation."""
        model = self.with_parameters(*parameters)
        rhs = model.formula(equation, f"equation of '{state.name}'", [state.name])
        return model.replace(states=(*model.states, state),
                             equations={**model.equations, state.name: rhs})

    def substitute(self, parameters: Sequence[Parameter] = (), **formulas: Formula) -> Self:
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
            outputs=tuple(o.with_swapped(swap) for o in model.outputs))

    def with_spline(self, spline: Spline, unit: str = "", scale: float = 0.0) -> Self:
        """Declare a spline function and its coefficients (guess `scale`, free)."""
        coefficients = [Parameter(n, scale, unit) for n in spline.coefficient_names]
        return self.replace(splines=(*self.splines, spline)).with_parameters(*coefficients)

    def with_edge(self, equation: str, argument: Formula, spline: Spline) -> Self:
        """Add ``spline(argument)`` to an equation: a KAN edge inside the ODE.

        The coefficients are parameters like any other: estimated, differentiated, saved.
        """
        unit = f"({self.state(equation).unit or '1'})/s"
        model = self if spline in self.splines else self.with_spline(spline, unit)
        inner = model.formula(argument, f"argument of '{spline.name}'")
        return model.with_term(equation, sp.Function(spline.name, real=True)(inner))

    def with_initial(self, **initial: Formula) -> Self:
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

    def fix(self, *names: str, **values: float | str) -> Self:
        """Hold parameters fixed, at their present values or at the given ones ("50 mm", too)."""
        changes = {n: self.parameter(n).value for n in names} | values
        return self._change({n: {"value": number(self, n, v), "free": False}
                             for n, v in changes.items()})

    def free(self, *names: str, **guesses: float | str) -> Self:
        """Estimate parameters, from their present values or from the given guesses."""
        changes = {n: self.parameter(n).value for n in names} | guesses
        return self._change({n: {"value": number(self, n, v), "free": True}
                             for n, v in changes.items()})

    def with_values(self, values: Mapping[str, float | str] | None = None,
                    **more: float | str) -> Self:
        """Set guesses (free) and values (fixed) without changing which are estimated."""
        return self._change({n: {"value": number(self, n, v)}
                             for n, v in {**table(values), **more}.items()})

    def with_bounds(self, **bounds: tuple[float | str, float | str]) -> Self:
        """Set the bounds of parameters."""
        return self._change({n: {"bounds": limits(self, n, b)} for n, b in bounds.items()})

    def per_recording(self, *names: str) -> Self:
        """Give every recording of a joint fit its own value of these parameters."""
        known = [self.parameter(n).name for n in names]
        return self._change({n: {"scope": "recording"} for n in known})

    def _change(self, changes: Mapping[str, Mapping[str, Any]]) -> Self:
        for name in changes:
            self.parameter(name)
        return self.replace(parameters=tuple(
            dataclasses.replace(p, **changes.get(p.name, {})) for p in self.parameters))
