"""Formulas that are read again and again: those of effects that many models are extended by."""

from __future__ import annotations

import functools
import re
from collections.abc import Collection

import sympy as sp

from pikanid import errors
from pikanid.formula.expressions import parse

_WORDS = re.compile(r"[^\W\d]\w*")


def parse_again(text: str, names: Collection[str], where: str, functions: Collection[str] = ()
                ) -> sp.Expr:
    """As `parse`: what a formula is depends on nothing but itself and on which of its own words are
    names.

    >>> parse_again("k*x", {"k", "x"}, "equation of x") is parse_again(
    ...     "k*x", {"k", "x", "more"}, "equation of y")
    True
    """
    words = frozenset(_WORDS.findall(text))
    try:
        return _parsed(text, words & frozenset(names), words & frozenset(functions))
    except errors.BadModel:
        return parse(text, names, where, functions)  # what is said of it names all that there is


@functools.lru_cache(maxsize=4096)
def _parsed(text: str, names: frozenset[str], functions: frozenset[str]) -> sp.Expr:
    return parse(text, names, "", functions)
