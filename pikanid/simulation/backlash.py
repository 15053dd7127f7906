"""Backlash for kernels that know none: a carrier and a side of contact as two inputs.

Behind a play of ±b an input is v = c + s·b: the carrier c follows the recorded signal while this
pushes, and s = ±1 says from which side (`pikanid.held.with_backlash`).  Between two contacts both
are straight lines whatever b is, so that sensitivities by b come out exact.
"""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
import sympy as sp

from pikanid.expressions import symbol
from pikanid.held import HeldInput, PiecewiseInput, with_backlash
from pikanid.model import Model


@functools.lru_cache(maxsize=64)
def with_sides(model: Model) -> Model:
    """The model with every input that has backlash written as c + s·b, its sides as last inputs.

    >>> from pikanid import systems
    >>> with_sides(systems.sloshing()).input_names
    ('u_x', 'u_y', 'u_z')
    """
    played = [i for i in model.inputs if i.backlash != 0]
    if not played:
        return model
    names = {i.name: _side_name(model, i.name) for i in played}
    swap = {symbol(i.name): symbol(i.name) + symbol(names[i.name]) * i.backlash for i in played}
    own = tuple(dataclasses.replace(i, backlash=sp.S.Zero) for i in model.inputs)
    return model.replace(
        inputs=(*own, *(dataclasses.replace(i, name=names[i.name], unit="", backlash=sp.S.Zero)
                        for i in played)),
        equations={n: e.xreplace(swap) for n, e in model.equations.items()},
        outputs=tuple(dataclasses.replace(o, expression=o.expression.xreplace(swap))
                      for o in model.outputs))


def _side_name(model: Model, name: str) -> str:
    side = f"{name}_side"
    while side in model.symbols:
        side += "_"
    return side


def split(model: Model, held: tuple[HeldInput, ...], halves: np.ndarray
          ) -> tuple[HeldInput | PiecewiseInput, ...]:
    """The inputs of `with_sides(model)` for half plays (m,) of the model's own inputs."""
    own: list[HeldInput | PiecewiseInput] = []
    sides: list[PiecewiseInput] = []
    for item, h, half in zip(model.inputs, held, halves, strict=True):
        if item.backlash == 0:
            own.append(h)
        else:
            carrier, side = with_backlash(h, float(half))
            own.append(carrier)
            sides.append(side)
    return (*own, *sides)
