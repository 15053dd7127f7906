"""The formula language: what it reads, what it refuses, and that nothing is ever evaluated."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from pikanid import errors
from pikanid.formula.expressions import FUNCTIONS, check_name, parse, symbol, to_real, to_text
from pikanid.formula.functions import abs_power, clip, log_abs, signed_power
from pikanid.formula.remembered import parse_again

NAMES = {"x", "y", "k"}
X, Y = symbol("x"), symbol("y")


def read(text: str) -> sp.Expr:
    return parse(text, NAMES, "a test")


@pytest.mark.parametrize(("text", "expected"), [
    ("1", 1), ("0.5", sp.Float(0.5)), ("2*x + y", 2 * X + Y), ("-x**2", -(X**2)),
    ("x**-1", 1 / X), ("2**3**2", sp.Float(512)), ("x/y/2", X / Y / 2), ("x - y - 1", X - Y - 1),
    ("+x", X), ("pi*x", sp.pi * X), ("t", symbol("t")), ("  x  ", X), ("1e-3", sp.Float(1e-3)),
    ("step(x)", sp.Heaviside(X, sp.Rational(1, 2))), ("abs(x)", sp.Abs(X)),
    ("min(x, y)", sp.Min(X, Y)), ("max(x, 0)", sp.Max(X, 0)), ("clip(x, -1, 1)", clip(X, -1, 1)),
    ("dead_zone(x, y)", X - clip(X, -Y, Y)), ("abs_power(x, 2)", X**2),
    ("signed_power(x, 0)", sp.sign(X)), ("signed_power(x, 1)", X),
    ("signed_power(x, y)", signed_power(X, Y)), ("atan2(x, y)", sp.atan2(X, Y)),
    ("clip(5, 0, 1)", 1), ("abs_power(0, -1)", 0), ("abs_power(x, 0)", 1), ("log_abs(0)", 0),
    ("2**(1/3)", sp.cbrt(2)), ("sqrt(2)", sp.sqrt(2)), ("exp(1)", sp.E),
])
def test_formulas_become_the_expected_expressions(text: str, expected: object) -> None:
    assert read(text) == expected


@pytest.mark.parametrize("text", [
    "", "x y", "x;y", "x +", "(x", "x = 1", "x\n+y", "\0", "\ud800", "9" * 5000, "1or 2", "'\\d'",
    "x if y else 1", "x < y", "not x", "x and y", "x @ y", "x // y", "x % y", "~x", "x, y", "[x]",
    "{x}", "x[0]", "x.real", "lambda: 1", "f'{x}'", "'x'", "b'x'", "True", "None", "...", "1j",
    "x(1)", "(1)(2)", "sin", "sin()", "sin(x, y)", "sin(x=1)", "sin(*x)", "sin(**x)", "max(x)",
    "__import__('os')", "exec('1')", "open('/etc/passwd')", "x.__class__", "(x := 1)",
    "[a for a in x]", "await x", "yield x", "z", "x^2", "π",
])
def test_what_is_outside_the_grammar_is_refused(text: str) -> None:
    with pytest.raises(errors.BadModel):
        read(text)


@pytest.mark.parametrize("text", [
    "1/0", "1/(x - x)", "0**-1", "x**(1/0)", "log(0)", "log(x - x)", "tan(pi/2)", "atan2(0, 0)",
    "1e999", "10**400", "1e308*1e308", "9" * 4000, "exp(1000)", "exp(exp(exp(exp(9))))",
    "sqrt(-1)", "(-1)**0.5", "asin(2)", "asin(2)**2", "max(x, asin(2))", "step(asin(2))",
    "acos(3)*x", "log(-1)", "sqrt(-x**2)", "(-x**2)**0.5",
])
def test_numbers_that_are_not_real_and_finite_are_refused(text: str) -> None:
    with pytest.raises(errors.BadModel):
        read(text)


@pytest.mark.parametrize("text", [
    "(2*x)**1000000000000000", "(2*x)**(10**9)", "abs_power(2*x, 100000000000)",
    "signed_power(3*x, 100000000000)", "9**9**9**9", "2**(2**(2**(2**9)))", "x**1e300",
    "max(exp(exp(exp(exp(9)))), 1)", "-" * 5000 + "x", "(" * 5000 + "x" + ")" * 5000,
    "sin(" * 500 + "x" + ")" * 500, "x**" * 300 + "x", "x+" * 10_000 + "x", "x" * 20_001,
])
def test_formulas_made_to_exhaust_the_machine_are_refused(text: str) -> None:
    with pytest.raises(errors.BadModel):
        read(text)


def test_long_sums_are_not_nested() -> None:
    """A polynomial of 300 terms is long, not deep."""
    text = " + ".join(f"{k}*x*y**{k}" for k in range(1, 301))
    assert len(read(text).args) == 300
    assert read(to_text(read(text))) == read(text)
    assert read(" - ".join(["x"] * 300)) == -298 * X


@pytest.mark.parametrize("text", [
    "(x + 2*y)*(k + y) - (x + y)*(k + 1)", "(k + x + y)*(y - x**2) - (x + k)*(y + k)",
    "-(x + y)/(k - x)*y", "-(x + y)*2", "-2*(x + y)", "(-x - y)*k", "(-x)**2", "-x**2*(x + y)",
    "(-(x + y)*k)**3", "(-x + y)*k - x"])
def test_the_minus_of_a_product_stays_where_it_is(text: str) -> None:
    """SymPy would carry it into the first factor, were it read as a part of that."""
    found = read(text)
    assert read(to_text(found)) == found
    values = {"x": 0.7, "y": -1.3, "k": 2.1}
    assert float(found.subs({symbol(n): v for n, v in values.items()})) == pytest.approx(
        eval(text, {}, values), rel=1e-12)


def test_messages_say_what_and_where() -> None:
    with pytest.raises(errors.BadModel, match=r"'\^' .* write '\*\*'"):
        read("x^2")
    with pytest.raises(errors.BadModel, match=r"sine.*a test.*Did you mean 'sin'"):
        read("sine(x)")
    with pytest.raises(errors.BadModel, match=r"'kk' .*a test.*Did you mean 'k'"):
        read("kk*x")
    with pytest.raises(errors.BadModel, match=r"'x > 1' .*a test.* clip, .*step\(x - level\)"):
        read("sin(x > 1)")


@pytest.mark.parametrize(("text", "part", "what"), [
    ("x + 9**9**9", "9**9**9", "overflows"), ("1e999*x", "1e999", "overflows"),
    ("x + exp(1000)", "exp(1000)", "overflows"), ("(2*x)**900*(3*x)**900", "(3*x)**900", "overfl"),
    ("x*log(0)", "log(0)", "infinite or undefined"), ("atan2(0, 0)", "atan2", "infinite or undef"),
    ("x + sqrt(-1)", "sqrt(-1)", "not a real number"), ("(-2)**1.5", "(-2)**1.5", "not a real"),
    ("max(x, asin(2))", "asin(2)", "not a real"), ("sqrt(-x**2)", "sqrt(-x**2)", "not a real"),
    ("k + x**1e9", "x**1e9", "an exponent beyond 1000"), ("0.5**5000", "0.5**5000", "an exponent"),
    ("abs_power(x, 1e9)", "abs_power(x, 1e9)", "an exponent beyond 1000")])
def test_numbers_that_cannot_be_are_told_with_their_place(text: str, part: str, what: str) -> None:
    with pytest.raises(errors.BadModel, match=rf"'{re.escape(part)}.* of a test .*{what}"):
        read(text)


@pytest.mark.parametrize("name", ["t", "pi", "sin", "clip", "1a", "_s0", "a b", "", "é", "a-b",
                                  "lambda", "if"])
def test_names_that_the_language_needs_cannot_be_used(name: str) -> None:
    with pytest.raises(errors.BadModel):
        check_name(name, "state")


# --- property tests ------------------------------------------------------------------------------

TOKENS = [*"+-*/(),.^%@~<>=[]{}:;'\"_ ", "**", "//", "0", "1", "2", "0.5", "1e9", "9999999",
          "1e308",
          "x", "y", "z", "t", "pi", "lambda", " if ", " else ", " for ", " in ", *FUNCTIONS]


@settings(max_examples=400)
@given(st.one_of(st.lists(st.sampled_from(TOKENS), max_size=20).map("".join), st.text(max_size=30)))
def test_any_text_is_read_or_refused_in_one_way(text: str) -> None:
    try:
        expr = read(text)
    except errors.BadModel:
        return
    assert {s.name for s in expr.free_symbols} <= NAMES | {"t"}
    assert read(to_text(expr)) == expr


def well_formed(depth: int = 3) -> st.SearchStrategy[str]:
    leaf = st.one_of(st.sampled_from(["x", "y", "k", "t", "pi"]),
                     st.integers(-9, 9).map(str), st.floats(-50, 50).map(repr))
    if depth == 0:
        return leaf
    inner = well_formed(depth - 1)
    binary = st.tuples(inner, st.sampled_from("+-*/"), inner).map(
        lambda p: f"({p[0]}){p[1]}({p[2]})")
    one = st.sampled_from([n for n, (count, _) in FUNCTIONS.items() if count == 1])
    two = st.sampled_from([n for n, (count, _) in FUNCTIONS.items() if count == 2])
    return st.one_of(
        leaf, binary, st.tuples(one, inner).map(lambda p: f"{p[0]}({p[1]})"),
        st.tuples(two, inner, inner).map(lambda p: f"{p[0]}({p[1]}, {p[2]})"),
        st.tuples(inner, st.integers(-3, 3)).map(lambda p: f"({p[0]})**{p[1]}"),
        inner.map(lambda a: f"clip({a}, -2, 1.5)"))


PYTHON = {
    **{n: getattr(math, n) for n in ("sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh",
                                     "cosh", "tanh", "exp", "log", "sqrt", "pi")},
    "abs": abs, "min": min, "max": max,
    "sign": lambda a: float(np.sign(a)), "step": lambda a: float(np.heaviside(a, 0.5)),
    "clip": lambda a, lo, hi: min(max(a, lo), hi),
    "dead_zone": lambda a, w: a - min(max(a, -w), w),
    "abs_power": lambda a, n: abs(a) ** n, "log_abs": lambda a: math.log(abs(a)),
    "signed_power": lambda a, n: float(np.sign(a)) * abs(a) ** n,
}


@settings(max_examples=150)
@given(well_formed())
def test_formulas_mean_what_python_means(text: str) -> None:
    """Read, printed, read again and evaluated by SymPy, against Python's own arithmetic."""
    try:
        expr = read(text)
    except errors.BadModel:
        return  # a number in it is not real
    again = read(to_text(expr))
    assert again == expr
    values = {"x": 0.3719, "y": -1.227, "k": 2.618, "t": 0.911}
    try:
        expected = eval(text, {"__builtins__": {}}, {**PYTHON, **values})  # our own text
    except (ValueError, OverflowError, ZeroDivisionError):
        return
    if isinstance(expected, complex) or not abs(expected) < 1e12:
        return
    found = complex(again.subs({symbol(n): sp.Float(v, 40) for n, v in values.items()}).evalf(30))
    # rounding in Python's own evaluation can be amplified; a wrong formula is wrong in every digit
    assert found.real == pytest.approx(float(expected), rel=1e-6, abs=1e-6)


