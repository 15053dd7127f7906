"""What formulas take from parameters alone: evaluated once a run, not in every stage of every step.

Each such part becomes one more entry behind the parameters, which generated functions read as they
read these.
"""

from __future__ import annotations

from collections.abc import Sequence

import sympy as sp

from pikanid.simulation.lowering import spline_value


class Constants:
    """Parts of formulas that only parameters enter, and the symbols that stand for them."""

    def __init__(self, parameters: Sequence[sp.Symbol]):
        self.parameters = frozenset(parameters)
        self.symbols: dict[sp.Expr, sp.Symbol] = {}

    def taken_out(self, expr: sp.Expr) -> sp.Expr:
        """The formula with a symbol for every part that costs something and is constant.

        >>> x, a, b = sp.symbols("x a b")
        >>> constants = Constants([a, b])
        >>> constants.taken_out(x*a/b + a*sp.exp(a - x)), list(constants.symbols)
        (_p0*x + a*exp(a - x), [a/b])
        """
        if not expr.free_symbols & self.parameters or not expr.args:
            return expr
        if self._constant(expr):
            return self._symbol(expr)
        args = list(expr.args)
        if isinstance(expr, sp.Add | sp.Mul):
            # a sign stays outside: its parts may be met without it
            own = [a for a in args if self._constant(a) or (a.is_number and abs(a) != 1)]
            part = expr.func(*own)
            if not part.is_Atom and part.free_symbols:
                args = [self._symbol(part), *(a for a in args if a not in own)]
        return expr.func(*map(self.taken_out, args))

    def _constant(self, expr: sp.Expr) -> bool:
        symbols = expr.free_symbols
        return bool(symbols) and symbols <= self.parameters and not expr.has(spline_value)

    def _symbol(self, part: sp.Expr) -> sp.Symbol:
        return self.symbols.setdefault(part, sp.Symbol(f"_p{len(self.symbols)}", real=True))
