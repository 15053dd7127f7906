"""Outputs that show the rate of a state: an accelerometer, a meter of a flow into a tank.

What acts on a state acts on what shows its rate.  An output whose formula is the right-hand side of
a state's equation, or that and a constant, stays so whatever the equation becomes; so does what is
written with the rate of a state, whatever stands beside it and in whatever unit.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace

import sympy as sp
from sympy.core.function import AppliedUndef

from pikanid import errors
from pikanid.formula.expanding import expanded
from pikanid.formula.expressions import TIME, symbol
from pikanid.model.lookup import Lookup
from pikanid.model.parts import Output

DERIVATIVE = "derivative"  # definition: of a state, as a function in formulas of outputs


def with_derivatives(text: str) -> str:
    """The formula of an output with ``derivative(x)`` for ``x'``.

    >>> with_derivatives("v' + g")
    'derivative(v) + g'
    """
    return re.sub(r"\b([A-Za-z_]\w*)'", rf"{DERIVATIVE}(\1)", text)


def rate_of(state: str) -> sp.Expr:
    """The rate of a state, to stand in the formula of an output."""
    return sp.Function(DERIVATIVE, real=True)(symbol(state))


def showing(output: Output, formula: sp.Expr, equations: Mapping[str, sp.Expr]) -> Output:
    """The output with a formula that may show rates.

    Raises:
        BadModel: If one is not that of a state.
    """
    expression = in_states(formula, equations, f"output '{output.name}'")
    return replace(output, expression=expression,
                   written=None if expression == formula else formula)


def in_states(formula: sp.Expr, equations: Mapping[str, sp.Expr], where: str) -> sp.Expr:
    """The formula of an output with the right-hand sides of equations for derivatives.

    Raises:
        BadModel: If a derivative is not that of a state.
    """
    swap = {}
    for rate in formula.atoms(AppliedUndef):
        if rate.func.__name__ == DERIVATIVE:
            name = str(rate.args[0])
            if name not in equations:
                raise errors.BadModel(errors.derivative_of_no_state(name, where, [*equations]))
            swap[rate] = equations[name]
    return formula.xreplace(swap)


def shown_rates(model: Lookup) -> dict[str, str]:
    """The outputs that show the rate of a state, and that state.

    >>> from pikanid.model import Model
    >>> model = Model.from_dict({
    ...     "states": {"x": {}, "v": {}}, "parameters": {"k": {"guess": 4.0}},
    ...     "equations": {"x": "v", "v": "-k*x"},
    ...     "outputs": {"place": {"expression": "x"}, "acc": {"expression": "v'"}}})
    >>> shown_rates(model)
    {'acc': 'v'}
    >>> model.with_term("v", "-0.1*v").output("acc").expression
    -k*x - 0.1*v
    """
    moving = frozenset((*map(symbol, (*model.state_names, *model.input_names)), TIME))
    # an output that is a state by itself, as most are, shows that
    written = {o.name: str(rate.args[0]) for o in model.outputs if o.written is not None
               for rate in o.written.atoms(AppliedUndef) if rate.func.__name__ == DERIVATIVE}
    found = {o.name: _shown(o.expression, tuple(model.equations.items()), moving)
             for o in model.outputs if not (o.expression.is_Symbol or o.expression.is_number)}
    return {name: state for name, state in (found | written).items() if state}


def followed(model: Lookup, outputs: Sequence[Output], equations: Mapping[str, sp.Expr]
             ) -> tuple[Output, ...]:
    """The outputs once the model has these equations."""
    shown = shown_rates(model)
    before = {o.name: o.expression for o in model.outputs}
    made = []
    for output in outputs:
        if output.written is not None:
            made.append(showing(output, output.written, equations))
            continue
        state = shown.get(output.name, "")
        old, new = model.equations.get(state), equations.get(state)
        if old is not None and isinstance(new, sp.Expr) and new != old:
            constant = expanded(before[output.name] - old)
            output = replace(output, expression=new + constant)
        made.append(output)
    return tuple(made)


@functools.lru_cache(maxsize=512)
def _shown(formula: sp.Expr, equations: tuple[tuple[str, sp.Expr], ...],
           moving: frozenset[sp.Symbol]) -> str:
    for name, right in equations:
        if right.is_Symbol or right.is_number or not right.free_symbols <= formula.free_symbols:
            continue  # the rate that is a state by itself is shown as that
        if not expanded(formula - right).free_symbols & moving:
            return name
    return ""
