"""What an edge may be called: candidates y = Σ a_k f_k(x; p) + d, as data.

A form is linear in its a_k and d; p are the few parameters inside.  Every p has a kind, which says
in which unit it is and where a search for it starts on a given range of x.  The library is a tuple:
to extend it is to add to it, and `user_form` makes a form of any SymPy expression.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import combinations
from typing import Literal

import numpy as np
import sympy as sp

from pikanid import errors
from pikanid.formula.expanding import expanded
from pikanid.formula.expressions import FUNCTIONS, parse, symbol
from pikanid.symbolic.numeric import Array, Compiled, compiled, slopes

Kind = Literal["location", "below", "above", "width", "rate", "signed rate", "frequency",
               "exponent"]
X = symbol("x")
HALF = Fraction(1, 2)  # definition: of a square root
MOST_TURNS = 40.0  # limit: radians of a frequency over half the range
DENSE = 1.5  # limit: of the narrowest feature, in mean distances of samples


@dataclass(frozen=True)
class Knob:
    """A parameter inside a form: its name and what it is."""

    name: str
    kind: Kind

    @property
    def power(self) -> int | None:
        """Power of x's unit that the parameter is measured in; None: a plain number."""
        return {"exponent": None, "rate": -1, "signed rate": -1, "frequency": -1}.get(self.kind, 1)

    def limits(self, low: float, high: float, count: int) -> tuple[float, float]:
        """Where the parameter may lie for `count` samples over [low, high]."""
        size = high - low
        gap = DENSE * size / count
        reach = 20.0 * size
        return {
            "location": (low - size, high + size), "below": (low - reach, low - 1e-3 * gap),
            "above": (high + 1e-3 * gap, high + reach), "width": (gap, size),
            "rate": (0.2 / size, 2.0 / gap), "signed rate": (-40.0 / size, 40.0 / size),
            "frequency": (1.0 / size, 2.0 * MOST_TURNS / size), "exponent": (0.1, 6.5),
        }[self.kind]

    def grid(self, low: float, high: float, count: int) -> Array:
        """Where a search starts."""
        size = high - low
        first, last = self.limits(low, high, count)
        match self.kind:
            case "location":
                return np.linspace(low + 0.02 * size, high - 0.02 * size, 25)
            case "below":
                return low - np.geomspace(max(low - last, 1e-3 * size), reach_of(size), 16)
            case "above":
                return high + np.geomspace(max(first - high, 1e-3 * size), reach_of(size), 16)
            case "width":
                return np.linspace(0.02 * size, 0.95 * size, 24)
            case "rate":
                return np.geomspace(first, last, 18)
            case "signed rate":
                half = np.geomspace(0.2, 40.0, 14) / size
                return np.concatenate([-half[::-1], half])
            case "frequency":
                return np.arange(0.5, MOST_TURNS, 0.4) * 2.0 / size
            case "exponent":
                return np.linspace(0.2, 6.0, 16)


def reach_of(size: float) -> float:
    """How far beyond the range a pole is looked for."""
    return 10.0 * size


