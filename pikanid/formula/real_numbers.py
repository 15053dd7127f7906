"""Which numbers a formula may hold: real ones that a float can hold, and parts that stay small."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import sympy as sp

from pikanid import errors
from pikanid.formula.limits import MAX_BITS, MAX_POWER
from pikanid.storage.entries import is_integer, is_number

Sentence = Callable[[str, str], str]  # of the part of a formula, and of what the formula belongs to


def to_number(value: float) -> sp.Expr | None:
    """A real number as SymPy holds it, None where no float can hold it.

    >>> to_number(3), to_number(10**400)
    (3, None)
    """
    if is_integer(value) and abs(value) < 2**53:
        return sp.Integer(int(value))
    try:
        real = float(value)
    except OverflowError:
        return None
    return sp.Float(real) if math.isfinite(real) else None


def finite_number(value: Any) -> sp.Expr | None:
    """What `to_number` makes of anything that is a number, None of the rest.

    >>> finite_number(2.5), finite_number("2.5")
    (2.50000000000000, None)
    """
    return to_number(value) if is_number(value) else None


def wrong_number(expression: sp.Expr) -> Sentence | None:
    """What is wrong with a formula that is a number: a sentence to be, None where nothing is.

    A formula of symbols is no number yet, and passes.

    >>> wrong_number(sp.sqrt(-1))("sqrt(-1)", "a test")
    "'sqrt(-1)' in the formula of a test is not a real number."
    >>> wrong_number(sp.sqrt(2)) is None
    True
    """
    if not expression.is_number:
        return None
    try:
        if math.isfinite(float(expression)):
            return None
    except OverflowError:
        return errors.formula_overflows
    except TypeError:  # complex, or infinite in no direction
        return _unreal(expression) or errors.formula_not_real
    return _unreal(expression) or errors.formula_overflows


def wrong_part(expression: sp.Expr) -> Sentence | None:
    """What is wrong with a part of a formula, a number or not, None where nothing is.

    Exact numbers without end, which whole powers of products make, are wrong as well.

    >>> x = sp.Symbol("x", real=True)
    >>> wrong_part(sp.sqrt(-(x**2)))("sqrt(-x**2)", "a test")
    "'sqrt(-x**2)' in the formula of a test is not a real number."
    """
    if found := wrong_number(expression) or _unreal(expression):
        return found
    for part in (expression, *expression.args):
        number = part if part.is_Rational else part.as_coeff_Mul()[0]
        if number.is_Rational and max(abs(number.p), number.q).bit_length() > MAX_BITS:
            return errors.formula_overflows
    return None


def wrong_power(base: sp.Expr, exponent: sp.Expr) -> Sentence | None:
    """What is wrong with a power before it is taken: it can fill the memory.

    >>> wrong_power(sp.Integer(9), sp.Integer(9**9))("9**9**9", "a test")[:48]
    "'9**9**9' in the formula of a test overflows: no"
    """
    if not exponent.is_number:
        return None
    power, scale = float(exponent), base.as_coeff_Mul()[0]
    if base.is_number and (found := _wrong_value(float(base), power)):
        return found
    if abs(power) > MAX_POWER:
        return exponent_too_large
    if scale.is_Rational and scale != -1 and (
            abs(power) * (max(abs(scale.p), scale.q).bit_length() - 1) > MAX_BITS):
        return errors.formula_overflows
    return None


def exponent_too_large(part: str, where: str) -> str:
    """The sentence about an exponent that would be multiplied out into numbers without end.

    >>> exponent_too_large("x**1e9", "a test")
    "'x**1e9' in the formula of a test has an exponent beyond 1000, the largest that is read."
    """
    return errors.formula_exponent(part, where, MAX_POWER)


def _wrong_value(base: float, power: float) -> Sentence | None:
    """What is wrong with a power of two numbers, in floating point."""
    try:
        value = base**power
    except OverflowError:
        return errors.formula_overflows
    except ZeroDivisionError:
        return errors.formula_not_finite
    return errors.formula_not_real if isinstance(value, complex) else None


def _unreal(expression: sp.Expr) -> Sentence | None:
    if expression.has(sp.zoo, sp.nan, sp.oo):
        return errors.formula_not_finite
    return errors.formula_not_real if expression.has(sp.I) else None
