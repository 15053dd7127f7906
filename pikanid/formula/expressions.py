"""Text to SymPy and back, for equations that a user writes in a model file.

The grammar is a whitelist: numbers, names, ``+ - * / **``, parentheses and the functions of
`FUNCTIONS`.  Python's own grammar is used to *read* the text (`ast.parse`); nothing is ever
evaluated, so a model file from a stranger can do no more than describe a formula.

Non-smooth functions stay symbolic nodes (`sign`, `abs`, `clip`, ...): the simulator switches at
their kinks exactly instead of rounding them off.
"""

from __future__ import annotations

import ast
import difflib
import keyword
from collections.abc import Collection, Mapping

import sympy as sp

from pikanid import errors
from pikanid.formula.functions import abs_power, clip, log_abs, signed_power
from pikanid.formula.limits import MAX_DEPTH, MAX_LENGTH, MAX_NAME, MAX_POWER, Work
from pikanid.formula.printing import Printer
from pikanid.formula.real_numbers import (
    Sentence,
    exponent_too_large,
    finite_number,
    to_number,
    wrong_number,
    wrong_part,
    wrong_power,
)

TIME = sp.Symbol("t", real=True)


def symbol(name: str) -> sp.Symbol:
    """The real symbol that stands for `name` in every model.

    >>> symbol("theta").is_real
    True
    """
    return sp.Symbol(name, real=True)


def _step(x: sp.Expr) -> sp.Expr:
    return sp.Heaviside(x, sp.Rational(1, 2))


def _dead_zone(x: sp.Expr, width: sp.Expr) -> sp.Expr:
    return x - clip(x, -width, width)


FUNCTIONS: Mapping[str, tuple[int, object]] = {
    "sin": (1, sp.sin), "cos": (1, sp.cos), "tan": (1, sp.tan),
    "asin": (1, sp.asin), "acos": (1, sp.acos), "atan": (1, sp.atan), "atan2": (2, sp.atan2),
    "sinh": (1, sp.sinh), "cosh": (1, sp.cosh), "tanh": (1, sp.tanh),
    "exp": (1, sp.exp), "log": (1, sp.log), "sqrt": (1, sp.sqrt),
    "abs": (1, sp.Abs), "sign": (1, sp.sign), "step": (1, _step),
    "min": (2, sp.Min), "max": (2, sp.Max), "clip": (3, clip), "dead_zone": (2, _dead_zone),
    "abs_power": (2, abs_power), "signed_power": (2, signed_power), "log_abs": (1, log_abs),
}  # definition: numbers of arguments  # fmt: skip
RESERVED = frozenset(FUNCTIONS) | {"pi", "t"}


def check_name(name: str, what: str) -> str:
    """Return `name` when it may name a state, input, parameter, output or spline.

    >>> check_name("theta_dot", "state")
    'theta_dot'
    """
    if not isinstance(name, str) or not name.isidentifier() or not name.isascii() or (
            name.startswith("_") or len(name) > MAX_NAME):
        raise errors.BadModel(errors.bad_name(name, what))
    if name in RESERVED or keyword.iskeyword(name):  # the grammar is Python's
        raise errors.BadModel(errors.reserved_name(name, what))
    return name


def parse(text: str, names: Collection[str], where: str,
          functions: Collection[str] = (), work: Work | None = None) -> sp.Expr:
    """Parse one formula.

    Args:
        text: The formula, for example ``"u_x/l*cos(theta) - g/l*sin(theta)"``.
        names: The symbols that may occur (``t`` and ``pi`` always may).
        where: What the formula belongs to, for the error message.
        functions: Names of one-argument functions that the model adds (spline edges).
        work: Shared by the formulas of one file, so that all of them together stay cheap.

    Raises:
        BadModel: Unknown name or function, or anything outside the grammar.

    >>> parse("a*sin(x)**2", {"a", "x"}, "equation of x")
    a*sin(x)**2
    """
    if len(text) > MAX_LENGTH:
        raise errors.BadModel(errors.formula_too_long(where, MAX_LENGTH))
    try:
        tree = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, MemoryError, RecursionError) as problem:
        detail = problem.msg if isinstance(problem, SyntaxError) else "it is nested too deeply"
        raise errors.BadModel(errors.formula_syntax(text, where, detail)) from None
    reader = _Reader(frozenset(names), frozenset(functions), text, where, work or Work())
    return reader.read(tree, 0)


