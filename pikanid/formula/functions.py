"""Functions of the formula language that SymPy lacks, as nodes that can be differentiated."""

from __future__ import annotations

import sympy as sp


def _raised(text: str, exponent: str | None) -> str:
    """The LaTeX of a function to a power, which SymPy asks the function itself to write."""
    return text if exponent is None else rf"\left({text}\right)^{{{exponent}}}"


class clip(sp.Function):
    """``clip(x, lo, hi)``: x limited to [lo, hi]; exact at both kinks."""

    nargs = 3
    is_real = True

    @classmethod
    def eval(cls, x: sp.Expr, lo: sp.Expr, hi: sp.Expr) -> sp.Expr | None:
        if not (x.is_number and lo.is_number and hi.is_number):
            return None
        if not (x.is_comparable and lo.is_comparable and hi.is_comparable):
            return sp.nan  # as of 1/T at zero kelvin, or of a root of what is negative
        return sp.Min(sp.Max(x, lo), hi)

    def _eval_derivative(self, s: sp.Symbol) -> sp.Expr:
        x, lo, hi = self.args
        inside = sp.Heaviside(x - lo) - sp.Heaviside(x - hi)
        return (
            inside * x.diff(s)
            + (1 - sp.Heaviside(x - lo)) * lo.diff(s)
            + sp.Heaviside(x - hi) * hi.diff(s)
        )

    def _latex(self, printer: object, exp: str | None = None) -> str:
        x, lo, hi = (sp.latex(a) for a in self.args)
        return _raised(rf"\operatorname{{clip}}_{{[{lo},\,{hi}]}}\left({x}\right)", exp)


class abs_power(sp.Function):
    """``abs_power(x, n)`` = \\|x\\|ⁿ, zero at x = 0; differentiable in the exponent as well."""

    nargs = 2
    is_real = True

    @classmethod
    def eval(cls, x: sp.Expr, n: sp.Expr) -> sp.Expr | None:
        if n.is_Integer and n.is_nonnegative:
            return sp.Abs(x) ** n
        if x.is_number and n.is_number:
            return sp.Integer(0) if x.is_zero else sp.Abs(x) ** n
        return None

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        x, n = self.args
        if argindex == 1:
            return n * signed_power(x, n - 1)
        return self * log_abs(x)

    def _latex(self, printer: object, exp: str | None = None) -> str:
        x, n = (sp.latex(a) for a in self.args)
        return _raised(rf"\left|{x}\right|^{{{n}}}", exp)


class signed_power(sp.Function):
    """``signed_power(x, n)`` = sgn(x)·\\|x\\|ⁿ: the family of Coulomb (n=0) and drag (n=2) laws."""

    nargs = 2
    is_real = True

    @classmethod
    def eval(cls, x: sp.Expr, n: sp.Expr) -> sp.Expr | None:
        if n.is_zero:
            return sp.sign(x)
        if n == 1:
            return x
        if n.is_Integer and n.is_positive:
            return sp.sign(x) * sp.Abs(x) ** n
        if x.is_number and n.is_number:
            return sp.Integer(0) if x.is_zero else sp.sign(x) * sp.Abs(x) ** n
        return None

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        x, n = self.args
        if argindex == 1:
            return n * abs_power(x, n - 1)
        return self * log_abs(x)

    def _latex(self, printer: object, exp: str | None = None) -> str:
        x, n = (sp.latex(a) for a in self.args)
        return _raised(
            rf"\operatorname{{sgn}}\left({x}\right)\left|{x}\right|^{{{n}}}", exp)


class log_abs(sp.Function):
    """ln|x|, taken as 0 at x = 0, where it only ever multiplies |x|ⁿ = 0."""

    nargs = 1
    is_real = True

    @classmethod
    def eval(cls, x: sp.Expr) -> sp.Expr | None:
        if x.is_zero:
            return sp.Integer(0)
        return sp.log(sp.Abs(x)) if x.is_number else None

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        return 1 / self.args[0]
