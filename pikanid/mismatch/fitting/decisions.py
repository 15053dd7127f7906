"""Comparisons that decide something, with a dead band that rounding stays inside.

A criterion is a sum of squares over thousands of rows along simulated motions.  Another processor,
or another number of threads, adds them up in another order and gets other last digits.  What is
compared with a threshold, or with another criterion, therefore counts as equal within a band far
above such errors and far below what means anything: fits stop at a hundredth of χ².  Ties fall the
same way everywhere, and what is sorted stays in the same order.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from math import isfinite
from typing import Any, TypeVar

import numpy as np

RELATIVE = 1e-9  # numerical: of the larger number: rounding of sums and simulations stays below
BAND = 1e-6  # numerical: of χ², and of criteria built from it: no statistic depends on so little
Item = TypeVar("Item")


def below(a: float, b: float, band: float = BAND) -> bool:
    """Whether a criterion `a` is lower than another one, or than a threshold, `b`, beyond rounding.

    Args:
        a, b: In units of χ².
        band: Least difference that counts; 0 for numbers of any size and unit (RMSEs, p-values).

    >>> below(1.0, 1.0 + 1e-12), below(1.0, 1.001), below(1e9, 1e9 + 0.1)
    (False, True, False)
    """
    if not (isfinite(a) and isfinite(b)):
        return a < b
    return b - a > max(band, RELATIVE * max(abs(a), abs(b)))


def smaller(a: float, b: float) -> bool:
    """The same of numbers of any size: RMSEs, p-values.

    >>> smaller(1e-9, 1.001e-9), smaller(2e-9, 2e-9 * (1 + 1e-12))
    (True, False)
    """
    return below(a, b, 0.0)


def in_order(items: Iterable[Item], value: Callable[[Item], float], tie: Callable[[Item], Any],
             band: float = BAND) -> list[Item]:
    """Sorted by a criterion, least first; those that differ by rounding only, by `tie`.

    >>> in_order(["b", "a", "c"], lambda s: {"a": 1 + 1e-12, "b": 1.0, "c": 0.5}[s], str)
    ['c', 'a', 'b']
    """
    pairs = sorted(((value(item), item) for item in items), key=lambda pair: pair[0])
    done: list[Item] = []
    group: list[Item] = []
    last = 0.0
    for number, item in pairs:
        if group and below(last, number, band):
            done += sorted(group, key=tie)
            group = []
        group.append(item)
        last = number
    return done + sorted(group, key=tie)


def steady(values: np.ndarray) -> np.ndarray:
    """Numbers (...) to nine digits, for stable sorts of many: twins stay equal whatever rounding
    has made of them.

    >>> [float(x) for x in steady(np.array([1 / 3, 0.0, -2e15 / 3]))]
    [0.333333333, 0.0, -666666667000000.0]
    """
    size = np.maximum(np.abs(values), 1e-200)
    digits = 10.0 ** (8 - np.floor(np.log10(size)))
    return np.asarray(np.round(values * digits) / digits)
