"""Multiplying out what a file says, where that makes few terms.

``(a + b + c + d)**60`` is short to write and has 39,711 terms once it is multiplied out.
"""

from __future__ import annotations

import math

import sympy as sp

MOST_TERMS = 1000  # limit: of a formula that is multiplied out


def expanded(formula: sp.Expr) -> sp.Expr:
    """The formula multiplied out, or as it is if that made more than 1000 terms.

    What differs from zero once it is expanded may be zero all the same; what does not is.

    >>> x, y = sp.symbols("x y")
    >>> expanded(x * (x - y) - x**2 + x * y), expanded((x + y) ** 5000)
    (0, (x + y)**5000)
    """
    return sp.expand(formula) if is_short(formula) else formula


def is_short(formula: sp.Expr) -> bool:
    """Whether a formula has few terms once it is multiplied out, as have all of its parts.

    >>> x, y = sp.symbols("x y")
    >>> is_short(x * (x + y) ** 3), is_short(sp.sin((x + y) ** 5000))
    (True, False)
    """
    terms: dict[sp.Basic, int] = {}
    for part in sp.postorder_traversal(formula):
        own = [terms[a] for a in part.args]
        if isinstance(part, sp.Add):
            terms[part] = sum(own)
        elif isinstance(part, sp.Mul):
            terms[part] = math.prod(own)
        elif isinstance(part, sp.Pow) and part.exp.is_Integer:
            power = abs(int(part.exp))
            terms[part] = math.comb(own[0] + power - 1, power)
        else:
            terms[part] = 1
        if terms[part] > MOST_TERMS:
            return False
    return True
