"""Play and limited rates of inputs, for kernels that know neither: more inputs instead.

Behind a play of ±b and a limit R of its rate an input is v = c + s·b + q·R
(`pikanid.problem.held.acting`).  Between two knots c, s and q are straight lines, and s and q are
the derivatives by b and R: the sensitivities come out exact.
"""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
import sympy as sp

from pikanid.formula.expressions import symbol
from pikanid.model import Model
from pikanid.problem.held import HeldInput, PiecewiseInput, acting


def with_parts(model: Model) -> Model:
    """The model with every input that has play or a limited rate written as c + s·b + q·R; the
    parts s and q are its last inputs.

    >>> from pikanid.model import systems
    >>> with_parts(systems.sloshing()).input_names
    ('u_x', 'u_z')
    """
    # most models have none, and which model it is takes longer to tell
    return _with_parts(model) if any(i.shaped for i in model.inputs) else model


@functools.lru_cache(maxsize=64)
def _with_parts(model: Model) -> Model:
    plain = {"unit": "", "backlash": sp.S.Zero, "rate_limit": sp.S.Zero}
    added, swap = [], {}
    for item in model.inputs:
        whole = symbol(item.name)
        for what, formula in (("side", item.backlash), ("ramp", item.rate_limit)):
            if formula != 0:
                part = dataclasses.replace(item, name=_fresh(model, f"{item.name}_{what}"), **plain)
                added.append(part)
                whole += symbol(part.name) * formula
        swap[symbol(item.name)] = whole
    own = tuple(dataclasses.replace(i, **{**plain, "unit": i.unit}) for i in model.inputs)
    return model.replace(
        inputs=(*own, *added),
        equations={n: e.xreplace(swap) for n, e in model.equations.items()},
        outputs=tuple(o.with_swapped(swap) for o in model.outputs))


def _fresh(model: Model, name: str) -> str:
    while name in model.symbols:
        name += "_"
    return name


def split(model: Model, held: tuple[HeldInput, ...], halves: np.ndarray, rates: np.ndarray
          ) -> tuple[HeldInput | PiecewiseInput, ...]:
    """The inputs of `with_parts(model)` for half plays and greatest rates (m,) of its own ones."""
    own: list[HeldInput | PiecewiseInput] = []
    added: list[PiecewiseInput] = []
    for item, h, half, rate in zip(model.inputs, held, halves, rates, strict=True):
        if not item.shaped:
            own.append(h)
            continue
        carrier, side, ramp = acting(h, None if item.backlash == 0 else float(half), float(rate))
        own.append(carrier)
        added += [part for part, formula in ((side, item.backlash), (ramp, item.rate_limit))
                  if formula != 0]
    return (*own, *added)


def combined(model: Model, U: np.ndarray, halves: np.ndarray, rates: np.ndarray) -> np.ndarray:
    """The model's own inputs (L, m) from those of `with_parts(model)` (L, m + parts)."""
    own, part = U[:, :len(model.inputs)].copy(), len(model.inputs)
    for j, (item, half, rate) in enumerate(zip(model.inputs, halves, rates, strict=True)):
        for formula, factor in ((item.backlash, half), (item.rate_limit, rate)):
            if formula != 0:
                own[:, j] += factor * U[:, part]
                part += 1
    return own