@dataclass(frozen=True)
class Form:
    """One candidate.

    Attributes:
        name: What it is called.
        family: Forms of one family share its prior probability.
        columns: The f_k(x; p).
        knobs: The p.
        powers: Power of x's unit in every f_k; None where it follows an exponent, or is not known.
    """

    name: str
    family: str
    columns: tuple[sp.Expr, ...]
    knobs: tuple[Knob, ...] = ()
    powers: tuple[int | Fraction | None, ...] = ()

    @property
    def count(self) -> int:
        """Number of parameters, d among them."""
        return len(self.columns) + len(self.knobs) + 1

    @property
    def smooth(self) -> bool:
        """Whether the columns change continuously with the parameters inside."""
        return not any(c.has(sp.sign) and any(k.kind == "location" for k in self.knobs)
                       for c in self.columns)

    @property
    def takes_number(self) -> bool:
        """Whether x has to be a number: no factor turns a logarithm's unit into another one."""
        return any(c.has(sp.log) for c in self.columns)

    @property
    def symbols(self) -> tuple[sp.Symbol, ...]:
        """x, then the parameters inside."""
        return (X, *(symbol(k.name) for k in self.knobs))

    @cached_property
    def values(self) -> Compiled:
        """(x, *p) -> the columns."""
        return compiled(self.symbols, self.columns)

    @cached_property
    def derivatives(self) -> Compiled:
        """(x, *p) -> ∂f_k/∂p_j, column by column."""
        return compiled(self.symbols, slopes(self.columns, self.symbols[1:]))

    @cached_property
    def rates(self) -> Compiled:
        """(x, *p) -> ∂f_k/∂x."""
        return compiled(self.symbols, slopes(self.columns, (X,)))

    @property
    def amplitudes(self) -> tuple[str, ...]:
        """Names of the a_k: "a", or "a1", "a2", ..."""
        many = len(self.columns) > 1
        return tuple(f"a{k + 1}" if many else "a" for k in range(len(self.columns)))

    @property
    def expression(self) -> sp.Expr:
        """Σ a_k f_k(x; p) + d."""
        terms = [symbol(a) * f for a, f in zip(self.amplitudes, self.columns, strict=True)]
        return sp.Add(*terms, symbol("d"))

    def typical(self, low: float, high: float) -> list[float]:
        """Parameters inside that make all of the form show over [low, high]."""
        found = [float(g[len(g) // 3]) for g in (k.grid(low, high, 100) for k in self.knobs)]
        if [k.kind for k in self.knobs] == ["width"]:  # around zero: between the range's |x|
            far = max(abs(low), abs(high))
            near = 0.0 if low <= 0.0 <= high else min(abs(low), abs(high))
            found = [near + (far - near) / 3.0]
        return found

    def fits_range(self, low: float, high: float) -> bool:
        """Whether the form is finite over [low, high] for some parameters."""
        if self.knobs:
            return True
        ends = np.array([low, high, 0.0] if low <= 0.0 <= high else [low, high])
        return all(bool(np.isfinite(c).all()) for c in self.values(ends))


NOTHING = Form("nothing", "nothing", ())


def _form(name: str, family: str, columns: str, knobs: str = "",
          powers: Sequence[int | Fraction | None] = ()) -> Form:
    """A form from text: columns separated by ";", knobs as "name kind, name kind"."""
    inside = tuple(Knob(*entry.strip().split(" ", 1))  # type: ignore[arg-type]  # kinds of the table
                   for entry in knobs.split(",") if entry)
    names = {"x", *(k.name for k in inside)}
    parts = tuple(parse(text, names, name) for text in columns.split(";"))
    return Form(name, family, parts, inside, tuple(powers) or (0,) * len(parts))


def _polynomials(degree: int = 5) -> list[Form]:
    """Sums of two or more powers up to a degree, and the single ones above the third."""
    made = []
    for size in range(1, degree + 1):
        for powers in combinations(range(1, degree + 1), size):
            if size == 1 and powers[0] <= 3:
                continue
            text = ";".join(f"x**{p}" for p in powers)
            name = "polynomial " + " + ".join(f"x^{p}" if p > 1 else "x" for p in powers)
            made.append(_form(name, "polynomial", text, powers=powers))
    return made


LIBRARY: tuple[Form, ...] = (
    NOTHING,
    _form("linear", "linear", "x", powers=(1,)),
    _form("quadratic", "quadratic", "x**2", powers=(2,)),
    _form("cubic", "cubic", "x**3", powers=(3,)),
    _form("shifted cubic", "cubic", "(x - c)**3", "c location", (3,)),
    _form("absolute value", "absolute value", "abs(x)", powers=(1,)),
    _form("shifted absolute value", "absolute value", "abs(x - c)", "c location", (1,)),
    _form("signed square", "signed square", "x*abs(x)", powers=(2,)),
    _form("shifted signed square", "signed square", "(x - c)*abs(x - c)", "c location", (2,)),
    _form("signed power", "signed power", "signed_power(x, n)", "n exponent", (None,)),
    _form("absolute power", "absolute power", "abs_power(x, n)", "n exponent", (None,)),
    _form("sign", "sign", "sign(x)"),
    _form("shifted sign", "sign", "sign(x - c)", "c location"),
    _form("sign and linear", "sign and linear", "sign(x);x", powers=(0, 1)),
    _form("Stribeck", "Stribeck", "sign(x);sign(x)*exp(-(b*x)**2)", "b rate"),
    _form("tanh", "tanh", "tanh(b*x)", "b rate"),
    _form("shifted tanh", "tanh", "tanh(b*(x - c))", "b rate,c location"),
    _form("sine", "sine", "sin(b*x)", "b frequency"),
    _form("cosine", "cosine", "cos(b*x)", "b frequency"),
    _form("shifted sine", "sine", "sin(b*x);cos(b*x)", "b frequency"),
    _form("exponential", "exponential", "exp(b*x)", "b signed rate"),
    _form("logarithm", "logarithm", "log(x)"),
    _form("shifted logarithm", "logarithm", "log(x - c)", "c below"),
    _form("mirrored logarithm", "logarithm", "log(c - x)", "c above"),
    _form("square root", "square root", "sqrt(x)", powers=(HALF,)),
    _form("shifted square root", "square root", "sqrt(x - c)", "c below", (HALF,)),
    _form("mirrored square root", "square root", "sqrt(c - x)", "c above", (HALF,)),
    _form("reciprocal", "reciprocal", "1/x", powers=(-1,)),
    _form("shifted reciprocal", "reciprocal", "1/(x - c)", "c below", (-1,)),
    _form("mirrored reciprocal", "reciprocal", "1/(x - c)", "c above", (-1,)),
    _form("inverse square", "inverse square", "1/x**2", powers=(-2,)),
    _form("shifted inverse square", "inverse square", "1/(x - c)**2", "c below", (-2,)),
    _form("mirrored inverse square", "inverse square", "1/(x - c)**2", "c above", (-2,)),
    _form("Gaussian", "Gaussian", "exp(-(b*x)**2)", "b rate"),
    _form("shifted Gaussian", "Gaussian", "exp(-(b*(x - c))**2)", "b rate,c location"),
    _form("saturation", "saturation", "clip(x, -w, w)", "w width", (1,)),
    _form("shifted saturation", "saturation", "clip(x - c, -w, w)", "w width,c location", (1,)),
    _form("dead zone", "dead zone", "dead_zone(x, w)", "w width", (1,)),
    _form("shifted dead zone", "dead zone", "dead_zone(x - c, w)", "w width,c location", (1,)),
    _form("piecewise linear", "piecewise linear", "x;abs(x - c)", "c location", (1, 1)),
    *_polynomials(),
)  # definition: the forms that compete


def user_form(expression: sp.Expr | str, argument: str = "x", name: str | None = None) -> Form:
    """A form from an expression in one argument; its other symbols are parameters.

    Parameters that enter linearly are amplitudes and an offset: they are estimated in closed form.
    The others are looked for as rates unless they shift the argument.

    Raises:
        BadModel: A formula that cannot be read, or without its argument.

    >>> form = user_form("q*sin(w*x)*exp(-x)")
    >>> form.columns, [k.name for k in form.knobs]
    ((exp(-x)*sin(w*x),), ['w'])
    """
    if isinstance(expression, str):
        words = set("".join(ch if ch.isalnum() or ch == "_" else " " for ch in expression).split())
        names = {w for w in words if w.isidentifier() and w not in FUNCTIONS and w != "pi"}
        expression = parse(expression, names, "a candidate")
    expr = expression.xreplace({s: symbol(s.name) for s in expression.free_symbols})
    own = symbol(argument)
    if own not in expr.free_symbols:
        raise errors.BadModel(errors.candidate_without_argument(str(expression), argument))
    rest = sorted(expr.free_symbols - {own}, key=lambda s: s.name)
    linear: list[sp.Symbol] = []
    for s in rest:
        slope = expr.diff(s)
        if not slope.has(s) and not any(slope.has(q) for q in linear):
            linear.append(s)
    columns = [expr.diff(s) for s in linear]
    left = expanded(expr - sp.Add(*(s * c for s, c in zip(linear, columns, strict=True))))
    columns = [c for c in columns if own in c.free_symbols]
    if left != 0 and own in left.free_symbols:
        columns.append(left)
    knobs = tuple(Knob(s.name, "location" if _shifts(expr, own, s) else "signed rate")
                  for s in rest if s not in linear)
    swapped = tuple(c.xreplace({own: X}) for c in columns)
    label = name or str(expr)
    alike = [X, *(symbol(k.name) for k in knobs if k.kind == "location")]
    return Form(label, label, swapped, knobs, tuple(_power(c, alike) for c in swapped))


def _power(column: sp.Expr, alike: Sequence[sp.Symbol]) -> Fraction | None:
    """The power of x's unit that a column has where others of its symbols have that unit as well.

    >>> _power(parse("sqrt(x - c)", {"x", "c"}, "a candidate"), [X, symbol("c")])
    Fraction(1, 2)
    """
    by = sp.Symbol("by", positive=True)
    ratio = sp.simplify(column.xreplace({s: by * s for s in alike}) / column)
    degree = sp.nsimplify(sp.simplify(sp.log(ratio) / sp.log(by)))
    return Fraction(int(degree.p), int(degree.q)) if degree.is_Rational else None


def _shifts(expr: sp.Expr, x: sp.Symbol, s: sp.Symbol) -> bool:
    """Whether s moves the argument: f depends on x - s or x + s alone."""
    moved = sp.Symbol("moved", real=True)
    return any(x not in expr.subs(s, sign * (x - moved)).simplify().free_symbols
               for sign in (1, -1))
