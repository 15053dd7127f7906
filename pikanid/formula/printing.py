"""SymPy as text of the formula language."""

from __future__ import annotations

import sympy as sp
from sympy.printing.str import StrPrinter


class Printer(StrPrinter):
    """Prints what `parse` can read: lower-case names, floats that round-trip exactly."""

    def _print_Float(self, expr: sp.Float) -> str:
        return repr(float(expr))

    def _print_Abs(self, expr: sp.Expr) -> str:
        return f"abs({self._print(expr.args[0])})"

    def _print_Heaviside(self, expr: sp.Expr) -> str:
        return f"step({self._print(expr.args[0])})"

    def _nested(self, name: str, args: tuple[sp.Expr, ...]) -> str:
        # SymPy keeps these in a set: sorted, the text is the same in every process
        first, *others = sorted(args, key=sp.default_sort_key)
        text = self._print(first)
        for arg in others:
            text = f"{name}({text}, {self._print(arg)})"
        return str(text)

    def _print_Max(self, expr: sp.Expr) -> str:
        return self._nested("max", expr.args)

    def _print_Min(self, expr: sp.Expr) -> str:
        return self._nested("min", expr.args)

    def _print_Exp1(self, expr: sp.Expr) -> str:
        return "exp(1)"
