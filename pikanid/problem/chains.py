"""Which states are time derivatives of which: one approximator then serves several states.

θ' = θ̇ says that θ̇ needs no approximator of its own: it is the derivative of the one for θ, exactly.
In this *second-order form* (chains of any length) only the last equation of a chain leaves a
physics residual; in the *state form*, as Eq. (2) is printed, every state has its own approximator.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Literal

from pikanid.formula.expressions import symbol
from pikanid.model import Model

Form = Literal["second_order", "state"]


@dataclass(frozen=True)
class Chains:
    """State s is the `order[s]`-th derivative of approximator `root[s]`.

    The equation of state `top[i]`, the last of its chain, is the physics of approximator i.
    """

    root: tuple[int, ...]
    order: tuple[int, ...]
    top: tuple[int, ...]

    @functools.cached_property
    def lengths(self) -> tuple[int, ...]:
        """Order m of the differential equation that each approximator obeys."""
        return tuple(self.order[state] + 1 for state in self.top)


def find_chains(model: Model, form: Form = "second_order") -> Chains:
    """Chains of the model's equations: x' = v exactly, v the derivative of one state at most.

    >>> from pikanid.model import Output, State
    >>> x, v, k = (symbol(name) for name in "xvk")
    >>> oscillator = Model("oscillator", (State("x"), State("v")), (), (), {"x": v, "v": -x},
    ...                    (Output("x", x),))
    >>> find_chains(oscillator)
    Chains(root=(0, 0), order=(0, 1), top=(1,))
    >>> find_chains(oscillator, "state")
    Chains(root=(0, 1), order=(0, 0), top=(0, 1))
    """
    names = model.state_names
    index = {symbol(name): i for i, name in enumerate(names)}
    follows: dict[int, int] = {}
    if form == "second_order":
        for state, name in enumerate(names):
            after = index.get(model.equations[name])
            if after is None or after == state or after in follows.values():
                continue
            if _reaches(follows, after, state):  # x' = y, y' = x: a circle has no last equation
                continue
            follows[state] = after
    root, order = [-1] * len(names), [0] * len(names)
    top: list[int] = []
    for first in range(len(names)):
        if first in follows.values():
            continue
        state, depth = first, 0
        root[state] = len(top)
        while state in follows:
            state, depth = follows[state], depth + 1
            root[state], order[state] = len(top), depth
        top.append(state)
    return Chains(tuple(root), tuple(order), tuple(top))


def _reaches(follows: dict[int, int], start: int, goal: int) -> bool:
    while start != goal and start in follows:
        start = follows[start]
    return start == goal
