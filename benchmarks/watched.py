"""Numbers that note which of their other values would have decided otherwise.

A program that runs with such a number in the place of a setting does what it does with the number
itself; where it compares, the other values of the setting are compared as well.  A value that has
decided nothing otherwise, and was not looked at in any other way, would have changed nothing.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np


def _applied(function: Callable[..., Any], *inputs: Any) -> Any:
    """A function of numbers some of which are watched; what it decides is a plain answer."""
    watched = [i for i in inputs if isinstance(i, Watched)]
    value = function(*(i.value if isinstance(i, Watched) else i for i in inputs))
    others = {name: function(*(i.others.get(name, i.value) if isinstance(i, Watched) else i
                               for i in inputs))
              for one in watched for name in one.others}
    if np.asarray(value).dtype.kind == "b":
        watched[0].noted.update(
            name for name, other in others.items() if not np.array_equal(value, other))
        return value
    return Watched(value, others, watched[0].noted)


def _operator(function: Callable[..., Any]) -> Callable[[Any, Any], Any]:
    return lambda self, other: _applied(function, self, other)


def _reflected(function: Callable[..., Any]) -> Callable[[Any, Any], Any]:
    return lambda self, other: _applied(function, other, self)


class Watched:
    """A number, or an array made of one, with the values that other settings would give it.

    What is computed from it by operators and functions of numpy is watched in turn.  Whatever else
    looks at it (a loop that counts so far, a function that takes floats) gets the number, and all
    its changes are noted.

    Attributes:
        value: What the program gets.
        others: Its other values, by the name of the change that makes them.
        noted: Names of the changes that may lead elsewhere, shared by all numbers of a program.

    >>> noted = set()
    >>> limit = Watched(4.0, {"smaller": 3.0, "larger": 5.0}, noted)
    >>> 2 * limit + 1 > 8.5, sorted(noted)
    (True, ['smaller'])
    >>> (np.array([1.0, 9.0]) < limit).tolist(), sorted(noted)
    ([True, False], ['smaller'])
    >>> float(limit), sorted(noted)
    (4.0, ['larger', 'smaller'])
    """

    def __init__(self, value: Any, others: Mapping[str, Any], noted: set[str]):
        self.value, self.others, self.noted = value, others, noted

    def seen(self) -> Any:
        """The value, for whom nothing else will do."""
        self.noted.update(self.others)
        return self.value

    __add__, __radd__ = _operator(operator.add), _reflected(operator.add)
    __sub__, __rsub__ = _operator(operator.sub), _reflected(operator.sub)
    __mul__, __rmul__ = _operator(operator.mul), _reflected(operator.mul)
    __truediv__, __rtruediv__ = _operator(operator.truediv), _reflected(operator.truediv)
    __floordiv__, __rfloordiv__ = _operator(operator.floordiv), _reflected(operator.floordiv)
    __pow__, __rpow__ = _operator(operator.pow), _reflected(operator.pow)
    __lt__, __gt__ = _operator(operator.lt), _operator(operator.gt)
    __le__, __ge__ = _operator(operator.le), _operator(operator.ge)

    def __eq__(self, other: object) -> Any:
        return _applied(operator.eq, self, other)

    def __hash__(self) -> int:
        return id(self)  # what is kept by it serves nobody else

    def __neg__(self) -> Any:
        return _applied(operator.neg, self)

    def __abs__(self) -> Any:
        return _applied(abs, self)

    def __round__(self, digits: int | None = None) -> Any:
        return _applied(lambda number: round(number, digits), self)

    def __bool__(self) -> bool:
        return bool(_applied(bool, self))

    def __float__(self) -> float:
        return float(self.seen())

    def __int__(self) -> int:
        return int(self.seen())

    def __index__(self) -> int:
        return operator.index(self.seen())

    def __format__(self, spec: str) -> str:
        return format(self.seen(), spec)

    def __repr__(self) -> str:
        return repr(self.seen())

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        return np.asarray(self.seen(), dtype)

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **named: Any) -> Any:
        if method == "__call__" and not named:
            return _applied(ufunc, *inputs)
        plain = [i.seen() if isinstance(i, Watched) else i for i in inputs]
        return getattr(ufunc, method)(*plain, **named)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)  # what a number has not
        return getattr(self.seen(), name)


def lifted(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function of numbers that does nothing but return one, of watched ones too.

    >>> from math import sqrt
    >>> lifted(sqrt)(Watched(4.0, {"larger": 9.0}, set())).others
    {'larger': 3.0}
    """
    def of(*inputs: Any) -> Any:
        given = any(isinstance(i, Watched) for i in inputs)
        return _applied(function, *inputs) if given else function(*inputs)

    return of
