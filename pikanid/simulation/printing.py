"""SymPy formulas as Python source that numba compiles."""

from __future__ import annotations

import sympy as sp
from sympy.printing.pycode import PythonCodePrinter

from pikanid.formula.expressions import TIME


class _Printer(PythonCodePrinter):
    """Prints local names; a model's own symbols get a prefix, so that none hides an array."""

    def _print_Symbol(self, expr: sp.Symbol) -> str:
        return expr.name if expr == TIME or expr.name.startswith("_") else f"q_{expr.name}"

    def _print_positive_power(self, expr: sp.Expr) -> str:
        return f"positive_power({self._print(expr.args[0])}, {self._print(expr.args[1])})"

    def _print_power_slope(self, expr: sp.Expr) -> str:
        return f"power_slope({self._print(expr.args[0])}, {self._print(expr.args[1])})"

    def _print_log_abs(self, expr: sp.Expr) -> str:
        return f"log_abs({self._print(expr.args[0])})"

    def _print_Float(self, expr: sp.Float) -> str:
        return repr(float(expr))

    def _print_Rational(self, expr: sp.Rational) -> str:
        return repr(float(expr))

    def _print_Integer(self, expr: sp.Integer) -> str:
        return f"{int(expr)}.0" if abs(int(expr)) > 2**31 else str(int(expr))


_PRINTER = _Printer({"fully_qualified_modules": True})


def printed(expr: sp.Expr) -> str:
    """The source of a formula.

    >>> printed(sp.sin(sp.Symbol("x")) / 3)
    '(0.3333333333333333)*math.sin(q_x)'
    """
    return str(_PRINTER.doprint(expr))
