"""The parts of a `Model`: states, inputs, parameters, outputs, spline functions."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import sympy as sp

Hold = Literal["zero", "first", "cubic"]
Scope = Literal["shared", "recording"]
Formula: TypeAlias = "str | float | sp.Expr"

@dataclass(frozen=True)
class State:
    """A state; `initial` is its value at the first instant, a formula of parameters and inputs.

    `initial="free"` in `Model.from_dict` or a model file makes it a parameter `<name>_0`.
    """

    name: str
    unit: str = ""
    initial: sp.Expr = sp.S.Zero


@dataclass(frozen=True)
class Input:
    """A recorded input.  `delay` [s] shifts it.

    `hold` says what happens between its samples: it stays ("zero"), runs in straight lines
    ("first"), or smoothly ("cubic": a cubic spline, for signals without power near half the
    sampling rate).

    `backlash`, in the input's unit, is half the play that the recorded signal has to cross before
    anything moves, each time that it turns round; behind it the signal changes no faster than
    `rate_limit` per second (0: as fast as it likes).  `backlash_start` says where in the play it
    begins, from -1 (below) to 1 (above): what acts first is the recorded signal and so many half
    plays.  Without it nothing acts before the record begins, as on a rig at rest.

    `past`, in the input's unit, is what acted before the record begins, and with a delay still
    does for a while; without it the first recorded value did.
    """

    name: str
    unit: str = ""
    hold: Hold = "zero"
    default: float | None = None
    delay: sp.Expr = sp.S.Zero
    backlash: sp.Expr = sp.S.Zero
    rate_limit: sp.Expr = sp.S.Zero
    backlash_start: sp.Expr | None = None
    past: sp.Expr | None = None

    @property
    def formulas(self) -> dict[str, sp.Expr]:
        """Of parameters, by name of the field; without what is not given."""
        found = {"delay": self.delay, "backlash": self.backlash, "rate_limit": self.rate_limit}
        begins = {"backlash_start": self.backlash_start, "past": self.past}
        return found | {what: formula for what, formula in begins.items() if formula is not None}

    @property
    def shaped(self) -> bool:
        """Whether more acts than the recorded signal, or less: play, a limit of its rate, what was
        before.
        """
        return not (self.backlash.is_zero and self.rate_limit.is_zero and self.past is None)


@dataclass(frozen=True)
class Parameter:
    """A parameter: estimated from `value` as its guess when `free`, else held at `value`.

    `scope="recording"` gives every recording its own value in a joint fit.
    """

    name: str
    value: float
    unit: str = ""
    bounds: tuple[float, float] = (-math.inf, math.inf)
    free: bool = True
    scope: Scope = "shared"
    description: str = ""


@dataclass(frozen=True)
class Output:
    """A measured quantity y = h(x, u, t; p), seen `delay` seconds late, with noise `sigma`.

    `written` is h with ``derivative(x)`` where it shows the rate of a state, whose equation stands
    there in `expression`; None where it shows none.
    """

    name: str
    expression: sp.Expr
    unit: str = ""
    sigma: float | None = None
    delay: sp.Expr = sp.S.Zero
    written: sp.Expr | None = None

    @property
    def formula(self) -> sp.Expr:
        """As it was written."""
        return self.expression if self.written is None else self.written

    def with_swapped(self, swap: Mapping[sp.Expr, sp.Expr]) -> Output:
        """With formulas in the place of symbols."""
        return replace(self, expression=self.expression.xreplace(swap),
                       written=None if self.written is None else self.written.xreplace(swap))


@dataclass(frozen=True)
class Spline:
    """A B-spline function of one argument, usable in any formula of the model as ``name(arg)``.

    Its coefficients are the parameters ``name_0 ... name_{K-1}``, K = len(knots) - degree - 1.
    Outside the base interval [knots[degree], knots[-degree-1]] the outermost polynomial pieces
    go on, so that a simulation which strays a little stays smooth.
    """

    name: str
    degree: int
    knots: tuple[float, ...]

    @property
    def size(self) -> int:
        """The number of coefficients K."""
        return len(self.knots) - self.degree - 1

    @property
    def coefficient_names(self) -> tuple[str, ...]:
        """The parameters that hold the coefficients."""
        return tuple(f"{self.name}_{k}" for k in range(self.size))
