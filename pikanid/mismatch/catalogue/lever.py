"""Through what a force on a coordinate acts: in a linkage, a torque in one joint moves the others.

M(q) q'' = ... + τ: a force on the coordinate i is a column of M⁻¹ in the equations of all rates (R.
Featherstone, Rigid Body Dynamics Algorithms, 2008, eq. 2.14).  The model says which column that is
where it damps the coordinate by a force of its own, -b v: there ∂f/∂b = -M⁻¹e v.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence

import sympy as sp

from pikanid.formula.expanding import expanded
from pikanid.formula.expressions import TIME, symbol
from pikanid.model import Model


def lever(model: Model, v: str, rates: Sequence[str]) -> tuple[str, Mapping[str, sp.Expr]] | None:
    """The parameter b that damps a rate, and by name of each rate what a force along with it adds
    to that one's equation, for each that it adds to v' at rest; None where the model shows none, or
    where it adds nothing to others.

    >>> from pikanid.model import systems
    >>> by, found = lever(systems.cart_pole(), "x_dot", ["x_dot", "theta_dot"])
    >>> by, sorted(found), found["x_dot"].subs(symbol("theta"), 0)
    ('b', ['theta_dot', 'x_dot'], 1)
    """
    at_rest = {symbol(n): sp.S.Zero for n in (*model.state_names, *model.input_names)}
    fast = {TIME, *(symbol(n) for n in (*rates, *model.input_names))}
    for name in model.parameter_names:
        b = symbol(name)
        slopes = {r: model.equations[r].diff(b) for r in rates}
        if slopes[v] == 0:
            continue
        columns = {r: _without(-slope, symbol(v)) for r, slope in slopes.items()}
        if any(column.free_symbols & {b, *fast} for column in columns.values()):
            continue
        own = columns[v].xreplace(at_rest)
        if own in (0, sp.nan, sp.zoo):
            continue
        found = {r: column / own for r, column in columns.items() if column != 0}
        if len(found) > 1:
            return name, found
    return None


@functools.lru_cache(maxsize=256)  # a diagnosis asks of the same model again and again
def _without(product: sp.Expr, factor: sp.Symbol) -> sp.Expr:
    """A product without one of its factors, which stays in a denominator where it is none."""
    ratio = product / factor
    return ratio if not ratio.has(factor) else expanded(ratio)
