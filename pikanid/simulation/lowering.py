"""Non-smooth formulas made smooth between switches.

`sign`, `abs`, `min`, `clip`, ... are rewritten with one symbol s_k = sgn g_k(x, u, t, p) for every
switching function g_k.  With the s_k held constant the formulas are smooth, so that they can be
differentiated by SymPy and integrated at full order; the hybrid integrator changes an s_k exactly
where its g_k passes through zero, or keeps it at the value in (-1, 1) that holds g_k = 0 (Filippov,
Differential Equations with Discontinuous Righthand Sides, 1988, ch. 2): that is stiction.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import sympy as sp
from sympy.core.function import AppliedUndef

from pikanid.formula.functions import abs_power, clip, log_abs, signed_power
from pikanid.model import Model, Spline

CONTINUOUS = 3  # numerical: least power of a positive part that methods of order 4 may step over


class positive_power(sp.Function):
    """bⁿ for b > 0, zero for b <= 0 whatever the (real) exponent."""

    nargs = 2

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        base, n = self.args
        if argindex == 1:
            return n * positive_power(base, n - 1) if n.is_integer and n > 1 else power_slope(
                base, n)
        return self * log_abs(base)


class power_slope(sp.Function):
    """n·bⁿ⁻¹, the derivative of `positive_power`; zero very near b = 0 where n < 1.

    There the slope grows without bound, though its effect on a passing trajectory does not: taken
    at a zero crossing it would make sensitivities explode.
    """

    nargs = 2

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        base, n = self.args
        if argindex == 1:
            return n * power_slope(base, n - 1)
        return positive_power(base, n - 1) + self * log_abs(base)


class spline_value(sp.Function):
    """``spline_value(i, r, z)``: the r-th derivative of the model's i-th spline at z."""

    nargs = 3

    def fdiff(self, argindex: int = 3) -> sp.Expr:
        index, order, z = self.args
        return spline_value(index, order + 1, z)


@dataclass
class Lowering:
    """Rewrites formulas and collects their switching functions `switches` (shared, in order)."""

    splines: Sequence[Spline] = ()
    switches: list[sp.Expr] = field(default_factory=list)

    def switch(self, g: sp.Expr) -> sp.Expr:
        """The symbol that stands for sgn g (or minus the one for sgn -g)."""
        if g in self.switches:
            return switch_symbol(self.switches.index(g))
        if -g in self.switches:
            return -switch_symbol(self.switches.index(-g))
        self.switches.append(g)
        return switch_symbol(len(self.switches) - 1)

    def lower(self, expr: sp.Expr) -> sp.Expr:
        """The formula with every non-smooth node rewritten, from the inside out."""
        if expr.is_Atom:
            return expr
        if isinstance(expr, sp.Pow) and isinstance(expr.base, sp.Abs) and not (
                expr.exp.is_integer or expr.exp.is_negative):
            return self.lower(abs_power(expr.base.args[0], expr.exp))
        if isinstance(expr, sp.Pow) and (inner := positive_part(expr.base)) is not None and (
                expr.exp.is_integer and expr.exp >= CONTINUOUS):
            return positive_power(self.lower(inner), expr.exp)
        args = [self.lower(a) for a in expr.args]
        if isinstance(expr, AppliedUndef):
            names = [s.name for s in self.splines]
            return spline_value(names.index(expr.func.__name__), 0, args[0])
        if isinstance(expr, sp.sign):
            return sp.sign(args[0]) if args[0].is_number else self.switch(args[0])
        if isinstance(expr, sp.Abs):
            return self.switch(args[0]) * args[0]
        if isinstance(expr, sp.Heaviside):
            return (1 + self.switch(args[0])) / 2
        if isinstance(expr, sp.Max | sp.Min):
            return self.extreme(args, 1 if isinstance(expr, sp.Max) else -1)
        if isinstance(expr, clip):
            x, low, high = args
            above, beyond = self.switch(x - low), self.switch(x - high)
            return (low * (1 - above) + x * (above - beyond) + high * (1 + beyond)) / 2
        if isinstance(expr, abs_power):
            return positive_power(self.switch(args[0]) * args[0], args[1])
        if isinstance(expr, signed_power):
            s = self.switch(args[0])
            return s * positive_power(s * args[0], args[1])
        return expr.func(*args)

    def extreme(self, args: Sequence[sp.Expr], sense: int) -> sp.Expr:
        """Max (sense 1) or Min (sense -1) of the arguments, pair by pair."""
        result = args[0]
        for other in args[1:]:
            s = sense * self.switch(other - result)
            result = (result * (1 - s) + other * (1 + s)) / 2
        return result


def positive_part(expr: sp.Expr) -> sp.Expr | None:
    """The g of max(g, 0), or None.

    >>> positive_part(sp.Max(sp.Symbol("x") - 1, 0))
    x - 1
    """
    if not (isinstance(expr, sp.Max) and len(expr.args) == 2 and sp.S.Zero in expr.args):
        return None
    return expr.args[0] if expr.args[1] == 0 else expr.args[1]


def switch_symbol(index: int) -> sp.Symbol:
    """The symbol of the k-th switching function's sign."""
    return sp.Symbol(f"_s{index}", real=True)


@dataclass(frozen=True)
class LoweredModel:
    """A model's formulas after lowering.

    The first `n_dynamic` switching functions belong to the right-hand side; the outputs may use
    these and further ones of their own.
    """

    rhs: tuple[sp.Expr, ...]
    outputs: tuple[sp.Expr, ...]
    switches: tuple[sp.Expr, ...]
    n_dynamic: int


def lower_model(model: Model) -> LoweredModel:
    """Lower right-hand side and outputs with one shared list of switching functions."""
    lowering = Lowering(model.splines)
    rhs = tuple(lowering.lower(e) for e in model.equations.values())
    n_dynamic = len(lowering.switches)
    outputs = tuple(lowering.lower(o.expression) for o in model.outputs)
    return LoweredModel(rhs, outputs, tuple(lowering.switches), n_dynamic)