def to_text(expression: sp.Expr) -> str:
    """The formula as text that `parse` reads back to an equal expression.

    >>> to_text(parse("abs(x)*max(x, 0.1)", {"x"}, "test"))
    'abs(x)*max(0.1, x)'
    """
    return str(Printer().doprint(expression))


def to_real(expression: sp.Expr | float | str, where: str = "A formula") -> sp.Expr:
    """The expression with every free symbol replaced by the model's real symbol of that name.

    Args:
        expression: SymPy, a finite number, or the name of one symbol; SymPy's own conversion is
            never asked, because it evaluates the texts in lists and tables as Python.
        where: What it is, to begin an error message with.

    Raises:
        BadModel: If it is anything else.

    >>> to_real(2) + to_real(sp.Symbol("k"))
    k + 2
    """
    if isinstance(expression, str):
        return symbol(expression)
    if isinstance(expression, sp.Expr):
        return expression.xreplace(
            {s: symbol(s.name) for s in expression.free_symbols if s != symbol(s.name)})
    if (number := finite_number(expression)) is not None:
        return number
    raise errors.BadModel(errors.not_a_formula(where, expression))


class _Reader:
    """Walks Python's syntax tree and builds SymPy, refusing every node outside the whitelist."""

    def __init__(self, names: frozenset[str], functions: frozenset[str], text: str, where: str,
                 work: Work):
        self.names, self.functions, self.text, self.where = names, functions, text, where
        self.work = work

    def source(self, node: ast.AST) -> str:
        return ast.get_source_segment(self.text.strip(), node) or self.text

    def fail(self, node: ast.AST) -> errors.BadModel:
        return errors.BadModel(errors.formula_forbidden(
            self.source(node), self.where, sorted(FUNCTIONS),
            isinstance(node, ast.Compare | ast.IfExp)))

    def afford(self, fits: bool) -> None:
        if not fits:
            raise errors.BadModel(errors.formula_work(self.text, self.where))

    def read(self, node: ast.AST, depth: int) -> sp.Expr:
        if depth > MAX_DEPTH:
            raise errors.BadModel(errors.formula_syntax(self.text, self.where, "nested too deeply"))
        if isinstance(node, ast.BinOp):
            return self.chain(node, depth)
        return self.real(node, self.part(node, depth))

    def chain(self, node: ast.BinOp, depth: int) -> sp.Expr:
        """a + b + c ... leans to the left, however long it is: that is no nesting."""
        rest = [node]
        while isinstance(rest[-1].left, ast.BinOp):
            rest.append(rest[-1].left)
        self.afford(self.work.product(
            sum(isinstance(step.op, ast.Mult | ast.Div) for step in rest)))
        first, sign = rest[-1].left, 1
        # a minus before a product is not its first factor's: SymPy would carry it into a sum there
        if isinstance(first, ast.UnaryOp) and isinstance(first.op, ast.USub) and isinstance(
                rest[-1].op, ast.Mult | ast.Div):
            first, sign = first.operand, -1
        terms = [self.read(first, depth + 1)]
        for step in reversed(rest):
            right = self.read(step.right, depth + 1)
            if not isinstance(step.op, ast.Mult | ast.Div):
                terms[0], sign = sign * terms[0], 1
            if isinstance(step.op, ast.Add | ast.Sub):
                terms.append(right if isinstance(step.op, ast.Add) else -right)
            else:
                terms = [self.binary(step, step.op, sp.Add(*terms), right)]
                self.sound(step, wrong_number(terms[0]))  # before anything grows from it
        return self.real(node, sp.Add(sign * terms[0], *terms[1:]))

    def sound(self, node: ast.AST, wrong: Sentence | None) -> None:
        """Raise the sentence about a part of the formula, if there is one."""
        if wrong is not None:
            raise errors.BadModel(wrong(self.source(node), self.where))

    def real(self, node: ast.AST, result: sp.Expr) -> sp.Expr:
        """The expression, if every part of it is real; a number must also be finite."""
        self.sound(node, wrong_part(result))
        return result

    def part(self, node: ast.AST, depth: int) -> sp.Expr:
        match node:
            case ast.Constant(value=bool() | complex()):
                raise self.fail(node)
            case ast.Constant(value=int() | float() as value):
                return self.number(value, node)
            case ast.Name(id=name):
                return self.name(name)
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return -self.read(operand, depth + 1)
            case ast.UnaryOp(op=ast.UAdd(), operand=operand):
                return self.read(operand, depth + 1)
            case ast.Call(func=ast.Name(id=name), args=args, keywords=[]):
                return self.call(node, name, [self.read(a, depth + 1) for a in args], depth)
        raise self.fail(node)

    def number(self, value: int | float, node: ast.AST) -> sp.Expr:
        found = to_number(value)
        self.sound(node, errors.formula_overflows if found is None else None)
        return found

    def name(self, name: str) -> sp.Expr:
        if name in self.names or name in ("t", "pi"):
            return sp.pi if name == "pi" else symbol(name)
        close = difflib.get_close_matches(name, [*self.names, *FUNCTIONS], 1)
        raise errors.BadModel(errors.unknown_symbol(name, self.where, sorted(self.names), close))

    def binary(self, node: ast.AST, op: ast.operator, left: sp.Expr, right: sp.Expr) -> sp.Expr:
        match op:
            case ast.Mult():
                return left * right
            case ast.Div():
                if right.is_zero:
                    raise errors.BadModel(errors.division_by_zero(self.text, self.where))
                return left / right
            case ast.Pow():
                return self.power(node, left, right)
            case ast.BitXor():
                raise errors.BadModel(errors.caret_power(self.text, self.where))
        raise self.fail(node)

    def power(self, node: ast.AST, base: sp.Expr, exponent: sp.Expr) -> sp.Expr:
        if base.is_zero and exponent.is_negative:
            raise errors.BadModel(errors.division_by_zero(self.text, self.where))
        self.sound(node, wrong_power(base, exponent))
        self.afford(self.work.power(exponent))
        small = exponent.is_Rational and abs(exponent.p) <= 8 and exponent.q <= 8
        if base.is_number and exponent.is_number and not (small and abs(float(base)) < 1e6):
            # exact big-integer powers can fill the memory: these become floating point
            return sp.Float(float(base) ** float(exponent))
        return base**exponent

    def call(self, node: ast.AST, name: str, args: list[sp.Expr], depth: int) -> sp.Expr:
        if name in self.functions:
            count, build = 1, sp.Function(name, real=True)
        elif name in FUNCTIONS:
            count, build = FUNCTIONS[name]
        else:
            known = sorted([*FUNCTIONS, *self.functions])
            close = difflib.get_close_matches(name, known, 1)
            raise errors.BadModel(errors.unknown_function(name, self.where, known, close))
        if len(args) != count:
            raise errors.BadModel(errors.wrong_argument_count(name, count, len(args), self.where))
        self.afford(self.work.call(name, depth))
        if name in ("abs_power", "signed_power") and args[1].is_number and (
                abs(float(args[1])) > MAX_POWER):
            self.sound(node, exponent_too_large)
        try:
            return build(*args)
        except (ValueError, TypeError, RecursionError):  # SymPy: complex or not comparable
            raise self.fail(node) from None