@settings(max_examples=100)
@given(st.floats(allow_nan=False, allow_infinity=False))
def test_every_finite_number_survives_printing(value: float) -> None:
    assert float(read(to_text(sp.Float(value) * X)).subs(X, 1)) == value
    assert float(read(repr(value))) == value


def test_symbols_from_elsewhere_become_the_models_own() -> None:
    assert to_real(sp.Symbol("x") + sp.Symbol("x", positive=True)) == 2 * X
    assert to_real("x") == X
    assert to_real(3) == 3


@pytest.mark.parametrize("expr", [abs_power(X, Y), signed_power(X, Y), abs_power(X, 0.5),
                                  signed_power(X, 1.5), clip(X, -1, 2), clip(X * Y, -0.2, 0.3),
                                  clip(X, -Y, Y), log_abs(X) * Y])
def test_derivatives_of_own_functions_agree_with_differences(expr: sp.Expr) -> None:
    from pikanid.simulation import numpy_functions

    def power(a: float, n: float) -> float:
        return abs(a) ** n

    tools = {"abs_power": power, "signed_power": lambda a, n: np.sign(a) * power(a, n),
             "clip": lambda a, lo, hi: min(max(a, lo), hi), "log_abs": numpy_functions.log_abs}
    value = sp.lambdify([X, Y], expr, [tools, "numpy"])
    for q, shift in ((X, (1, 0)), (Y, (0, 1))):
        slope = sp.lambdify([X, Y], expr.diff(q), [tools, "numpy"])
        for x, y in ((0.7, 1.3), (-0.4, 2.2), (2.6, 0.5), (-3.0, 1.1)):
            h = 1e-5
            ahead = value(x + h * shift[0], y + h * shift[1])
            back = value(x - h * shift[0], y - h * shift[1])
            assert slope(x, y) == pytest.approx((ahead - back) / (2 * h), rel=1e-7, abs=1e-8)


def test_a_formula_that_was_read_before_is_refused_where_its_names_are_none() -> None:
    assert parse_again("k*x", {"k", "x"}, "equation of x") == parse("k*x", {"k", "x"}, "there")
    with pytest.raises(errors.BadModel, match="equation of y"):
        parse_again("k*x", {"k", "y"}, "equation of y")
    with pytest.raises(errors.BadModel, match="equation of z"):
        parse_again("k*x", {"k", "z"}, "equation of z")
